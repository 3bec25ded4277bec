"""The fake robot: it takes what a host writes and the time, and gives the bytes that are due."""

from collections.abc import Callable
from random import Random
from typing import Final, assert_never

from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Malformed, Request, Role, Verdict
from sphero_probe.simulator.calls import News, Reply
from sphero_probe.simulator.command_queue import CommandQueue
from sphero_probe.simulator.execution import BEHAVIOURS, Executed, attempt
from sphero_probe.simulator.firmware import Fact
from sphero_probe.simulator.network import Network, Wiring
from sphero_probe.simulator.radio import Radio
from sphero_probe.simulator.readings import identity
from sphero_probe.simulator.response_style import RESPONSE_STYLES
from sphero_probe.simulator.settings import Overflow, Settings
from sphero_probe.simulator.sleep_timer import SleepEvent, SleepTimer
from sphero_probe.simulator.state import State
from sphero_probe.simulator.topology import Ending, Route

BOOTING: Final = 1.5
"""Seconds from a reboot until the robot takes commands again; an assumption."""


class FakeRobot:
    """A robot at one end of a connection, without I/O and without a clock: the caller passes the time.

    Attributes:
        model: what it plays.
        address: its MAC, stable per model and seed.
        malformed: number of packets that arrived damaged and were ignored.
        connected: there is a line to it; what is written without one is lost.
        connection: number of the current or last connection; a robot comes with its first one.
        silent: (did, cid) pairs that it never answers; may be changed at any time.
        on_execute: called with every command that it really ran.
        on_drop: called when the line drops.
    """

    def __init__(
        self,
        settings: Settings,
        on_execute: Callable[[Executed], None] | None = None,
        *,
        wiring: Wiring | None = None,
    ) -> None:
        """Start a robot.

        Args:
            settings: what it is and how it behaves.
            on_execute: called with every command that it executes.
            wiring: the nodes that it has and how its client is connected; None for those of the model.

        Raises:
            UsageError: the settings name a line or a node that the robot does not have.
        """
        self.model = settings.model
        self.malformed = 0
        self.connected = True
        self.connection = 1
        self._heard = 0
        self._own_name, self.address = identity(settings.model, settings.seed)
        self._settings = settings
        self.silent = set(settings.silent)
        self.on_execute = [on_execute] if on_execute else []
        self.on_drop: Callable[[], None] = lambda: None
        self._behaviours = BEHAVIOURS[settings.model.generation]
        idleness = self._behaviours.idleness
        timeout = idleness.timeout if settings.sleep_after is None else settings.sleep_after
        self._network = Network(settings, wiring)
        self._state = State(settings, SleepTimer(timeout, idleness.notice), self._network.nodes)
        self._queue = CommandQueue(settings.queue, settings.service)
        self._radio = Radio(settings)
        self._codec = CODECS[settings.model.generation]
        self._codes = {self._codec.verdict(code): code for code in range(0xFF, -1, -1)}
        self._style = RESPONSE_STYLES[settings.model.generation]
        self._decoder = self._codec.decoder(Role.ROBOT)
        self._busy = Random(f"{settings.seed} busy")

    @property
    def name(self) -> str:
        """The Bluetooth name: the robot's own, until another one is set."""
        for (_, *pair), payload in self._state.memory.items():
            if tuple(pair) == self._behaviours.name_setter:
                return payload.partition(b"\0")[0].decode("utf-8", "replace")
        return self._own_name

    @property
    def leds(self) -> dict[str, int]:
        """Channel -> brightness 0-255: ``front_red`` for an LED of three channels, ``head`` for one."""
        return dict(self._state.leds)

    @property
    def sensors(self) -> dict[str, float]:
        """Sensor -> the value that the streaming services deliver: ``pitch``, ``ambient_light``."""
        return self._state.sensors

    @property
    def asleep(self) -> bool:
        """It takes no command but wake; in deep sleep, none at all."""
        return self._state.asleep

    def truth(self) -> list[Fact]:
        """Return every command that exists, in rising order of node, device and command id."""
        return self._state.firmware.truth()

    def connect(self, *, now: float) -> None:
        """Begin a new connection, in place of the one there may be; the robot stays as it is.

        What was under way on the old one is lost. Who connects to a robot that no command wakes also writes
        what wakes it.
        """
        self._pass_time(now)
        self.drop(now=now)
        self.connected = True
        self.connection += 1
        self._heard = 0
        self._decoder = self._codec.decoder(Role.ROBOT)
        self._radio.connect(now=now)
        if self._behaviours.wake is None or not self._state.asleep:
            self.wake(now=now)

    def drop(self, *, now: float) -> None:
        """Lose the line; what has arrived at the host by ``now`` can still be spoken, all else is lost."""
        self.connected = False
        self._queue.clear()
        self._radio.drop(now=now)
        self.on_drop()

    def fall_asleep(self, *, now: float) -> None:
        """Sleep at once, as it does by itself after a time without activity."""
        self._pass_time(now)
        self._happen(SleepEvent.SLEEP, now)

    def wake(self, *, now: float) -> None:
        """Wake it by other means than a command: a BLE write of its own kind, or a touch.

        Nothing else wakes a V1 robot that sleeps. From deep sleep it does not wake.
        """
        state = self._state
        if not (state.off or state.in_bootloader or state.booting):
            state.asleep = False
            state.rest.touch(now=now)

    def hear(self, data: bytes, *, now: float) -> None:
        """Take what the host wrote; ``now`` in seconds of the caller's clock."""
        self._pass_time(now)
        if self.connected:
            self._radio.carry(data, now=now)
            self._pass_time(now)

    def speak(self, *, now: float) -> list[bytes]:
        """Return the chunks that have arrived at the host by ``now``, in order."""
        self._pass_time(now)
        return self._radio.receive(now=now)

    def next_time(self) -> float | None:
        """Return when ``speak`` may return something, None if it will not without another ``hear``."""
        times = (self._radio.next_time(), self._queue.due, self._state.stream_due, self._state.rest.due)
        return min((time for time in times if time is not None), default=None)

    def _arrive(self, data: bytes, now: float) -> None:
        """Take bytes that have reached the robot."""
        for packet in self._decoder.feed(data):
            match packet:
                case Request() if self.connected:
                    self._admit(packet, now)
                case Malformed():
                    self.malformed += 1
                case _:  # not a command, or sent after the connection was lost
                    pass

    def _admit(self, request: Request, now: float) -> None:
        if self._state.booting:
            return
        hears = not (self._state.off or self._state.asleep)
        if not self._queue.admit(request, now=now) and hears and self._settings.overflow is Overflow.BUSY:
            self._answer(request, self._route(request, now), Reply(Verdict.BUSY), now)
        self._serve_until(now)
        self._heard += 1
        if self.connected and self._heard == self._settings.disconnect_after:
            self.drop(now=now)

    def _serve_until(self, now: float) -> None:
        while self._queue.due is not None and self._queue.due <= now:
            due = self._queue.due
            self._serve(self._queue.take(), due)

    def _serve(self, request: Request, now: float) -> None:
        did, cid, *_ = request.command
        state = self._state
        if state.off or (state.asleep and (did, cid) != self._behaviours.wake):
            return
        if (did, cid) == self._settings.reboot_on:
            self._reboot(now)
            return
        was_asleep = state.asleep
        route = self._route(request, now)
        if route.ending is Ending.LOST:
            return
        reply = self._reply(request, route, now)
        self._answer(request, route, reply, now)
        if reply.prompt:
            self._radio.send(reply.prompt, now=now)
        for news in reply.news:
            self._notify(news, now)
        if (was_asleep or self._style.is_activity(request)) and not (state.asleep or state.in_bootloader):
            state.rest.touch(now=now)

    def _route(self, request: Request, now: float) -> Route:
        """Find the node that takes a command; of the nodes that have it, the first for the wildcard."""
        did, cid, *_ = request.command
        firmware = self._state.firmware
        return self._network.receive(request, lambda node: firmware.find(node, did, cid) is not None, now=now)

    def _answer(self, request: Request, route: Route, reply: Reply, now: float) -> None:
        """Send a reply, if the command wants one and the robot is not mute on it."""
        code = self._codes[reply.verdict] if reply.code is None else reply.code
        well = self._codec.verdict(code) is Verdict.OK
        addresses = self._network.answer(route, now=now)
        if addresses and self._style.is_answered(request, well) and request.command[:2] not in self.silent:
            style = self.model.answer_style
            response = self._style.respond(request, style, addresses, code, reply.payload)
            self._radio.send(self._codec.encode_response(response), now=now, is_answer=True)

    def _reboot(self, now: float) -> None:
        """Fall silent and off the line, and forget what does not outlive power."""
        self._state.restart()
        self._state.in_bootloader = False
        self._state.booting = True
        self._state.rest.boot(now + BOOTING)
        self.drop(now=now)

    def _boot(self, now: float) -> None:
        """Take commands again, and send the notification that says so."""
        self._state.booting = False
        self.wake(now=now)
        if self._behaviours.prompt and self.connected:
            self._radio.send(self._behaviours.prompt, now=now)
        if self._behaviours.awake:
            self._notify(News(self._network.nodes[0], self._behaviours.awake), now)

    def _reply(self, request: Request, route: Route, now: float) -> Reply:
        """Find out what a command gets from the node where it ended."""
        if route.ending is Ending.BAD_TARGET:
            return Reply(Verdict.NO_TARGET)
        if route.ending is Ending.UNAVAILABLE:
            return Reply(Verdict.TARGET_UNAVAILABLE)
        if objection := self._style.objection(request):
            return Reply(objection)
        if self._settings.busy and self._busy.random() < self._settings.busy:
            return Reply(Verdict.BUSY)
        node, asked = route.place.node, request.command
        reply, ran = attempt(self._state, node, asked, self._settings.mask, now=now)
        if ran:
            executed = Executed(node, asked.did, asked.cid, asked.payload, ran.risk)
            for tell in self.on_execute:
                tell(executed)
        return reply

    def _notify(self, news: News, now: float) -> None:
        if self.connected and self._network.is_heard(news.node, now=now):
            notification = self._style.notify(self.model.answer_style, news.node, news.pair, news.payload)
            self._radio.send(self._codec.encode_notification(notification), now=now)

    def _pass_time(self, now: float) -> None:
        """Let happen what happens by itself until ``now``, in order."""
        rest, queue, radio = self._state.rest, self._queue, self._radio
        self._network.begin(now=now)
        rest.begin(now=now)
        radio.begin(now=now)
        while times := [at for at in (queue.due, rest.due, radio.due) if at is not None and at <= now]:
            due = min(times)
            self._run_stream(due)
            if queue.due == due:
                self._serve_until(due)
            elif rest.due == due:
                self._happen(rest.take(), due)
            else:
                self._arrive(radio.take(), due)
        self._run_stream(now)

    def _run_stream(self, now: float) -> None:
        while sample := self._state.next_sample(now=now):
            self._notify(News(sample.node, sample.pair, sample.payload), sample.sent)

    def _happen(self, event: SleepEvent, now: float) -> None:
        idleness, node = self._behaviours.idleness, self._network.nodes[0]
        match event:
            case SleepEvent.WARN:
                self._notify(News(node, idleness.warning), now)
            case SleepEvent.SLEEP:
                self._state.fall_asleep()
                self._notify(News(node, idleness.asleep), now)
            case SleepEvent.WAKE:
                self.wake(now=now)
            case SleepEvent.BOOT:
                self._boot(now)
            case _:
                assert_never(event)
