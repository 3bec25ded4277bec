"""The pytest plugin in a nested pytest: fixtures, marker, options; and that it costs nothing if unused."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from sphero_probe import Consent
from sphero_probe.pytest_plugin.opening import Wanted, wanted
from sphero_probe.simulator import FakeRobot, parse_settings
from tests.pytest_plugin.support import PLUGIN, plugin_options
from tests.support.fake_bluez import FakeBlueZ, Peripheral, sphero_v2

ROOT = Path(__file__).resolve().parents[2]
LIGHT = f"""
import sys, pytest
seen = set(sys.modules)
import {PLUGIN}
print(*set(sys.modules) - seen)
"""


@pytest.fixture(autouse=True)
def _no_device(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SPHERO_PROBE_DEVICE", raising=False)


def ran(pytester: pytest.Pytester, tests: str, *options: str) -> pytest.RunResult:
    """Run tests in a nested pytest."""
    pytester.makepyfile(tests)
    return pytester.runpytest_inprocess(*plugin_options(*options))


def test_it_imports_nothing_of_the_tool_until_a_fixture_is_used() -> None:
    environment = {name: value for name, value in os.environ.items() if not name.startswith("COV")}
    said = subprocess.run(
        [sys.executable, "-c", LIGHT], capture_output=True, text=True, check=True, cwd=ROOT, env=environment
    )
    imported = {name for name in said.stdout.split() if name.startswith(("sphero_probe", "asyncio", "bleak"))}
    assert imported == {"sphero_probe", PLUGIN}


def test_options_and_marker_are_documented(pytester: pytest.Pytester) -> None:
    said = pytester.runpytest_inprocess(*plugin_options("--help"))
    said.stdout.fnmatch_lines(["*--sphero=ADDRESS*", "*--sphero-allow=CLASS*", "*--sphero-virtual-clock*"])
    said = pytester.runpytest_inprocess(*plugin_options("--markers"))
    said.stdout.fnmatch_lines(["@pytest.mark.sphero(*"])


def test_each_test_gets_a_fresh_robot(pytester: pytest.Pytester) -> None:
    result = ran(
        pytester,
        """
        import pytest

        @pytest.mark.parametrize("turn", [1, 2])
        def test_leds(sphero, sphero_fake, turn):
            assert not any(sphero_fake.leds.values())
            assert not sphero_fake.ledger
            sphero.set_led("front", "ff8000")
            assert sphero_fake.leds["front_green"] == 0x80
            (entry,) = sphero_fake.executed("user_io.set_all_leds_with_8_bit_mask")
            assert entry.risk.word == "write"
            assert sphero_fake.ledger == [entry] == sphero_fake.executed(0x1A, 0x1C)
            assert repr(sphero_fake) == "<SpheroFake 'BP-BE56', Sphero BOLT+>"
            assert sphero_fake.name == sphero.name
        """,
    )
    result.assert_outcomes(passed=2)


def test_a_marker_chooses_the_model_and_its_settings(pytester: pytest.Pytester) -> None:
    result = ran(
        pytester,
        """
        import pytest

        @pytest.mark.sphero("rvr", "mini")
        def test_model(sphero):
            assert sphero.model.key == "rvr"

        @pytest.mark.sphero("rvr", "BOLT")
        def test_kept(sphero, sphero_fake):
            assert (sphero.model.key, sphero_fake.settings.seed) == ("bolt", 5)

        @pytest.mark.sphero("mini", hidden=3, mask=True, seed=7)
        def test_settings(sphero, sphero_fake):
            assert sphero.model.key == "mini"
            assert (sphero_fake.settings.hidden, len(sphero_fake.settings.mask)) == (3, 256)
            assert sum(fact.hidden for fact in sphero_fake.truth) == 3

        @pytest.mark.sphero("r3d3")
        def test_unknown(sphero):
            pass

        def test_what_the_option_names(sphero, sphero_fake):
            assert sphero.model.key == "bolt"
            assert sphero_fake.settings.seed == 5
        """,
        "--sphero",
        "fake:bolt?seed=5",
    )
    result.assert_outcomes(passed=4, errors=1)
    result.stdout.fnmatch_lines(["*UsageError: no robot 'r3d3'"])


def test_consent_comes_from_the_marker(pytester: pytest.Pytester) -> None:
    result = ran(
        pytester,
        """
        import pytest
        from sphero_probe.errors import RefusedByPolicyError

        STOP = bytes(4)

        @pytest.mark.sphero(allow=["motion"])
        def test_allowed(sphero, sphero_fake):
            assert sphero.send("drive.set_raw_motors", payload=STOP).ok

        def test_refused(sphero, sphero_fake):
            with pytest.raises(RefusedByPolicyError):
                sphero.send("drive.set_raw_motors", payload=STOP)
            assert not sphero_fake.ledger

        @pytest.mark.sphero(allow=["motoin"])
        def test_misspelt(sphero):
            pass
        """,
    )
    result.assert_outcomes(passed=2, errors=1)
    result.stdout.fnmatch_lines(["*UsageError: no risk class 'motoin'"])


def test_faults(pytester: pytest.Pytester) -> None:
    result = ran(
        pytester,
        """
        import pytest
        from sphero_probe import Outcome
        from sphero_probe.errors import LinkLostError, UsageError

        BATTERY = "power.get_battery_percentage"

        def test_silence(sphero, sphero_fake):
            sphero_fake.silence(BATTERY)
            assert sphero.send(BATTERY, check=False).outcome is not Outcome.EXISTS
            assert len(sphero_fake.executed(BATTERY)) == 3
            sphero_fake.unsilence(0x13, 0x10)
            assert sphero.send(BATTERY).percentage == 49
            with pytest.raises(UsageError):
                sphero_fake.silence(0x13)

        def test_drop(sphero, sphero_fake):
            sphero_fake.drop_link()
            assert not sphero_fake.connected
            with pytest.raises(LinkLostError):
                sphero.send(BATTERY)
            sphero.reconnect()
            assert sphero_fake.connected
            assert sphero.send(BATTERY).ok

        def test_drop_in_a_sweep(sphero, sphero_fake):
            sweep = sphero.sweep(did="power")
            for finding in sweep:
                if finding.number == 10:
                    sphero_fake.drop_link()
            assert sweep.result.complete

        def test_sleep(sphero, sphero_fake):
            sphero_fake.fall_asleep()
            assert sphero_fake.asleep
            assert sphero.send(BATTERY).ok  # after waking it
            assert not sphero_fake.asleep
            assert sphero_fake.executed("power.wake")

        @pytest.mark.sphero(sleep_after="10s")
        def test_time_passes(sphero, sphero_fake):
            sphero_fake.pass_time(9)
            assert not sphero_fake.asleep
            sphero_fake.pass_time(2)
            assert sphero_fake.asleep
        """,
        "--sphero-virtual-clock",
    )
    result.assert_outcomes(passed=5)


def test_a_virtual_clock_takes_no_real_time(pytester: pytest.Pytester) -> None:
    pytester.makeini("[pytest]\nsphero_virtual_clock = true")
    result = ran(
        pytester,
        """
        import time
        import pytest

        pytestmark = pytest.mark.sphero(latency="20s")

        def test_slow(sphero, sphero_fake):
            began = time.monotonic()
            sphero_fake.pass_time(86400)
            assert time.monotonic() - began < 3600

        @pytest.mark.sphero(virtual_clock=False)
        def test_real(sphero, sphero_fake):
            began = time.monotonic()
            sphero_fake.pass_time(0.05)
            assert time.monotonic() - began >= 0.04
        """,
    )
    result.assert_outcomes(passed=2)


def test_coroutines_connect_for_themselves(pytester: pytest.Pytester) -> None:
    result = ran(
        pytester,
        """
        import asyncio
        import pytest

        @pytest.mark.sphero("ollie")
        def test_async(sphero_connect):
            async def work():
                async with sphero_connect() as robot:
                    return robot.model.key, robot.consent.words
            assert asyncio.run(work()) == ("ollie", ("read", "probe"))

        def test_options(sphero_connect):
            async def work():
                async with sphero_connect(consent=["write"]) as robot:
                    return robot.consent.words
            assert "write" in asyncio.run(work())
        """,
    )
    result.assert_outcomes(passed=2)


@pytest.mark.parametrize(
    ("models", "settings", "said"),
    [
        (("bolt",), {"hidden": 5}, "needs the built-in robot, for its settings hidden"),
        ((), {"allow": ["write", "motion"]}, "needs --sphero-allow motion on a real robot"),
        (("bolt", "rvr"), {"allow": ["read", "write"]}, ""),
        ((), {}, ""),
    ],
)
@pytest.mark.filterwarnings("ignore::pytest.PytestUnknownMarkWarning")  # the plugin may not be installed
def test_what_a_real_robot_is_asked_for(
    models: tuple[str, ...], settings: dict[str, object], said: str
) -> None:
    def ask() -> Wanted:
        mark = pytest.mark.sphero(*models, **settings).mark if models or settings else None
        return wanted("BP-1234", mark, allowed=["write"], confirm="BP-1234", virtual_clock=True)

    if said:
        with pytest.raises(pytest.skip.Exception, match=said):
            ask()
    else:
        got = ask()
        assert got.models == models
        assert got.consent == Consent.of(["write"] if models else [], "BP-1234")
        assert (got.device, got.virtual_clock) == ("BP-1234", False)


REAL = """
    import pytest

    def test_any(sphero):
        assert sphero.name == "BP-1234"
        assert sphero.send("power.wake").ok

    @pytest.mark.sphero("bolt-plus", "bolt")
    def test_this_model(sphero):
        assert sphero.model.key == "bolt-plus"

    @pytest.mark.sphero("mini")
    def test_another_model(sphero):
        raise AssertionError

    def test_inside(sphero, sphero_fake):
        raise AssertionError

    @pytest.mark.sphero(hidden=5)
    def test_settings(sphero):
        raise AssertionError

    @pytest.mark.sphero(allow=["read", "write"])
    def test_allowed(sphero):
        assert "write" in sphero.consent.words

    @pytest.mark.sphero(allow=["motion"])
    def test_not_allowed(sphero):
        raise AssertionError
"""


@pytest.mark.unmeasured
def test_a_real_robot_is_used_with_care(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = FakeRobot(parse_settings("bolt-plus"))
    near = [Peripheral("BP-1234", "AA:BB:CC:DD:EE:01", robot=robot, services=sphero_v2(gate=False))]
    with FakeBlueZ(near) as air:
        monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", air.address)
        monkeypatch.setenv("SPHERO_PROBE_DEVICE", "BP-1234")
        result = ran(pytester, REAL, "-rs", "--sphero-allow", "write", "--sphero-virtual-clock")
    result.assert_outcomes(passed=3, skipped=4)
    result.stdout.fnmatch_lines_random(
        [
            "*needs mini; BP-1234 is bolt-plus",
            "*needs the built-in robot: --sphero names another",
            "*needs the built-in robot, for its settings hidden",
            "*needs --sphero-allow motion on a real robot",
        ]
    )


RECORDED = """
    import pytest

    @pytest.mark.sphero(allow=["write"], virtual_clock=True)
    def test_it_answers_as_recorded(sphero):
        assert sphero.model.key == "bolt-plus"
        assert sphero.send("power.get_battery_percentage")["percentage"] == 49
        with pytest.raises(Exception, match="0x13:0x17 to node 1 was never recorded"):
            sphero.send("power.get_battery_voltage_state")

    def test_each_test_hears_it_from_the_start(sphero):
        assert sphero.send("power.get_battery_percentage")["percentage"] == 49

    def test_view(sphero_fake):
        raise AssertionError
"""


def test_a_recorded_robot_is_a_double(pytester: pytest.Pytester) -> None:
    finding = {"type": "finding", "sent": "8d3a11011310246cd8", "received": "8d39110113102400313cd8"}
    entries = [{"type": "run", "robot": "bolt-plus", "device": "BP-1234"}, finding]
    later = finding | {"received": "8d39110113102400323bd8"}
    pytester.path.joinpath("run.jsonl").write_text(
        "".join(f"{json.dumps(one)}\n" for one in [*entries, later])
    )
    result = ran(pytester, RECORDED, "-rs", "--sphero", "replay:run.jsonl?unknown=error")
    result.assert_outcomes(passed=2, skipped=1)
    result.stdout.fnmatch_lines(["*needs the built-in robot: --sphero names another"])


def test_a_robot_that_is_not_there_is_an_error(pytester: pytest.Pytester) -> None:
    result = ran(pytester, "def test_it(sphero): pass", "--sphero", "fake:blt")
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines(["*UsageError: unknown fake robot 'blt'*"])
