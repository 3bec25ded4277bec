"""The pages in docs/ and the scripts in examples/ run unchanged."""

import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

from tests.pytest_plugin.support import plugin_options

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
BLOCK = re.compile(r"^```python\n(.+?)^```$", re.MULTILINE | re.DOTALL)
API = BLOCK.findall((ROOT / "docs" / "python.md").read_text(encoding="utf-8"))
TESTS = BLOCK.findall((ROOT / "docs" / "pytest.md").read_text(encoding="utf-8"))
SAYS = {
    "ask_before_moving": ["not sent: motion", "consent=['motion']", "drive.set_raw_motors: success"],
    "battery": ["BP-BE56: 4.11 V"],
    "classroom_check": ["ok    SB-", "ok    SM-", "ok    RV-", "3.73 V"],
    "compare_two_robots": ["0x13:0x03 only on fake:bolt-plus", "0x13:0x0c only on fake:rvr"],
    "custom_plan": ["1 power.get_battery_percentage success", "power.wake success"],
    "decode_capture": ["v2 response power.get_battery_percentage {'percentage': 95}", "v1 command core.ping"],
    "export_csv": ["did,cid,name,outcome,code,payload", "17,0,system_info.get_main_app_version,exists,0,"],
    "fleet_sweep": ["SB-DE8E: Sphero BOLT, firmware", ": done", "0x13:0x0c only on fake:rvr"],
    "notebook_sync": ["BP-BE56 Sphero BOLT+", "49 %", "power.get_charger_state {'state': 'charged'}"],
    "set_leds": ["RV-B9D8 has the LEDs right_headlight, left_headlight"],
    "sweep_device": ["0x13:0x10  power.get_battery_percentage {'percentage': 49}"],
    "watch_notifications": ["sensor.sensor_streaming_data_notify {'accelerometer_x': -0.01"],
}


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_does_what_it_says(
    path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", [str(path)])
    runpy.run_path(str(path), run_name="__main__")
    out = capsys.readouterr().out
    for said in SAYS[path.stem]:
        assert said in out


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_is_short_and_public(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert 10 <= len(text.splitlines()) <= 30
    imported = set(re.findall(r"^(?:from|import) (sphero_probe[.\w]*)", text, re.MULTILINE))
    assert imported
    assert imported <= {"sphero_probe", "sphero_probe.sync", "sphero_probe.errors"}


def test_an_example_runs_as_a_script() -> None:
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    ran = subprocess.run(
        [sys.executable, EXAMPLES[1], "fake:mini"],
        capture_output=True,
        text=True,
        check=True,
        env=environment,
    )
    assert ran.stdout.startswith("SM-")


@pytest.mark.parametrize("number", range(len(API)))
def test_the_page_for_scripts_runs(number: int, capsys: pytest.CaptureFixture[str]) -> None:
    exec(compile(API[number], f"docs/python.md, block {number + 1}", "exec"), {"__name__": "__main__"})
    assert capsys.readouterr().out


def test_the_pytest_page_runs(pytester: pytest.Pytester) -> None:
    (page,) = TESTS
    pytester.makepyfile(page)
    ran = pytester.runpytest_inprocess(*plugin_options())
    ran.assert_outcomes(passed=page.count("\ndef test_"))
