"""The main class of the API: a connected robot."""

from pathlib import Path

from sphero_probe.api.answer import Answer
from sphero_probe.api.arguments import Ids, colour_of, command_of, how_to_allow, ids_of, ids_text, node_text
from sphero_probe.api.notifications import QUEUE, Dispatcher, Notifications
from sphero_probe.api.running import Asked, OpenRuns, RunningPlan
from sphero_probe.catalogue.leds import Colour
from sphero_probe.catalogue.model import Robot
from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import CommandSilentError, NoAnswerError, RefusedByPolicyError, UsageError
from sphero_probe.link.policy import Consent
from sphero_probe.probing.failures import check as check_finding
from sphero_probe.probing.oneshot import send_once
from sphero_probe.probing.packed_probes import PackedProbes
from sphero_probe.probing.plan import Plan
from sphero_probe.probing.plan import sweep as probes_of_sweep
from sphero_probe.probing.plans.discovery import discovery
from sphero_probe.probing.plans.shipped import find_plan, is_shipped
from sphero_probe.protocol.packets import Command, Generation
from sphero_probe.session.commands import led_commands_for, node
from sphero_probe.session.identify import read_firmware, wake
from sphero_probe.session.session import Session


class ConnectedRobot:
    """A connected robot; ``sphero_probe.connect`` returns one.

    Every command passes the policy, with the consent that was given to ``connect``. Several tasks may use one
    robot at once.
    """

    def __init__(self, session: Session, dispatcher: Dispatcher, runs: OpenRuns) -> None:
        self._session = session
        self._dispatcher = dispatcher
        self._runs = runs

    def __repr__(self) -> str:
        return f"<ConnectedRobot {self.name!r}, {self.model.name if self.model else 'unknown model'}>"

    @property
    def name(self) -> str:
        """The advertised name, or the address if it has none; untrusted text."""
        return self._session.connection.name

    @property
    def address(self) -> str:
        """The device address, as ``connect`` takes it."""
        return self._session.connection.address

    @property
    def model(self) -> Robot | None:
        """The model: its ``key``, ``name``, ``nodes`` and LEDs; None if it is not known."""
        return self._session.connection.robot

    @property
    def generation(self) -> Generation:
        """The protocol that it uses."""
        return self._session.connection.generation

    @property
    def consent(self) -> Consent:
        """What may be sent."""
        return self._session.link.policy.consent

    @property
    def leds(self) -> tuple[str, ...]:
        """The names of its LEDs, for ``set_led``; empty if they are not known."""
        table = self.model.leds if self.model else None
        return tuple(group.name for group in table.groups) if table else ()

    async def firmware(self) -> dict[str, str]:
        """Ask for the firmware version of each node; a node that does not answer is left out.

        Raises:
            LinkLostError: the connection is lost.
        """
        await wake(self._session.link, self._session.target)
        return await read_firmware(self._session.link, self._session.target)

    async def send(
        self,
        what: str | int | Command,
        cid: int | None = None,
        payload: bytes | None = None,
        *,
        target: str | int | None = None,
        check: bool = True,
    ) -> Answer:
        """Send one command and return its answer.

        If the robot does not answer, it is woken and the command is sent again, unless the command may move
        the robot or change what it stores.

        Args:
            what: a name of the catalogue, ``"power.get_battery_percentage"``; a DID; or a ``Command``.
            cid: the CID, where ``what`` is a DID.
            payload: the argument bytes; None for a command that takes none.
            target: the node, ``"primary"`` or its address byte; ``"none"`` sends no address; None for the
                node that serves the command.
            check: raise an error if the command did not succeed; False returns an answer instead.

        Raises:
            UsageError: there is no such command or node, or the command takes arguments.
            RefusedByPolicyError: the consent does not cover the command; nothing was sent.
            RobotRefusedError: the robot answered with an error.
            CommandSilentError: the robot answers other commands, but not this one.
            NoAnswerError: the robot answers nothing at all.
            LinkLostError: the connection is lost.
        """
        return await self._send(command_of(self._session.connection, what, cid, payload, target), check=check)

    async def set_led(self, name: str, color: str | Colour) -> Answer:
        """Set an LED; this allows the class ``write``, only for the LED's own command.

        Args:
            name: one of ``leds``, or another name of the robot's table such as ``headlights``.
            color: ``"ff0000"``, ``"f00"``, or red, green and blue from 0 to 255.

        Returns:
            The last answer, if several LEDs share the name.

        Raises:
            UsageError: there is no such LED or colour.
            SpheroProbeError: as ``send`` does.
        """
        return (await self._light({name.lower(): colour_of(color)}, off=False))[-1]

    async def set_leds(self, colors: dict[str, str | Colour], *, off: bool = False) -> list[Answer]:
        """Set several LEDs in as few commands as the robot allows; this allows ``write``, only for them.

        Args:
            colors: LED name -> colour.
            off: also switch off every LED that is not named.

        Raises:
            UsageError: there is no such LED or colour, or nothing to set.
            SpheroProbeError: as ``send`` does.
        """
        return await self._light({name.lower(): colour_of(color) for name, color in colors.items()}, off=off)

    def sweep(
        self,
        did: Ids,
        cid: Ids = range(256),
        *,
        target: str | int | None = None,
        payload: bytes | None = None,
        journal: Path | str | None = None,
    ) -> RunningPlan:
        """Return a sweep over every DID with every CID; it runs while you iterate over it.

        Args:
            did: device ids: ``0x13``, ``"power"``, ``"0x10-0x1a"``, ``[0x11, 0x13]``.
            cid: command ids, in the same forms.
            target: the node, ``"primary"`` or its address byte; None for the usual one.
            payload: send exactly these bytes with every command; None sends documented reads with proper
                arguments, and all others at a length that no command accepts.
            journal: the file of a new journal; None keeps none.

        Raises:
            UsageError: an id or node makes no sense.
        """
        dids, cids = ids_of(did, self.generation, devices=True), ids_of(cid, self.generation, devices=False)
        probes = PackedProbes(probes_of_sweep(dids, cids, payload=payload))
        options = {"did": ids_text(dids), "cid": ids_text(cids)}
        if payload is not None:
            options["payload"] = payload.hex()
        plan = Plan("sweep", f"DID {options['did']}", [probes])
        return self._running("sweep", plan, target, options, journal)

    def discover(
        self,
        did: Ids = range(256),
        *,
        lengths: bool = False,
        values: bool = False,
        journal: Path | str | None = None,
    ) -> RunningPlan:
        """Return the plan that maps the whole robot; it runs while you iterate over it.

        Args:
            did: the device ids to look at.
            lengths: also find out which lengths a command accepts, if consent covers executing it.
            values: also try other values, if one was rejected.
            journal: the file of a new journal; None keeps none.

        Raises:
            UsageError: an id makes no sense.
        """
        dids = ids_of(did, self.generation, devices=True)
        plan = discovery(self.generation, self._session.target, dids=dids, lengths=lengths, values=values)
        options = {"did": ids_text(dids), "lengths": str(int(lengths)), "values": str(int(values))}
        return self._running("discover", plan, None, options, journal)

    def run(
        self,
        plan: Plan | Path | str,
        *,
        target: str | int | None = None,
        journal: Path | str | None = None,
    ) -> RunningPlan:
        """Return a plan that runs while you iterate over it.

        Args:
            plan: a ``Plan``, a plan file, or the name of a plan that comes with the tool.
            target: the node for probes that name none; None for the usual one.
            journal: the file of a new journal; None keeps none.

        Raises:
            BadInputFileError: there is no such plan, or it is broken.
            UsageError: there is no such node.
        """
        made = plan if isinstance(plan, Plan) else find_plan(str(plan))
        options = {}
        if made.file:
            shipped = is_shipped(made.file)
            options = {"plan": made.file.stem} if shipped else {"plan_file": str(made.file.absolute())}
        return self._running("sweep", made, target, options, journal)

    def notifications(self, *, seconds: float | None = None, queue: int = QUEUE) -> Notifications:
        """Listen to what the robot sends by itself, from this call on; most must be switched on by a command.

        Args:
            seconds: end after this time; None ends when the connection is closed.
            queue: how many may wait. Beyond that, the oldest are dropped and counted in ``dropped``.
        """
        return self._dispatcher.listen(queue, seconds)

    async def reconnect(self) -> None:
        """Open a dropped link to the same robot again. A running plan does this by itself.

        Raises:
            LinkLostError: another robot answers there.
            SpheroProbeError: as connecting does.
        """
        self._dispatcher.link_may_change()
        try:
            await self._session.reconnect()
        finally:
            self._dispatcher.link_stands()

    async def _send(self, command: Command, *, check: bool) -> Answer:
        link = self._session.link
        finding = await send_once(link, command)
        answer = Answer.of(finding, link.codec)
        if check:
            try:
                await check_finding(finding, self._session)
            except RefusedByPolicyError as error:
                error.hint = how_to_allow(finding.risk)
                raise
            except CommandSilentError as error:
                error.hint = "try connect(…, timeout=SECONDS) with more of them, or another target"
                raise
            except NoAnswerError as error:
                error.hint = (
                    "shake it, or put it on its charger and take it off; "
                    "or try connect(…, timeout=SECONDS) with more of them"
                )
                raise
        return answer

    async def _light(self, wanted: dict[str, Colour], *, off: bool) -> list[Answer]:
        connection = self._session.connection
        commands = led_commands_for(wanted, connection.robot, connection.port, None, off=off)
        if not commands:
            raise UsageError("no LED is named", "write: set_leds({'front': 'ff0000'})")
        with self._session.link.policy.implying(Risk.WRITE, *commands):
            return [await self._send(command, check=True) for command in commands]

    def _running(
        self,
        command: str,
        plan: Plan,
        target: str | int | None,
        options: dict[str, str],
        journal: Path | str | None,
    ) -> RunningPlan:
        connection = self._session.connection
        address = node(node_text(target), connection.robot, connection.port)
        return RunningPlan(self._runs, Asked(command, plan, address, options, journal))
