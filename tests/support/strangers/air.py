"""Strangers on the fake BlueZ, swept by the command line through unpatched bleak."""

from heapq import heappop, heappush
from itertools import count
from pathlib import Path
from time import monotonic
from typing import Final

from sphero_probe.errors import NoAnswerError, SpheroProbeError
from sphero_probe.runs.reader import read_journal
from tests.support.cli import Ran as Ended
from tests.support.fake_bluez import Peripheral, sphero_v1, sphero_v2
from tests.support.fake_bluez_stage import Stage
from tests.support.strangers.frames import notification_v1, notification_v2
from tests.support.strangers.habits import Stranger
from tests.support.strangers.robot import Robot
from tests.support.strangers.runs import Ran, cids_of

ADDRESS: Final = "AA:BB:CC:DD:EE:07"
_NAMES: Final = {"bolt": "SB-57A6", "rvr": "RV-57A6", "r2d2": "D2-57A6", "bb8": "BB-57A6"}
_BURST: Final = 0.05
"""Seconds between two bursts of notifications."""
_INCOMPLETE: Final = 5

_WINDOW = 12
"""Commands that the tool has in flight at most [docs/architecture.md]."""


class StrangerOnAir:
    """A stranger as the radio meets it: its clock starts when it hears first."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._order = count()
        self._coming: list[tuple[float, int, bytes]] = []
        self._next_burst = 0.0
        self._began: float | None = None

    def hear(self, data: bytes, *, now: float) -> None:
        """Take what one write carried."""
        self._began = now if self._began is None else self._began
        for said in self._robot.hear(data, now - self._began):
            heappush(self._coming, (now + said.delay, next(self._order), said.data))

    def speak(self, *, now: float) -> list[bytes]:
        """Return what is due by now, in order."""
        said: list[bytes] = []
        while self._coming and self._coming[0][0] <= now:
            said.append(heappop(self._coming)[2])
        if self._robot.voice.flood and now >= self._next_burst:
            older = self._robot.firmware.older
            one = notification_v1(0x03, bytes(8)) if older else notification_v2(0x18, 0x02, bytes(12))
            said += [one] * round(self._robot.voice.flood * _BURST)
            self._next_burst = now + _BURST
        return said

    def next_time(self) -> float | None:
        """Return when there will be something to say, None if never."""
        times = [self._coming[0][0]] if self._coming else []
        if self._robot.voice.flood:
            times.append(self._next_burst)
        return min(times, default=None)


def sweep_on_air(stranger: Stranger, dids: str, stage: Stage, folder: Path) -> tuple[Ran, Ended]:
    """Sweep devices of a stranger with the command line; return the run as its journal has it.

    Args:
        stranger: on whom.
        dids: which devices, as ``--did`` takes them.
        stage: runs the command line.
        folder: for the journal.
    """
    robot = Robot(stranger.firmware, stranger.voice)
    services = sphero_v1() if stranger.firmware.older else sphero_v2(gate=False)
    name = _NAMES[stranger.model]
    peripheral = Peripheral(name, ADDRESS, robot=StrangerOnAir(robot), services=services, mtu=247)
    cids, journal = cids_of(stranger), folder / "run.jsonl"
    began = monotonic()
    ended = stage.run(
        [peripheral],
        *("sweep", "--did", dids, "--cid", f"{cids.start}-{cids.stop - 1}", "--device", ADDRESS),
        *("--journal", str(journal), "--format", "jsonl"),
    )
    ran = Ran("sweep", stranger, robot, seconds=monotonic() - began, error=_error(ended), on_the_way=_WINDOW)
    if journal.exists():
        ran.records = list(read_journal(journal).records())
    return ran, ended


def _error(ended: Ended) -> Exception | None:
    if ended.code in (0, _INCOMPLETE):
        return None
    if ended.code == NoAnswerError.exit_code:
        return NoAnswerError(ended.err)
    return SpheroProbeError(ended.err) if ended.code < 64 else RuntimeError(ended.err)
