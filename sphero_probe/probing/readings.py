"""Readings that a robot answers without data, and sends in a notification soon after."""

from collections import Counter
from collections.abc import Iterable
from typing import Final, NamedTuple

from sphero_probe.link.exchange import Unsolicited
from sphero_probe.probing.finding import Finding
from sphero_probe.protocol.packets import Notification

EXPECTED: Final = "accepted; the reading may come as a notification"
"""The note of a documented reading that was answered with success and no data."""
_SOON: Final = 1.0
"""Seconds after the answer within which a notification of the same device counts as the reading."""

_STREAM: Final = 3
"""Notifications of a kind that came before the answer from which on they count as a stream."""

_Pair = tuple[int | None, int]


class _Reading(NamedTuple):
    number: int
    did: int
    at: float
    streams: frozenset[_Pair]


class Readings:
    """Readings without data, and the notifications that followed them.

    What the robot notified of several times before a reading was answered is a stream, and not the reading.
    """

    def __init__(self) -> None:
        self._waiting: list[_Reading] = []
        self._seen: Counter[_Pair] = Counter()
        self._answered: dict[int, str] = {}

    def look(self, finding: Finding, *, now: float) -> None:
        """Remember a reading that was answered without data."""
        if finding.note == EXPECTED:
            streams = frozenset(pair for pair, times in self._seen.items() if times >= _STREAM)
            self._waiting.append(_Reading(finding.number, finding.command.did, now, streams))

    def hear(self, notification: Unsolicited, *, now: float) -> None:
        """Assign what came: a notification belongs to the last reading of its device that waits for one."""
        if not isinstance(notification, Notification):
            return
        pair = notification.did, notification.cid
        self._waiting = [reading for reading in self._waiting if now - reading.at <= _SOON]
        for reading in reversed(self._waiting):
            if reading.did == notification.did and pair not in reading.streams:
                self._waiting.remove(reading)
                name = f"0x{notification.did:02x}:0x{notification.cid:02x}"
                self._answered[reading.number] = f"answered by notification {name}"
                break
        self._seen[pair] += 1

    def take(self, findings: Iterable[Finding]) -> list[tuple[Finding, Finding]]:
        """Return the findings of readings that a notification answered, each with its replacement.

        Args:
            findings: all of the run so far.
        """
        taken, self._answered = self._answered, {}
        return [
            (finding, finding._replace(note=taken[finding.number]))
            for finding in findings
            if finding.number in taken and finding.note == EXPECTED
        ]
