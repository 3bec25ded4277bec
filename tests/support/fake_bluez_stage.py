"""Runs the tool against the fake BlueZ, and checks how it ended and what the robots executed."""

import json
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType
from typing import Any

import pytest

from sphero_probe.simulator import Executed, FakeRobot, parse_settings
from tests.support.cli import Cli, Ran
from tests.support.fake_bluez import Adapter, BusFaults, FakeBlueZ, Faults, Peripheral, sphero_v2

ADDRESS = "AA:BB:CC:DD:EE:01"
PATIENCE = 20
"""Timeout in seconds for one run of the tool; far more than any needs."""
AGAIN = 2
"""Seconds after which a run that does not end is signalled again."""


class Stage:
    """One machine and the robots around it.

    Attributes:
        executed: every command that a robot ran.
        bluez: of the last run; its log can still be read.
    """

    def __init__(self, cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
        self.executed: list[Executed] = []
        self.bluez: FakeBlueZ
        self._cli = cli
        self._monkeypatch = monkeypatch

    def robot(
        self, settings: str = "bolt-plus", address: str = ADDRESS, *, mtu: int = 247, **profile: Any
    ) -> Peripheral:
        """Add a robot; ``faults``, and the arguments of ``sphero_v2``; without a gate by default."""
        robot = FakeRobot(parse_settings(settings), on_execute=self.executed.append)
        faults = profile.pop("faults", Faults())
        services = sphero_v2(**{"gate": False, **profile})
        return Peripheral(robot.name, address, robot=robot, services=services, faults=faults, mtu=mtu)

    def run(
        self,
        peripherals: Sequence[Peripheral],
        *arguments: str,
        adapters: Sequence[Adapter] = (Adapter(),),
        faults: BusFaults | None = None,
        meanwhile: Callable[[FakeBlueZ], object] = lambda _: None,
    ) -> Ran:
        """Run the tool in this process, within ``PATIENCE``.

        Args:
            peripherals: the robots in range.
            *arguments: the command line.
            adapters: of the machine.
            faults: of the machine.
            meanwhile: runs in its own thread while the tool runs.
        """
        with FakeBlueZ(peripherals, adapters=adapters, faults=faults) as self.bluez, limit(PATIENCE):
            self._monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", self.bluez.address)
            helper = threading.Thread(target=meanwhile, args=(self.bluez,))
            helper.start()
            try:
                return self._cli(*arguments)
            finally:
                helper.join(PATIENCE)


@contextmanager
def limit(seconds: float) -> Iterator[None]:
    """Fail a test that takes longer, if the system has alarms."""
    rung = 0

    def ring(_number: int, _frame: FrameType | None) -> None:
        nonlocal rung
        rung += 1
        raise KeyboardInterrupt  # the one thing that every event loop lets through

    if not hasattr(signal, "setitimer") or threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds, AGAIN)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
        if rung:
            pytest.fail(f"the tool did not end within {seconds} s")


def said(ran: Ran, text: str, *, code: int, hint: bool = True) -> None:
    """Check that a run ended with this exit code, one line with this text, and one hint."""
    told = [line for line in ran.err.splitlines() if not line.startswith("note:")]
    assert ran.code == code, ran.err
    assert "Traceback" not in ran.err
    assert told[0].startswith("sphero-probe: "), ran.err
    assert text in told[0], ran.err
    assert len(told) in ((2,) if hint else (1, 2)), ran.err
    assert all(line.startswith("  ") for line in told[1:]), ran.err
    assert max(map(len, told)) < 450


def rows_of(ran: Ran, kind: str) -> list[dict[str, Any]]:
    """Return the rows of one type that a run printed as ``jsonl``."""
    return [row for row in map(json.loads, ran.out.splitlines()) if row["type"] == kind]


def never_wrong(ran: Ran, peripheral: Peripheral, stage: Stage) -> dict[int, str]:
    """Check every finding against the robot's commands, and that the robot executed only reads.

    Returns:
        Command id -> outcome.
    """
    robot = peripheral.robot
    assert isinstance(robot, FakeRobot)
    truth = {(fact.did, fact.cid) for fact in robot.truth() if fact.node == 1}
    findings = rows_of(ran, "finding")
    for finding in findings:
        if finding["outcome"] == "exists":
            assert (finding["did"], finding["cid"]) in truth, finding
        elif finding["outcome"] == "absent":
            assert (finding["did"], finding["cid"]) not in truth, finding
    assert {command.risk.word for command in stage.executed} <= {"read"}
    return {finding["cid"]: finding["outcome"] for finding in findings}
