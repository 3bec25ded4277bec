"""``evidence`` and ``evidence check`` from the command line, and what points to them."""

import json
from pathlib import Path

import pytest

from sphero_probe.simulator import FakeRobot, parse_settings
from tests.cli.test_cli_bluez import NEW, OLD
from tests.support.cli import Cli, objects
from tests.support.fake_bluez import FakeBlueZ, Peripheral, sphero_v2


@pytest.mark.parametrize("name", ["mine", "mine.json", "mine.md", "mine.v2"])
def test_two_files_are_written_and_checked(cli: Cli, tmp_path: Path, name: str) -> None:
    ran = cli("evidence", "--device", "fake:bolt-plus", "-o", str(tmp_path / name))
    assert ran.code == 0, ran.err
    stem = name.removesuffix(".json").removesuffix(".md")
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"{stem}.json", f"{stem}.md"]
    assert "14 of 15 open questions settled" in ran.err
    assert "read them, then attach both to an issue" in ran.err
    assert (
        (tmp_path / f"{stem}.md").read_text().startswith("# Evidence: Sphero BOLT+, firmware primary 5.1.450")
    )
    checked = cli("evidence", "check", str(tmp_path / f"{stem}.json"))
    assert checked.code == 0
    assert checked.out == ran.out
    assert "No real robot answered" in checked.err


def test_show_prints_what_the_files_hold(cli: Cli, tmp_path: Path) -> None:
    """Exactly, but for the digests and times of another run: here both come from one."""
    ran = cli("evidence", "--device", "fake:mini", "--show", "-o", str(tmp_path / "mine"))
    assert ran.code == 0
    assert ran.out == f"{(tmp_path / 'mine.md').read_text()}\n{(tmp_path / 'mine.json').read_text()}"


def test_without_a_name_nothing_is_written(cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    ran = cli("evidence", "--device", "fake:bb8")
    assert ran.code == 0
    assert "nothing was written" in ran.err
    assert list(tmp_path.iterdir()) == []


def test_a_dry_run_sends_nothing(cli: Cli, tmp_path: Path) -> None:
    ledger = tmp_path / "ledger"
    ran = cli("evidence", "--device", f"fake:rvr?ledger={ledger}", "--dry-run")
    assert ran.code == 0
    rows = [line.split("\t") for line in ran.out.splitlines()]
    assert {row[5] for row in rows} == {"read", "probe"}
    assert "8d 1e 12 10 09 " in ran.out
    assert not ledger.exists()


def test_check_gives_json(cli: Cli, tmp_path: Path) -> None:
    cli("evidence", "--device", "fake:rvr?mask=1", "-o", str(tmp_path / "mine"))
    rows = objects(cli("evidence", "check", str(tmp_path / "mine.json"), "--format", "jsonl").out)
    by_key = {row["key"]: row for row in rows}
    assert by_key["command-before-length"]["settled"] is True
    assert by_key["command-before-length"]["answer"].startswith("the length first")
    assert "Atriz_migracion_ros2" in by_key["missing-commands"]["background"]
    assert by_key["sleep"]["settled"] is False


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        pytest.param(("check", "absent.json"), 8, "absent.json: No such file", id="absent"),
        pytest.param(("check", "bad.json"), 8, "bad.json: not a JSON object", id="bad"),
        pytest.param(
            ("mine.json",), 2, "to check a file: sphero-probe evidence check mine.json", id="no check"
        ),
        pytest.param(("-d", "fake:bolt", "-o", "a/b"), 10, "the folder does not exist", id="folder"),
        pytest.param(("-d", "fake:bolt", "-o", "./"), 10, "names a folder", id="no name"),
        pytest.param(("-d", "fake:bolt", "-o", "a", "-o", "b"), 2, "given twice", id="twice"),
        pytest.param(("-d", "fake:bolt", "--idle", "2h"), 2, "not a time", id="time"),
        pytest.param(("-d", "fake:toaster"), 2, "unknown fake robot", id="robot"),
    ],
)
def test_wrong_use_gives_a_line_and_its_code(
    cli: Cli,
    arguments: tuple[str, ...],
    code: int,
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.json").write_text("[]")
    ran = cli("evidence", *arguments)
    assert ran.code == code
    assert said in ran.err
    assert len(ran.err.splitlines()) <= 2


def test_a_run_that_ends_early_is_written_and_told(cli: Cli, tmp_path: Path) -> None:
    ran = cli("evidence", "--device", "fake:bolt?disconnect_after=20", "-o", str(tmp_path / "mine"))
    assert ran.code == 5
    assert "the evidence is incomplete" in ran.err
    assert json.loads((tmp_path / "mine.json").read_text())["complete"] is False
    assert "The run ended early" in (tmp_path / "mine.md").read_text()


@pytest.mark.unmeasured
def test_real_robots_are_pointed_to_it(cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Over the fake BlueZ: a BOLT+, and a robot of an unknown model; neither file names one."""
    robots = [FakeRobot(parse_settings("bolt-plus")), FakeRobot(parse_settings("bolt?seed=9"))]
    with FakeBlueZ(
        [
            Peripheral("BP-1234", NEW, robot=robots[0], services=sphero_v2(gate=False)),
            Peripheral("ZZ-9911", OLD, robot=robots[1], services=sphero_v2(gate=False), mtu=100),
        ]
    ) as air:
        monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", air.address)
        doctor = cli("doctor", "--device", "BP-1234")
        assert "can settle up to 15 open questions: sphero-probe evidence --device BP-1234" in doctor.err
        discover = cli("discover", "--did", "0x13", "--device", OLD)
        assert f"can settle up to 14 open questions: sphero-probe evidence --device {OLD}" in discover.err
        ran = cli("evidence", "--device", OLD, "-o", str(tmp_path / "mine"))
    assert ran.code == 0
    assert "a robot of an unknown model (V2), firmware robot" in ran.err
    assert "No real robot answered" not in ran.err
    text = (tmp_path / "mine.json").read_text() + (tmp_path / "mine.md").read_text()
    assert "over Bluetooth LE" in text
    assert "a write carries 97 bytes" in text
    for trace in ("9911", "ZZ-", OLD, OLD.replace(":", "").lower()):
        assert trace not in text


def test_built_in_robots_are_not_pointed_to_it(cli: Cli) -> None:
    assert "open questions" not in cli("discover", "--did", "0x13", "--device", "fake:bolt-plus").err
    assert "open questions" not in cli("doctor", "--device", "fake:bolt-plus").err
