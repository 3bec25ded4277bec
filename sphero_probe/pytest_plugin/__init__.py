"""Fixtures for tests that use a robot: the built-in one, or a real one named on pytest's command line.

pytest loads this module by itself once sphero-probe is installed; it imports nothing else until a test uses
one of the fixtures::

    def test_an_led_takes_its_colour(sphero, sphero_fake):
        sphero.set_led("front", "ff8000")
        assert sphero_fake.leds["front_green"] == 0x80

``sphero`` is a connected robot without ``async``. ``sphero_fake`` shows the state of the built-in robot and
makes it fail. ``sphero_connect`` connects in an async test. The marker ``sphero`` names the models that a
test is for, the risk classes that it needs, and settings of the built-in robot::

    @pytest.mark.sphero("bolt", "bolt-plus", allow=["motion"], latency="15ms")
"""

import os
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from contextlib import AbstractAsyncContextManager

    from sphero_probe.api.robot import ConnectedRobot
    from sphero_probe.pytest_plugin.fake import SpheroFake
    from sphero_probe.pytest_plugin.opening import Opened, Wanted
    from sphero_probe.sync import SyncRobot

_MARKER = (
    "sphero(*models, allow=(), virtual_clock=None, **settings): the robots that the test is for, the risk "
    "classes that it needs beyond read and probe, and settings of the built-in robot such as latency='15ms'."
)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options that say which robot the tests use."""
    group = parser.getgroup("sphero", "Sphero robots")
    group.addoption(
        "--sphero",
        metavar="ADDRESS",
        help="The robot that tests use. [default: $SPHERO_PROBE_DEVICE, or fake:bolt-plus]",
    )
    group.addoption(
        "--sphero-allow",
        metavar="CLASS",
        action="append",
        default=[],
        help="A risk class that tests may use on a real robot: write, motion, persist, brick. Repeatable.",
    )
    group.addoption(
        "--sphero-confirm",
        metavar="NAME",
        default="",
        help="The name of the real robot, to allow the class brick.",
    )
    group.addoption(
        "--sphero-virtual-clock",
        action="store_true",
        help="Do not wait in real time; only with the built-in or a recorded robot.",
    )
    parser.addini("sphero_virtual_clock", "As --sphero-virtual-clock.", type="bool", default=False)


def pytest_configure(config: pytest.Config) -> None:
    """Register the marker."""
    config.addinivalue_line("markers", _MARKER)


@pytest.fixture
def sphero(_sphero_opened: "Opened") -> "SyncRobot":
    """Return a connected robot, new for each test; its methods wait for their results.

    The test is skipped if the robot is not one of the models that the marker ``sphero`` names.
    """
    return _sphero_opened.robot


@pytest.fixture
def sphero_fake(_sphero_opened: "Opened") -> "SpheroFake":
    """Return access to the built-in robot behind ``sphero``: what it executed, and ways to make it fail.

    The test is skipped if the robot is a real or a recorded one.
    """
    if _sphero_opened.fake is None:
        pytest.skip("needs the built-in robot: --sphero names another")
    return _sphero_opened.fake


@pytest.fixture
def sphero_connect(
    request: pytest.FixtureRequest,
) -> "Callable[..., AbstractAsyncContextManager[ConnectedRobot]]":
    """Return ``sphero_probe.connect`` for the robot of this test, for tests that are coroutines.

    ``async with sphero_connect() as robot:`` works under any plugin that runs coroutines; keyword arguments
    are those of ``sphero_probe.connect``.
    """
    from sphero_probe.api.connecting import connect

    wanted = _wanted(request)

    def open_it(**options: Any) -> "AbstractAsyncContextManager[ConnectedRobot]":
        return connect(wanted.device, **{"consent": wanted.consent, **options})

    return open_it


@pytest.fixture
def _sphero_opened(request: pytest.FixtureRequest) -> "Iterator[Opened]":
    from sphero_probe.pytest_plugin.opening import opened

    with opened(_wanted(request)) as it:
        yield it


def _wanted(request: pytest.FixtureRequest) -> "Wanted":
    from sphero_probe.pytest_plugin.opening import DEFAULT_DEVICE, wanted

    config = request.config
    device = config.getoption("--sphero") or os.environ.get("SPHERO_PROBE_DEVICE") or DEFAULT_DEVICE
    return wanted(
        device,
        request.node.get_closest_marker("sphero"),
        allowed=config.getoption("--sphero-allow"),
        confirm=config.getoption("--sphero-confirm"),
        virtual_clock=config.getoption("--sphero-virtual-clock") or config.getini("sphero_virtual_clock"),
    )
