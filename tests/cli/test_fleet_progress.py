"""The lines that show how far each robot of a fleet is."""

import io
import sys

import pytest

from sphero_probe.cli.fleet_progress import fleet_progress
from sphero_probe.fleet.records import Ended, Progress, Status, Step
from sphero_probe.fleet.results import RobotResult
from sphero_probe.fleet.robots import FleetRobot


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def fleet(count: int) -> dict[str, RobotResult]:
    names = [f"BP-{number:04}" for number in range(count)]
    return {name: RobotResult(FleetRobot(name, name)) for name in names}


def drawn(monkeypatch: pytest.MonkeyPatch, results: dict[str, RobotResult], lines: int = 20) -> str:
    """Return the last picture, drawn as the first robot ends."""
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "60")
    monkeypatch.setenv("LINES", str(lines))
    with fleet_progress(results, "never") as show:
        show(next(iter(results.values())))
        return terminal.getvalue()


def test_each_robot_has_a_line_with_what_it_does(monkeypatch: pytest.MonkeyPatch) -> None:
    results = fleet(3)
    first, second, third = results.values()
    first.add(Ended(Status.UNREACHABLE, "no \x1b[31mrobot"))
    second.add(Progress(256))
    third.add(Step("connect"))
    picture = drawn(monkeypatch, results)
    lines = [line for line in picture.splitlines() if "BP-" in line]
    assert [line.split()[0].rpartition("l")[2] for line in lines] == ["BP-0001", "BP-0002", "BP-0000"]
    assert "0/256" in lines[0]
    assert "connect" in lines[1]
    assert r"unreachable: no \x1b[31mrobot" in lines[2]
    assert all(len(line) < 70 for line in lines)


def test_robots_that_do_not_fit_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = drawn(monkeypatch, fleet(30), lines=10)
    assert picture.count("BP-") == 7
    assert "and 23 more" in picture


def test_away_from_a_terminal_a_robot_is_told_when_it_has_ended(capsys: pytest.CaptureFixture[str]) -> None:
    results = fleet(2)
    first, second = results.values()
    with fleet_progress(results, "never") as show:
        show(first)
        second.add(Ended(Status.DONE))
        show(second)
    assert capsys.readouterr().err == "BP-0001: done\n"
