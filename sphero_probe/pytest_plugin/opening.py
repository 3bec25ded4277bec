"""Chooses the robot for a test, from the options and the marker, and connects to it."""

import asyncio
from collections.abc import AsyncIterator, Iterable, Iterator
from contextlib import asynccontextmanager, contextmanager
from typing import Final, NamedTuple

import pytest

from sphero_probe.api.connecting import connected
from sphero_probe.api.portal import BackgroundLoop, Portal
from sphero_probe.api.robot import ConnectedRobot
from sphero_probe.catalogue import ROBOTS, robot_by_word
from sphero_probe.catalogue.naming import choose
from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.policy import Consent
from sphero_probe.pytest_plugin.fake import SpheroFake
from sphero_probe.session.session import Session, open_session
from sphero_probe.sync import SyncRobot
from sphero_probe.transports.fake import FakeTransport
from sphero_probe.virtual_clock import VirtualClock

DEFAULT_DEVICE: Final = "fake:bolt-plus"
_FAKE: Final = "fake:"
_REPLAY: Final = "replay:"


class Wanted(NamedTuple):
    """The robot that a test needs.

    Attributes:
        device: the address, as ``sphero_probe.connect`` takes it.
        models: keys of the models that the test is for, empty for any.
        consent: what the test may send.
        virtual_clock: use a clock that does not wait in real time.
    """

    device: str
    models: tuple[str, ...]
    consent: Consent
    virtual_clock: bool


class Opened(NamedTuple):
    """The robot of a running test.

    Attributes:
        robot: the connected robot.
        fake: access to the built-in robot, None for a real one.
    """

    robot: SyncRobot
    fake: SpheroFake | None


def wanted(
    device: str, marker: pytest.Mark | None, *, allowed: Iterable[str], confirm: str, virtual_clock: bool
) -> Wanted:
    """Return the robot that a test needs.

    Args:
        device: the address that the user gave.
        marker: the test's marker, or None.
        allowed: risk classes that the user allows on a real robot.
        confirm: the real robot's name, for the class ``brick``.
        virtual_clock: the user wants a virtual clock.

    Raises:
        UsageError: the marker names an unknown model or risk class.
        Skipped: the test needs the built-in robot, or a risk class that is not allowed on a real one.
    """
    settings = dict(marker.kwargs) if marker else {}
    needed = [choose(word, (risk.word for risk in Risk), "risk class") for word in settings.pop("allow", ())]
    asked = settings.pop("virtual_clock", None)
    clock = virtual_clock if asked is None else bool(asked)
    models = tuple(_key(word) for word in marker.args) if marker else ()
    if device.startswith(_FAKE):
        return Wanted(
            _FAKE + _with_settings(_with_model(device.removeprefix(_FAKE), models), settings),
            models,
            Consent.of(needed, "", Risk.READ),
            clock,
        )
    if settings:
        pytest.skip(f"needs the built-in robot, for its settings {', '.join(settings)}")
    if device.startswith(_REPLAY):  # a recording executes nothing
        return Wanted(device, models, Consent.of(needed, "", Risk.READ), clock)
    default = Consent()
    missing = [word for word in needed if Risk[word.upper()] not in default.allowed and word not in allowed]
    if missing:
        pytest.skip(f"needs {' '.join(f'--sphero-allow {word}' for word in missing)} on a real robot")
    return Wanted(device, models, Consent.of(needed, confirm), virtual_clock=False)


@contextmanager
def opened(wanted: Wanted) -> Iterator[Opened]:
    """Connect to a robot; leaving the block disconnects.

    Raises:
        Skipped: the test is for other models.
        SpheroProbeError: it cannot be connected.
    """
    clock = asyncio.Runner(loop_factory=VirtualClock) if wanted.virtual_clock else BackgroundLoop()
    with clock as runner:
        portal = Portal(runner)
        with portal.entered(_connected(wanted)) as (session, robot):
            model = robot.model.key if robot.model else "of an unknown model"
            if wanted.models and model not in wanted.models:
                pytest.skip(f"needs {' or '.join(wanted.models)}; {robot.name} is {model}")
            transport = session.connection.transport
            fake = None
            if isinstance(transport, FakeTransport):
                fake = SpheroFake(transport.robot, session.connection.address, portal)
            yield Opened(SyncRobot(robot, portal), fake)


@asynccontextmanager
async def _connected(wanted: Wanted) -> AsyncIterator[tuple[Session, ConnectedRobot]]:
    async with open_session(wanted.device, wanted.consent) as session, connected(session) as robot:
        yield session, robot


def _key(word: str) -> str:
    robot = robot_by_word(word)
    return robot.key if robot else choose(word, ROBOTS, "robot")


def _with_model(rest: str, models: tuple[str, ...]) -> str:
    """Replace the model in an address by the test's first model, unless it is one of the test's models."""
    word, question, query = rest.partition("?")
    robot = robot_by_word(word)
    if models and (robot is None or robot.key not in models):
        word = models[0]
    return word + question + query


def _with_settings(rest: str, settings: dict[str, object]) -> str:
    """Add settings to the address of a built-in robot; they replace those in the address."""
    word, _, query = rest.partition("?")
    values = dict(part.partition("=")[::2] for part in query.split("&")) if query else {}
    values |= {key: str(int(one) if isinstance(one, bool) else one) for key, one in settings.items()}
    return word + ("?" + "&".join(f"{key}={value}" for key, value in values.items()) if values else "")
