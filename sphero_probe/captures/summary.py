"""What a capture shows of each robot: which commands, how often, with what payloads and what answers."""

from collections import Counter
from typing import Final

from sphero_probe.captures.packet import CapturedPacket, Connection
from sphero_probe.captures.pairing import Pairing
from sphero_probe.catalogue.capture_context import CaptureContext
from sphero_probe.catalogue.commands import notification_row, rows_of
from sphero_probe.protocol.packets import Generation, Malformed, Notification, Request, Response

_MAX_LENGTHS: Final = 64
_MAX_TIMES: Final = 1 << 14
_MAX_PAIRS: Final = 1 << 14
"""Commands and notifications of one connection; more are only counted."""


class Tally:
    """One command or notification of one robot.

    Attributes:
        kind: ``command`` or ``notification``.
        generation: the protocol.
        did: device id, None for an asynchronous message of V1.
        cid: command id.
        name: as the catalogue knows it, None where it does not.
        count: how often it was heard.
        lengths: of its payloads in bytes.
        first: the first payload.
        codes: answer code -> how often.
        times: round trips in ms, rounded -> how often.
    """

    def __init__(self, kind: str, generation: Generation, did: int | None, cid: int) -> None:
        """Count nothing yet."""
        self.kind, self.generation, self.did, self.cid = kind, generation, did, cid
        self.count = 0
        self.lengths: set[int] = set()
        self.first: bytes | None = None
        self.codes: Counter[int] = Counter()
        self.times: Counter[float] = Counter()
        rows = rows_of(generation, did, cid) if did is not None else ()
        told = notification_row(generation, did, cid, None) if kind == "notification" else None
        row = told or (rows[0] if rows else None)
        self.name = row.name if row else None

    def heard(self, payload: bytes) -> None:
        """Count one."""
        self.count += 1
        if self.first is None:
            self.first = payload
        if len(self.lengths) < _MAX_LENGTHS:
            self.lengths.add(len(payload))


class RobotSummary:
    """One connection.

    Attributes:
        connection: which; with the name, once it is known.
        tallies: commands and notifications, as they came.
        commands: sent.
        answers: that belong to a command.
        stray: answers that belong to none.
        notifications: heard.
        malformed: pieces of damage.
        out_of_order: answers that came after the answer to a later command.
        splits: sizes of the values that carried a frame in several parts -> how often.
        times: round trips of all commands, as in ``Tally``.
        uncounted: packets of pairs beyond the most that are kept.
    """

    def __init__(self, connection: Connection) -> None:
        """Count nothing yet."""
        self.connection = connection
        self.tallies: dict[tuple[str, Generation, int | None, int], Tally] = {}
        self.commands = self.answers = self.stray = self.notifications = self.malformed = 0
        self.out_of_order = self.uncounted = 0
        self.splits: Counter[int] = Counter()
        self.times: Counter[float] = Counter()
        self.pairing = Pairing()
        self._context = CaptureContext()

    def add(self, captured: CapturedPacket) -> None:
        """Count a packet of this connection."""
        self.connection = captured.connection
        packet = self._context.complete(captured.generation, captured.packet)
        answered = self.pairing.feed(captured)
        if len(captured.parts) > 1:
            self.splits.update(captured.parts[:-1])
        match packet:
            case Request(command=command):
                self.commands += 1
                self._count("command", captured.generation, command.did, command.cid, command.payload)
            case Response(code=code):
                if answered is None or not isinstance(answered.request.packet, Request):
                    self.stray += 1
                    return
                self.answers += 1
                self.out_of_order += not answered.in_order
                asked = answered.request.packet.command
                tally = self.tallies.get(("command", captured.generation, asked.did, asked.cid))
                if tally:
                    tally.codes[code] += 1
                if answered.round_trip is not None:
                    time = round(answered.round_trip / 1_000_000, 1)
                    _keep(self.times, time)
                    if tally:
                        _keep(tally.times, time)
            case Notification(did=did, cid=cid, payload=payload):
                self.notifications += 1
                self._count("notification", captured.generation, did, cid, payload)
            case Malformed():
                self.malformed += 1

    def _count(self, kind: str, generation: Generation, did: int | None, cid: int, payload: bytes) -> None:
        key = (kind, generation, did, cid)
        tally = self.tallies.get(key)
        if tally is None:
            if len(self.tallies) >= _MAX_PAIRS:
                self.uncounted += 1
                return
            tally = self.tallies[key] = Tally(*key)
        tally.heard(payload)


def _keep(times: Counter[float], time: float) -> None:
    if time in times or len(times) < _MAX_TIMES:
        times[time] += 1


def spread(times: Counter[float]) -> tuple[float, float, float] | None:
    """Return the least, the middle and the most of what was counted, None where nothing was."""
    if not times:
        return None
    ordered = sorted(times)
    left = (times.total() + 1) // 2
    for value in ordered:
        left -= times[value]
        if left <= 0:
            return ordered[0], value, ordered[-1]
    return None
