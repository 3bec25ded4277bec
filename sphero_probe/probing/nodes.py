"""Which nodes a robot has: a connected robot in, each address with who answers there and what it serves out.

Every node number is asked an echo on the client's port and on port 0, so are the wildcard and no address at
all. Of each node that answers, the firmware and the list of devices are read. The wildcard is then asked a
documented read per device: the source of the answer names the node that serves it.
"""

import asyncio
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Final

from sphero_probe.catalogue import all_rows, commands_of, devices_of
from sphero_probe.catalogue.model import CommandRow, Kind, Robot
from sphero_probe.catalogue.risk import Risk
from sphero_probe.catalogue.well_known import VERSION_FIELDS, WellKnown, row_for
from sphero_probe.link.concurrent import ask_together
from sphero_probe.link.exchange import Answered, Exchange, Silent, Unsolicited
from sphero_probe.link.unsolicited import describe_unsolicited
from sphero_probe.probing.finding import Note
from sphero_probe.probing.introduction import introduce
from sphero_probe.probing.node_notes import nodes_note
from sphero_probe.probing.prober import BUSY_ATTEMPTS, BUSY_PAUSE
from sphero_probe.probing.retries import MOST_ATTEMPTS, LossEstimate
from sphero_probe.probing.system import NODES, NodeAnswer, NodeState, Served, System
from sphero_probe.protocol.address import WILDCARD, Address
from sphero_probe.protocol.packets import Command, Response, Verdict
from sphero_probe.session.identify import wake
from sphero_probe.session.reconnect import Reconnector
from sphero_probe.session.session import Session
from sphero_probe.simulator.recorded import is_not_recorded

_NONCE_BYTES: Final = 4
_STYLES: Final = {(True, True): "swapped", (False, True): "SID only", (True, False): "TID only"}


async def survey(session: Session, stop: asyncio.Event | None = None) -> System:
    """Ask a robot about its nodes.

    Args:
        session: with the robot.
        stop: set it to end early; what was not asked by then is silent.

    Raises:
        NoAnswerError: the robot answers nothing.
        LinkLostError: the robot is gone.
    """
    connection, codec, target = session.connection, session.link.codec, session.target
    robot = connection.robot
    system = System(connection.name, robot, connection.line)
    model = robot.name if robot else "this robot"
    if not codec.has_addresses:
        protocol = codec.generation.value.upper()
        return system._replace(note=f"{model} has no nodes to ask: {protocol} packets carry no addresses.")
    if target is None:
        return system._replace(note=f"{model} has no nodes to ask: it takes commands without addresses.")
    line = Reconnector(session.link, target, stop, session.reconnect)

    async def begin() -> None:
        unsolicited: list[Unsolicited] = []
        with describe_unsolicited(line.link, lambda packet, _: unsolicited.append(packet)):
            await introduce(line, target, session.on_step, unsolicited)

    await line.with_reconnect(begin)
    system = await _Survey(line, target, robot).run(system)
    if line.lost:
        raise line.lost
    return system


async def survey_notes(line: Reconnector, target: int | None, device: str, reached: str) -> list[Note]:
    """Ask a robot about its nodes during a run; return the note of that.

    There is none for a robot without addresses, and none if the link is lost or the run is stopped meanwhile.

    Args:
        line: to a robot that is awake.
        target: the address byte of its usual node, None for a robot without addresses.
        device: the robot's name or address.
        reached: how it is reached, ``BLE`` or ``UART``.
    """
    if target is None:
        return []
    link = line.link
    system = System(device, link.policy.robot, reached)
    system = await _Survey(line, target, system.robot).run(system)
    return [] if line.lost or line.is_stopped else [nodes_note(system, link.codec)]


class _Survey:
    """Asks one robot, over drops of the link; what was answered once is not asked again."""

    def __init__(self, line: Reconnector, target: int, robot: Robot | None) -> None:
        self._line = line
        self._target = target
        self._codec = line.link.codec
        self._robot = robot
        self._loss = LossEstimate()
        self._answers: dict[Command, Exchange] = {}
        self._nonce = 0
        self._silences: Counter[Command] = Counter()

    async def run(self, system: System) -> System:
        """Return the system with what was found."""
        targets = _targets(Address.from_byte(self._target).port)
        self._loss.probes = 2 * len(targets)
        echoes = {target: self._echo(target) for target in targets}
        await self._ask_all(echoes.values())
        await self._wake_unavailable(echoes)
        found = [self._state(target, echoes[target]) for target in targets]
        found = await self._details(found)
        found = await self._wildcards(found)
        client, addressing = self._addressing()
        return system._replace(client=client, addressing=addressing, nodes=tuple(found))

    def _echo(self, target: int | None) -> Command:
        row = row_for(self._codec.generation, WellKnown.ECHO)
        assert row is not None
        self._nonce += 1
        return Command(row.did, row.cid, self._nonce.to_bytes(_NONCE_BYTES, "big"), target)

    async def _ask_all(self, commands: Iterable[Command]) -> None:
        """Ask what has no answer yet, and once more what is silent: by then more is known about losses."""
        wanted = list(commands)

        async def work() -> None:
            await ask_together(self._ask(command) for command in wanted if command not in self._answers)
            silent = [command for command in wanted if isinstance(self._answers[command], Silent)]
            await ask_together(self._ask(command) for command in silent)

        await self._line.with_reconnect(work)

    async def _ask(self, command: Command) -> None:
        """Ask until it is answered, or chance does not explain its silence any more."""
        pause, busy, attempt = BUSY_PAUSE, 0, self._silences[command]
        if attempt >= min(self._loss.attempts_wanted, MOST_ATTEMPTS):
            return
        while True:
            attempt += 1
            exchange = await self._line.link.ask(command, alone=attempt > 1)
            if isinstance(exchange, Silent):
                self._silences[command] = attempt
                if attempt < min(self._loss.attempts_wanted, MOST_ATTEMPTS):
                    continue
            elif isinstance(exchange, Answered):
                self._loss.learn(attempt - busy)
                if self._codec.verdict(exchange.response.code) is Verdict.BUSY and busy < BUSY_ATTEMPTS:
                    busy += 1
                    await asyncio.sleep(pause)
                    pause *= 2
                    continue
            self._answers[command] = exchange
            return

    async def _wake_unavailable(self, echoes: dict[int | None, Command]) -> None:
        """Wake the robot for nodes that are unavailable, and ask those once more."""
        again = [
            command
            for command in echoes.values()
            if self._verdict(self._response(command)) is Verdict.TARGET_UNAVAILABLE
        ]
        if not again:
            return
        await self._line.with_reconnect(lambda: wake(self._line.link, self._target))
        before = {command: self._answers.pop(command) for command in again}
        await self._ask_all(again)
        for command in again:
            if self._response(command) is None:  # silent now; what it said before still counts
                self._answers[command] = before[command]

    def _response(self, command: Command) -> Response | None:
        exchange = self._answers.get(command)
        if isinstance(exchange, Answered) and not is_not_recorded(exchange.response):
            return exchange.response
        return None

    def _verdict(self, response: Response | None) -> Verdict | None:
        return self._codec.verdict(response.code) if response else None

    def _state(self, target: int | None, echo: Command) -> NodeAnswer:
        response = self._response(echo)
        if response is None:
            return NodeAnswer(target, NodeState.SILENT)
        states = {
            Verdict.NO_TARGET: NodeState.ABSENT,
            Verdict.TARGET_UNAVAILABLE: NodeState.UNAVAILABLE,
        }
        state = states.get(self._codec.verdict(response.code), NodeState.ANSWERS)
        return NodeAnswer(target, state, response.code, response.source)

    async def _details(self, found: list[NodeAnswer]) -> list[NodeAnswer]:
        """Read firmware and devices of each node once, through the first address that answers."""
        first: dict[int, int] = {}
        for one in found:
            if one.target is not None and one.state is NodeState.ANSWERS:
                address = Address.from_byte(one.target)
                if not address.is_wildcard:
                    first.setdefault(address.node, one.target)
        questions = {
            (node, job): Command(row.did, row.cid, b"", target)
            for node, target in first.items()
            for job in (WellKnown.VERSION, WellKnown.CLAIMED_DEVICES)
            if (row := row_for(self._codec.generation, job))
        }
        await self._ask_all(questions.values())
        return [self._detailed(one, questions) for one in found]

    def _detailed(self, one: NodeAnswer, questions: dict[tuple[int, WellKnown], Command]) -> NodeAnswer:
        node = None if one.target is None else Address.from_byte(one.target).node
        if not node or one.state not in (NodeState.ANSWERS, NodeState.UNAVAILABLE):
            return one
        version = self._fields(WellKnown.VERSION, questions.get((node, WellKnown.VERSION)))
        listed = self._response_to(questions.get((node, WellKnown.CLAIMED_DEVICES)))
        claimed = self._verdict(listed) is Verdict.OK
        devices = tuple(sorted(set(listed.payload))) if listed and claimed else devices_of(self._robot, node)
        parts = (version.get(part) for part in VERSION_FIELDS[self._codec.generation])
        firmware = ".".join(str(part) for part in parts if part is not None)
        return one._replace(devices=devices, claimed=claimed, firmware=firmware)

    def _response_to(self, command: Command | None) -> Response | None:
        return self._response(command) if command else None

    def _fields(self, job: WellKnown, command: Command | None) -> dict[str, object]:
        row, response = row_for(self._codec.generation, job), self._response_to(command)
        if row is None or row.response is None or response is None:
            return {}
        return row.response.decode(response.payload).fields if response.payload else {}

    async def _wildcards(self, found: list[NodeAnswer]) -> list[NodeAnswer]:
        """Ask the first wildcard that answers a read per device, and take in which node served it."""
        wildcard = next(
            (one for one in found if _is_wildcard(one.target) and one.state is NodeState.ANSWERS), None
        )
        if wildcard is None:
            return found
        devices = {did for one in found for did in one.devices}
        asked = [(row, Command(row.did, row.cid, b"", wildcard.target)) for row in self._reads(devices)]
        await self._ask_all(command for _, command in asked)
        served: list[Served] = []
        for row, command in asked:
            response = self._response(command)
            if response and self._verdict(response) is Verdict.OK:
                node = None if response.source is None else Address.from_byte(response.source).node
                served.append(Served(row, node))
        return [one._replace(served=tuple(served)) if one is wildcard else one for one in found]

    def _reads(self, devices: set[int]) -> Iterator[CommandRow]:
        """Yield a documented read without arguments per device, and per set of nodes that serve it."""
        rows = commands_of(self._robot) if self._robot else all_rows(self._codec.generation)
        seen: set[tuple[int, tuple[int, ...]]] = set()
        for row in sorted(rows, key=lambda row: (row.did, -row.cid)):
            if row.kind is not Kind.COMMAND or row.risk is not Risk.READ or row.did not in devices:
                continue
            nodes = row.nodes.get(self._robot.key, ()) if self._robot else ()
            if (row.did, nodes) not in seen and row.request and row.request.fixed_length == 0:
                seen.add((row.did, nodes))
                yield row

    def _addressing(self) -> tuple[int | None, str]:
        """Return the client's address and the style of the answers to commands with both addresses."""
        answers = [
            exchange.response
            for command, exchange in self._answers.items()
            if isinstance(exchange, Answered) and command.target is not None
        ]
        clients = Counter(response.target for response in answers if response.target is not None)
        styles = {
            _STYLES.get((response.target is not None, response.source is not None), "none")
            for response in answers
        }
        client = clients.most_common(1)[0][0] if clients else None
        return client, " or ".join(sorted(styles))


def _targets(port: int) -> list[int | None]:
    """Return the addresses to ask: the nodes and the wildcard behind each port, then none at all."""
    ports = dict.fromkeys((port, 0))
    nodes = [Address(port, node).byte for port in ports for node in NODES]
    return [*nodes, *(Address(port, WILDCARD).byte for port in ports), None]


def _is_wildcard(target: int | None) -> bool:
    return target is not None and Address.from_byte(target).is_wildcard
