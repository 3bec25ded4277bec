"""Copies the records of a capture without what identifies people and devices.

The file is read twice: first to find the robots and what identifies them, then to write. Advertising,
connections and the robots' packets are kept. The traffic of other devices, keys, comments and what is not
understood are left out or blanked. Times stay.
"""

from collections import deque
from collections.abc import Iterator
from struct import pack
from typing import TYPE_CHECKING, Final

from sphero_probe.captures.containers import recognise
from sphero_probe.captures.events import Closed, Counts, Event, Line, LinkReader, Opened, Piece, Serial
from sphero_probe.captures.l2cap import ATT_CHANNEL, Reassembler, Whole
from sphero_probe.captures.numbering import Numbering
from sphero_probe.captures.reader import READERS, Capture
from sphero_probe.captures.record import HCI_H4, HCI_H4_DIRECTION, LINUX_MONITOR, Record
from sphero_probe.captures.redaction.att import RobotAtt
from sphero_probe.captures.redaction.frames import identifying_spans, payload_of
from sphero_probe.captures.redaction.link_layer import trimmed, with_payload
from sphero_probe.captures.redaction.pseudonyms import Pseudonyms
from sphero_probe.captures.redaction.records import ON_AIR, SERIAL, redacted_record
from sphero_probe.captures.source import Source
from sphero_probe.catalogue.capture_context import CaptureContext
from sphero_probe.errors import UnreadableCaptureError

if TYPE_CHECKING:
    from sphero_probe.protocol.packets import Generation

_MAX_WAITING: Final = 4096
"""Records that wait for the rest of a packet."""
_MAX_ROBOTS: Final = 1 << 12


class _Held:
    """A record and what stands for it."""

    def __init__(self, record: Record) -> None:
        self.record = record
        self.made: Record | None = None
        self.settled = False

    def settle(self, made: Record | None) -> None:
        self.made, self.settled = made, True


_Origin = tuple[_Held, int]


class Redaction:
    """One file: first ``learn``, then ``copy``.

    Attributes:
        kept: packets that were written.
        left_out: packets that were not.
    """

    def __init__(self, pseudonyms: Pseudonyms) -> None:
        """Know nothing yet."""
        self.kept = self.left_out = 0
        self._pseudonyms = pseudonyms
        self._channels: dict[int, dict[tuple[int | None, bool | None], Generation]] = {}
        self._counts = Counts()
        self._readers: dict[tuple[int, int], LinkReader] = {}
        self._whole: Reassembler[_Origin] = Reassembler(self._counts)
        self._numbers = Numbering()
        self._robots: dict[int, RobotAtt] = {}
        self._queue: deque[_Held] = deque()

    def learn(self, capture: Capture) -> None:
        """Find the robots, and what identifies them.

        Raises:
            BadInputFileError: nothing in the file can be read.
        """
        contexts: dict[int, CaptureContext] = {}
        for captured in capture.packets():
            number, peer, name = captured.connection
            if number not in self._channels and len(self._channels) >= _MAX_ROBOTS:
                continue
            places = self._channels.setdefault(number, {})
            places[captured.handle, captured.to_robot] = captured.generation
            if peer:
                self._pseudonyms.learn_address(bytes.fromhex(peer.replace(":", "")))
            if name:
                self._pseudonyms.learn_name(name.encode())
            context = contexts.setdefault(number, CaptureContext())
            completed = context.complete(captured.generation, captured.packet)
            for field, start, end in identifying_spans(completed, captured.generation):
                self._pseudonyms.learn_value(field, payload_of(completed)[start:end])

    def copy(self, source: Source) -> Iterator[Record]:
        """Yield the records that may be shared; ``source`` is the file again, at its start."""
        container = recognise(source)
        try:
            for record in (container and container.records) or ():
                self._take(record)
                yield from self._ready(_MAX_WAITING)
        except UnreadableCaptureError:
            pass  # a cut file ends where ``learn`` has ended
        for robot in self._robots.values():
            robot.end()
        yield from self._ready(0)

    def _ready(self, most: int) -> Iterator[Record]:
        """Yield what is settled; what waits beyond the most is left out."""
        while self._queue and (self._queue[0].settled or len(self._queue) > most):
            held = self._queue.popleft()
            held.settled = True
            if held.made is None:
                self.left_out += 1
                continue
            self.kept += 1
            yield held.made

    def _take(self, record: Record) -> None:
        held = _Held(record)
        self._queue.append(held)
        key = (record.link, record.interface)
        reader = self._readers.get(key)
        if reader is None:
            kind = READERS.get(record.link)
            if kind is None:
                held.settle(None)
                return
            reader = self._readers[key] = kind(self._counts)
        passed_over = self._counts.total()
        events = reader.read(record)
        carries = [event for event in events if isinstance(event, Piece | Serial)]
        for event in events:
            self._event(event, held)
        if not carries:
            damaged = self._counts.total() > passed_over
            held.settle(None if damaged else redacted_record(record, self._pseudonyms))

    def _event(self, event: Event, held: _Held) -> None:
        match event:
            case Opened(line=line) | Closed(line=line):
                self._whole.close(*line)
                self._end(self._numbers.end(line))
                if isinstance(event, Opened):
                    self._robot(line)
            case Piece():
                whole = self._whole.feed(event, (held, len(event.data)))
                if whole:
                    self._packet(event.line, whole)
            case Serial(line=line, sent=sent, data=data):
                if robot := self._robot(line):
                    robot.serial(sent, data, lambda new: _settle([(held, len(data))], data, new))
                else:
                    held.settle(None)
            case _:
                pass

    def _packet(self, line: Line, whole: Whole[_Origin]) -> None:
        robot = self._robot(line) if whole.channel == ATT_CHANNEL else None
        if robot is None:
            for held, _ in whole.origins:
                held.settle(None)
            return
        old = _l2cap(whole.data)
        robot.feed(
            whole.sent,
            whole.data,
            lambda new: _settle(whole.origins, old, None if new is None else _l2cap(new)),
        )

    def _robot(self, line: Line) -> RobotAtt | None:
        number, forgotten = self._numbers.of(line)
        self._end(forgotten)
        if number in self._channels and number not in self._robots:
            self._robots[number] = RobotAtt(self._channels[number], self._pseudonyms)
        return self._robots.get(number)

    def _end(self, number: int | None) -> None:
        if number is not None and (robot := self._robots.pop(number, None)):
            robot.end()


def _l2cap(data: bytes) -> bytes:
    return pack("<HH", len(data), ATT_CHANNEL) + data


def _settle(origins: "list[_Origin] | tuple[_Origin, ...]", old: bytes, new: bytes | None) -> None:
    """Put what stands for the bytes of some records into them; only the last one changes its length."""
    for number, (held, size) in enumerate(origins):
        if new is None or new == old:
            kept = trimmed(held.record) if held.record.link in ON_AIR else held.record
            held.settle(None if new is None else kept)
            continue
        last = number == len(origins) - 1
        piece, new_rest = (new, b"") if last else (new[:size], new[size:])
        held.settle(_with_piece(held.record, size, piece))
        new, old = new_rest, b""


def _with_piece(record: Record, size: int, piece: bytes) -> Record | None:
    if record.link in ON_AIR:
        return with_payload(record, piece)
    start = len(record.data) - size
    if record.link in SERIAL:
        return record._replace(data=record.data[:start] + piece)
    if record.link in {HCI_H4, HCI_H4_DIRECTION, LINUX_MONITOR}:
        return record._replace(data=record.data[: start - 2] + pack("<H", len(piece)) + piece)
    return None
