"""The fake robot: what a host writes and the time come in, what the robot says goes out when due."""

from collections.abc import Callable
from random import Random
from typing import NamedTuple, assert_never

from sphero_probe.catalogue.risk import Risk
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Malformed, Request, Role, Verdict
from sphero_probe.simulator.behaviours import REPERTOIRES, execute
from sphero_probe.simulator.calls import Call, News, Reply
from sphero_probe.simulator.firmware import LONGEST, Fact, FirmwareCommand
from sphero_probe.simulator.manners import MANNERS
from sphero_probe.simulator.radio import Radio
from sphero_probe.simulator.readings import identity
from sphero_probe.simulator.rest import Rest, Turn
from sphero_probe.simulator.settings import Settings, Strict
from sphero_probe.simulator.state import State


class Executed(NamedTuple):
    """One line of the ledger: a command that a robot really ran.

    Attributes:
        node: number of the processor.
        did: device id.
        cid: command id.
        payload: as it was received.
        risk: what running it does, whatever a catalogue thinks.
    """

    node: int
    did: int
    cid: int
    payload: bytes
    risk: Risk

    def as_json(self) -> dict[str, object]:
        """The line as a JSON object; the payload in hex, the risk as a word."""
        return {**self._asdict(), "payload": self.payload.hex(), "risk": self.risk.word}


class FakeRobot:
    """A robot behind a line, without I/O and without a clock: the caller says what time it is.

    Attributes:
        model: what it plays.
        address: its MAC, stable per model and seed.
        malformed: number of packets that arrived damaged and were ignored.
    """

    def __init__(self, settings: Settings, on_execute: Callable[[Executed], None] | None = None) -> None:
        self.model = settings.model
        self.malformed = 0
        self._own_name, self.address = identity(settings.model, settings.seed)
        self._settings = settings
        self._on_execute = on_execute
        self._repertoire = REPERTOIRES[settings.model.generation]
        idleness = self._repertoire.idleness
        self._state = State(settings, Rest(idleness.timeout, idleness.notice))
        self._radio = Radio(settings)
        self._codec = CODECS[settings.model.generation]
        self._codes = {self._codec.verdict(code): code for code in range(0xFF, -1, -1)}
        self._manners = MANNERS[settings.model.generation]
        self._decoder = self._codec.decoder(Role.ROBOT)
        self._busy = Random(f"{settings.seed} busy")

    @property
    def name(self) -> str:
        """The Bluetooth name: the robot's own, until another one is set."""
        for (_, *pair), payload in self._state.memory.items():
            if tuple(pair) == self._repertoire.name_setter:
                return payload.partition(b"\0")[0].decode("utf-8", "replace")
        return self._own_name

    @property
    def leds(self) -> dict[str, int]:
        """Channel -> brightness 0-255: ``front_red`` for a lamp of three channels, ``head`` for one."""
        return dict(self._state.leds)

    @property
    def asleep(self) -> bool:
        """It hears nothing but wake; not even that in deep sleep."""
        return self._state.asleep

    def truth(self) -> list[Fact]:
        """Return every command that exists, in rising order of node, device and command id."""
        return self._state.firmware.truth()

    def wake(self, *, now: float) -> None:
        """Wake it by other means than a command: a BLE write of its own kind, or a touch.

        Nothing else wakes a V1 robot that was told, or came, to sleep. From deep sleep it does not wake.
        """
        if not (self._state.off or self._state.in_bootloader):
            self._state.asleep = False
            self._state.rest.touch(now=now)

    def hear(self, data: bytes, *, now: float) -> None:
        """Take what the host wrote; ``now`` in seconds of the caller's clock."""
        self._pass_time(now)
        for packet in self._decoder.feed(self._radio.carry(data)):
            match packet:
                case Request():
                    self._serve(packet, now)
                case Malformed():
                    self.malformed += 1
                case _:  # somebody else's answer
                    pass

    def speak(self, *, now: float) -> list[bytes]:
        """Return the chunks that have arrived at the host by ``now``, in order."""
        self._pass_time(now)
        return self._radio.receive(now=now)

    def next_time(self) -> float | None:
        """Return when ``speak`` may have something again, None when only ``hear`` can bring that about."""
        stream = self._state.stream
        times = (self._radio.next_time(), stream.due if stream else None, self._state.rest.due)
        return min((time for time in times if time is not None), default=None)

    def _serve(self, request: Request, now: float) -> None:
        did, cid, *_ = request.command
        state = self._state
        if state.off or (state.asleep and (did, cid) != self._repertoire.wake):
            return
        node, reply = self._reply(request, now)
        code = self._codes[reply.verdict] if reply.code is None else reply.code
        well = self._codec.verdict(code) is Verdict.OK
        if self._manners.is_answered(request, well) and (did, cid) not in self._settings.silent:
            response = self._manners.respond(request, self.model.answer_style, node, code, reply.payload)
            self._radio.send(self._codec.encode_response(response), now=now)
        if reply.prompt:
            self._radio.send(reply.prompt, now=now)
        for news in reply.news:
            self._notify(news, now)
        if self._manners.is_activity(request) and not (state.asleep or state.in_bootloader):
            state.rest.touch(now=now)

    def _reply(self, request: Request, now: float) -> tuple[int, Reply]:
        """Find out what a request gets, and from which node."""
        did, cid, payload, _ = request.command
        wanted = self._manners.node_wanted(request)
        if wanted and wanted not in self.model.nodes:
            return wanted, Reply(Verdict.NO_TARGET)
        firmware = self._state.firmware
        nodes = (wanted,) if wanted else tuple(self.model.nodes)
        node = next((node for node in nodes if firmware.find(node, did, cid)), nodes[0])
        command = firmware.find(node, did, cid)
        if objection := self._manners.objection(request):
            return node, Reply(objection)
        if self._settings.busy and self._busy.random() < self._settings.busy:
            return node, Reply(Verdict.BUSY)
        shut_out = self._state.in_bootloader and did != self._repertoire.bootloader
        if shut_out or not firmware.has_device(node, did):
            return node, Reply(Verdict.NO_DEVICE)
        if command is None:
            masked = self._settings.mask and payload
            return node, Reply(Verdict.BAD_LENGTH if masked else Verdict.NO_COMMAND)
        if not self._takes(command, len(payload)):
            return node, Reply(Verdict.BAD_LENGTH)
        reply = execute(Call(self._state, command, _fitted(command, payload), now))
        if reply.verdict is Verdict.OK and self._on_execute:
            self._on_execute(Executed(node, did, cid, payload, command.risk))
        return node, reply

    def _takes(self, command: FirmwareCommand, length: int) -> bool:
        match self._settings.strict:
            case Strict.EXACT:
                return command.lengths.accepts(length)
            case Strict.MINIMUM:
                return length >= command.lengths.minimum
            case Strict.NONE:
                return True

    def _notify(self, news: News, now: float) -> None:
        notification = self._manners.notify(self.model.answer_style, news.node, news.pair, news.payload)
        self._radio.send(self._codec.encode_notification(notification), now=now)

    def _pass_time(self, now: float) -> None:
        """Let happen what happens by itself until ``now``, in order."""
        rest = self._state.rest
        rest.begin(now=now)
        while rest.due is not None and rest.due <= now:
            due = rest.due
            self._run_stream(due)
            self._turn(rest.take(), due)
        self._run_stream(now)

    def _run_stream(self, now: float) -> None:
        stream = self._state.stream
        while stream and (sample := stream.sample(now=now)):
            due, payload = sample
            self._notify(News(stream.wish.node, stream.wish.pair, payload), due)

    def _turn(self, turn: Turn, now: float) -> None:
        idleness = self._repertoire.idleness
        node = next(iter(self.model.nodes))
        match turn:
            case Turn.WARN:
                self._notify(News(node, idleness.warning), now)
            case Turn.SLEEP:
                self._state.fall_asleep()
                self._notify(News(node, idleness.asleep), now)
            case Turn.WAKE:
                self.wake(now=now)
            case _:
                assert_never(turn)


def _fitted(command: FirmwareCommand, payload: bytes) -> bytes:
    """Cut off what a command ignores, and fill up with zeros what it reads beyond the end."""
    longest = LONGEST if command.lengths.maximum is None else command.lengths.maximum
    return payload[:longest].ljust(command.lengths.minimum, b"\0")
