"""A capture file in, the packets of the robots in it out, and what else was in it."""

from collections.abc import Callable, Generator, Iterator
from typing import Final

from sphero_probe.captures.containers import Container, recognise
from sphero_probe.captures.conversation import Conversation, Conversations
from sphero_probe.captures.events import (
    AttPacket,
    Closed,
    Counts,
    Event,
    Line,
    LinkReader,
    Named,
    Opened,
    Piece,
    Serial,
)
from sphero_probe.captures.hci import CUT_SHORT, HciReader
from sphero_probe.captures.l2cap import ATT_CHANNEL, Reassembler
from sphero_probe.captures.link_layer import ENCRYPTED, LinkLayerReader
from sphero_probe.captures.numbering import Numbering
from sphero_probe.captures.packet import CapturedPacket
from sphero_probe.captures.record import (
    HCI_H4,
    HCI_H4_DIRECTION,
    LE_LINK_LAYER,
    LE_LINK_LAYER_RADIO,
    LINUX_MONITOR,
    NORDIC_SNIFFER,
    RTAC_SERIAL,
    USER_SERIAL,
    Record,
)
from sphero_probe.captures.serial_lines import SerialReader
from sphero_probe.captures.source import Source
from sphero_probe.errors import BadInputFileError, CutCaptureError, UnreadableCaptureError

READERS: Final[dict[int, Callable[[Counts], LinkReader]]] = {
    HCI_H4: HciReader,
    HCI_H4_DIRECTION: HciReader,
    LINUX_MONITOR: HciReader,
    LE_LINK_LAYER: LinkLayerReader,
    LE_LINK_LAYER_RADIO: LinkLayerReader,
    NORDIC_SNIFFER: LinkLayerReader,
    RTAC_SERIAL: SerialReader,
    USER_SERIAL: SerialReader,
}
"""Link type -> what reads its records."""
CONVERT: Final = "convert it: tshark -r FILE -F pcapng -w FILE.pcapng"
_MAX_NAMES: Final = 1 << 12

_Step = AttPacket | Opened | Closed | Named | Serial


class Capture:
    """One capture file; read it once, with ``packets``.

    Attributes:
        container: what the format is called.
        records: packets of any kind that were read.
        values: ATT values, or pieces of a serial line.
        found: Sphero packets.
        counts: what was passed over, in words -> how often.
        cut: bytes of the file that were read if it could not be read to its end, else None.
        why: why it could not.
    """

    def __init__(self, container: Container, source: Source, name: str) -> None:
        """Read nothing yet; ``name`` is what the file is called in messages."""
        self.container = container.name
        self.records = self.values = self.found = 0
        self.counts = Counts()
        self.cut: int | None = None
        self.why = ""
        self._source, self._records, self._name = source, container.records, name
        self._readers: dict[tuple[int, int], LinkReader] = {}
        self._unread: Counts = Counts()
        self._whole: Reassembler[None] = Reassembler(self.counts)
        self._numbers = Numbering()
        self._talks: dict[int, Conversation] = {}
        self._names: dict[str, str] = {}
        self._robots = Conversations()

    def packets(self) -> Iterator[CapturedPacket]:
        """Yield the packets of all robots, in the order of the file.

        Raises:
            BadInputFileError: nothing in the file can be read.
        """
        for packet in self._all():
            self.found += 1
            yield packet
        if not self.records:
            if self._unread:
                kinds = " and ".join(self._unread)
                raise BadInputFileError(
                    f"{self._name}: {self.container} of {kinds}, which are not read", CONVERT
                )
            if self.why:
                raise BadInputFileError(f"{self._name}: {self.container}, {self.why}", CONVERT)
        self.counts.update(self._unread)

    @property
    def said(self) -> str:
        """What was in the file, in a line."""
        parts = [_many(self.records, "packet"), _many(self._numbers.count, "connection")]
        parts += [
            _many(self.values, "value"),
            _many(self.found, "Sphero packet") if self.found else "no Sphero",
        ]
        if not self.found and (near := self._robots.unanswered):
            parts.append(f"{_many(near, 'frame')} without an answer, too few to tell a robot")
        parts += [f"{what}: {count}" for what, count in self.counts.items() if count]
        if self.counts[CUT_SHORT]:
            parts.append("record whole packets, on Android with the HCI snoop log of the developer options")
        if self.counts[ENCRYPTED]:
            parts.append("record HCI on the host, or decrypt with the key in Wireshark and export that")
        if self.cut is not None:
            parts.append(f"cut after {self.cut} bytes: {self.why}")
        return f"{self.container}: {', '.join(parts)}"

    def att_packets(self) -> Iterator[AttPacket]:
        """Yield every packet of the attribute protocol instead, of any device."""
        return (step for step in self._steps() if isinstance(step, AttPacket))

    def _all(self) -> Iterator[CapturedPacket]:
        for step in self._steps():
            yield from self._take(step)
        for talk in tuple(self._talks.values()):
            yield from self._robots.end(talk)
        yield from self._robots.flush()

    def _steps(self) -> Iterator[_Step]:
        """Yield what the records say, the pieces put together; a file that cannot be read on ends it."""
        try:
            for record in self._records or ():
                for event in self._events(record):
                    if not isinstance(event, Piece):
                        if isinstance(event, Opened | Closed):
                            self._whole.close(*event.line)
                        yield event
                    elif (whole := self._whole.feed(event, None)) and whole.channel == ATT_CHANNEL:
                        yield AttPacket(event.time, event.line, whole.sent, whole.data)
        except UnreadableCaptureError as error:
            self.cut, self.why = self._source.whole, str(error)
            if isinstance(error, CutCaptureError) and not self._source.whole:
                self.why = "cut inside its header"

    def _events(self, record: Record) -> list[Event]:
        key = (record.link, record.interface)
        reader = self._readers.get(key)
        if reader is None:
            kind = READERS.get(record.link)
            if kind is None:
                self._unread[f"packets of link type {record.link}"] += 1
                return []
            reader = self._readers[key] = kind(self.counts)
        self.records += 1
        return reader.read(record)

    def _take(self, step: _Step) -> Iterator[CapturedPacket]:
        match step:
            case AttPacket(time, line, sent, data):
                talk = yield from self._talk(line)
                for value in talk.attributes.feed(sent, data):
                    self.values += 1
                    yield from self._robots.feed(talk, time, value)
                talk.discovered()
                yield from self._robots.flush()
            case Serial(time, line, sent, data):
                self.values += 1
                talk = yield from self._talk(line)
                yield from self._robots.bytes_heard(talk, time, (None, None, sent), data)
            case Opened(line, peer):
                yield from self._close(self._numbers.end(line))
                yield from self._talk(line, peer)
            case Closed(line):
                yield from self._close(self._numbers.end(line))
            case Named(peer, name):
                if len(self._names) < _MAX_NAMES:
                    self._names[peer] = name

    def _talk(self, line: Line, peer: str | None = None) -> Generator[CapturedPacket, None, Conversation]:
        number, forgotten = self._numbers.of(line)
        yield from self._close(forgotten)
        talk = self._talks.get(number)
        if talk is None:
            talk = Conversation(number, peer, self._names.get(peer) if peer else None)
            self._talks[number] = talk
        return talk

    def _close(self, number: int | None) -> Iterator[CapturedPacket]:
        if number is not None and (talk := self._talks.pop(number, None)):
            yield from self._robots.end(talk)


def _many(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def open_capture(source: Source, name: str) -> Capture | None:
    """Return the capture in a file; None where the file is none, and then nothing has been taken from it.

    Args:
        source: what to read, at its start.
        name: what it is called in messages.

    Raises:
        BadInputFileError: it is a capture of a format that is not read.
    """
    container = recognise(source)
    if container is None:
        return None
    if container.records is None:
        raise BadInputFileError(f"{name}: {container.name} files are not read", CONVERT)
    return Capture(container, source, name)
