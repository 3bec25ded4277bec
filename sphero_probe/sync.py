"""The API without ``async``, for notebooks, lessons and the prompt.

::

    import sphero_probe.sync

    with sphero_probe.sync.connect("fake:bolt-plus") as robot:
        print(robot.send("power.get_battery_percentage").percentage)
        for finding in robot.sweep(did="power"):
            print(finding.name, finding.outcome)

In a notebook, ``robot = sphero_probe.sync.connect(…)`` stays open over several cells, until
``robot.close()``.

The robot's event loop runs in a background thread. So this also works where a loop is already running, as in
Jupyter, and the link stays alive between two cells. Each method waits for the result of the method of the
same name of ``ConnectedRobot``; Ctrl-C cancels it.
"""

from collections.abc import AsyncIterator, Callable, Coroutine, Iterable, Iterator
from contextlib import ExitStack
from functools import wraps
from typing import Any, Concatenate, ParamSpec, Self, TypeVar
from weakref import finalize

from sphero_probe.api import connecting
from sphero_probe.api.decoding import DecodedPacket
from sphero_probe.api.portal import BackgroundLoop, Portal
from sphero_probe.api.result import Run
from sphero_probe.api.robot import ConnectedRobot
from sphero_probe.api.running import RunningPlan
from sphero_probe.catalogue.model import Robot
from sphero_probe.link.policy import Consent
from sphero_probe.probing.finding import Finding, Record
from sphero_probe.protocol.packets import Generation

__all__ = ["SyncRobot", "SyncRunningPlan", "connect", "discover", "scan"]

T = TypeVar("T")
P = ParamSpec("P")


class SyncRunningPlan:
    """A plan that runs while you iterate over it, once: ``RunningPlan`` without ``async``.

    Leaving the loop early ends the run.
    """

    def __init__(self, portal: Portal, running: RunningPlan) -> None:
        self._portal = portal
        self._running = running

    @property
    def result(self) -> Run:
        """The results so far; complete once the loop has ended."""
        return self._running.result

    def __iter__(self) -> Iterator[Finding]:
        """Run the plan and yield its findings."""
        return self._portal.iterate(aiter(self._running))

    def records(self) -> Iterator[Record]:
        """Run the plan and yield everything: a heading, findings and notes as they arrive, a summary."""
        return self._portal.iterate(self._running.records())

    def collect(self) -> Run:
        """Run the plan to its end and return the results."""
        return self._portal.run(self._running.collect())


def _waiting(
    method: Callable[Concatenate[ConnectedRobot, P], Coroutine[Any, Any, T]],
) -> Callable[Concatenate["SyncRobot", P], T]:
    """Return a method that waits for the result of an async method."""

    @wraps(method)
    def call(self: "SyncRobot", /, *args: P.args, **kwargs: P.kwargs) -> T:
        return self._portal.run(method(self._robot, *args, **kwargs))

    return call


def _running(
    method: Callable[Concatenate[ConnectedRobot, P], RunningPlan],
) -> Callable[Concatenate["SyncRobot", P], SyncRunningPlan]:
    """Return a method that returns the plan of another method without ``async``."""

    @wraps(method)
    def call(self: "SyncRobot", /, *args: P.args, **kwargs: P.kwargs) -> SyncRunningPlan:
        return SyncRunningPlan(self._portal, method(self._robot, *args, **kwargs))

    return call


class SyncRobot:
    """A connected robot: ``ConnectedRobot`` without ``async``.

    Use it in a ``with`` block, or call ``close``; otherwise it is closed when the program ends.
    """

    def __init__(
        self, robot: ConnectedRobot, portal: Portal, close: Callable[[], None] = lambda: None
    ) -> None:
        """Wrap a connected robot; ``portal`` leads to its event loop, ``close`` disconnects it."""
        self._robot = robot
        self._portal = portal
        self._close = finalize(self, close)

    def __enter__(self) -> Self:
        """Return the robot itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Disconnect."""
        self.close()

    def close(self) -> None:
        """Stop the motors, if motion was allowed, and disconnect; may be called again."""
        self._close()

    def __repr__(self) -> str:
        return repr(self._robot).replace("ConnectedRobot", "SyncRobot")

    firmware = _waiting(ConnectedRobot.firmware)
    send = _waiting(ConnectedRobot.send)
    set_led = _waiting(ConnectedRobot.set_led)
    set_leds = _waiting(ConnectedRobot.set_leds)
    reconnect = _waiting(ConnectedRobot.reconnect)
    sweep = _running(ConnectedRobot.sweep)
    discover = _running(ConnectedRobot.discover)
    run = _running(ConnectedRobot.run)

    @property
    def name(self) -> str:
        """The advertised name, or the address if it has none; untrusted text."""
        return self._robot.name

    @property
    def address(self) -> str:
        """The device address, as ``connect`` takes it."""
        return self._robot.address

    @property
    def model(self) -> Robot | None:
        """The model: its ``key``, ``name``, ``nodes`` and LEDs; None if it is not known."""
        return self._robot.model

    @property
    def generation(self) -> Generation:
        """The protocol that it uses."""
        return self._robot.generation

    @property
    def consent(self) -> Consent:
        """What may be sent."""
        return self._robot.consent

    @property
    def leds(self) -> tuple[str, ...]:
        """The names of its LEDs, for ``set_led``; empty if they are not known."""
        return self._robot.leds

    def notifications(self, *, seconds: float | None = None) -> Iterator[DecodedPacket]:
        """Listen to what the robot sends by itself, from this call on.

        Args:
            seconds: end after this time; None never ends.
        """

        async def listen() -> AsyncIterator[DecodedPacket]:
            return self._robot.notifications(seconds=seconds)

        return self._portal.iterate(self._portal.run(listen()))


def connect(
    device: str = "",
    *,
    consent: Consent | Iterable[str] = (),
    timeout: float | None = None,
    connect_timeout: float = 10.0,
    adapter: str = "",
    tolerate: Iterable[str] = (),
) -> SyncRobot:
    """Connect to a robot and return it; the arguments and errors are those of ``sphero_probe.connect``.

    Leaving the ``with`` block, or ``close``, stops the robot's motors, if motion was allowed, and
    disconnects.
    """
    opened = connecting.connect(
        device,
        consent=consent,
        timeout=timeout,
        connect_timeout=connect_timeout,
        adapter=adapter,
        tolerate=tolerate,
    )
    with ExitStack() as stack:
        portal = Portal(stack.enter_context(BackgroundLoop()))
        robot = stack.enter_context(portal.entered(opened))
        return SyncRobot(robot, portal, stack.pop_all().close)


def _function(function: Callable[P, Coroutine[Any, Any, T]]) -> Callable[P, T]:
    """Return a function that waits for the result of an async function."""

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> T:
        with BackgroundLoop() as loop:
            return loop.run(function(*args, **kwargs))

    return call


scan = _function(connecting.scan)
discover = _function(connecting.discover)
