"""pcapng files: sections in either byte order, several interfaces, any resolution of time.

From the IETF draft "PCAP Next Generation (pcapng) Capture File Format".
"""

from collections.abc import Iterator
from struct import Struct, error
from typing import Final, NamedTuple

from sphero_probe.captures.record import Record
from sphero_probe.captures.source import Source
from sphero_probe.errors import UnreadableCaptureError

MAGIC: Final = b"\x0a\x0d\x0d\x0a"
_SECTION, _INTERFACE, _OLD_PACKET, _SIMPLE, _PACKET = 0x0A0D0D0A, 1, 2, 3, 6
_ORDERS: Final = {b"\x1a\x2b\x3c\x4d": ">", b"\x4d\x3c\x2b\x1a": "<"}
_OPT_END, _OPT_FLAGS, _OPT_RESOLUTION, _OPT_OFFSET = 0, 2, 9, 14
_INBOUND, _OUTBOUND = 1, 2
_MAX_INTERFACES: Final = 1 << 12


class _Interface(NamedTuple):
    number: int
    link: int
    per_second: int
    offset: int
    longest: int


class _Section:
    """What the blocks of one section mean: its byte order and its interfaces."""

    def __init__(self, order: str, first: int) -> None:
        self.order = order
        self.interfaces: list[_Interface] = []
        self._first = first
        self._option = Struct(f"{order}HH")

    @property
    def next_number(self) -> int:
        return self._first + len(self.interfaces)

    def options(self, data: bytes) -> dict[int, bytes]:
        found: dict[int, bytes] = {}
        while len(data) >= 4:
            code, size = self._option.unpack_from(data)
            if code == _OPT_END:
                break
            found.setdefault(code, data[4 : 4 + size])
            data = data[4 + size + -size % 4 :]
        return found

    def add_interface(self, body: bytes) -> None:
        if len(self.interfaces) >= _MAX_INTERFACES:
            raise UnreadableCaptureError(f"more than {_MAX_INTERFACES} interfaces")
        link, longest = Struct(f"{self.order}HxxI").unpack_from(body)
        options = self.options(body[8:])
        power = (options.get(_OPT_RESOLUTION) or b"\x06")[0]
        offset = options.get(_OPT_OFFSET, b"")
        seconds = int.from_bytes(offset, "big" if self.order == ">" else "little", signed=True)
        per_second = 2 ** (power & 0x7F) if power & 0x80 else 10**power
        self.interfaces.append(_Interface(self.next_number, link, per_second, seconds, longest))

    def packet(self, kind: int, body: bytes) -> Record | None:
        if kind == _SIMPLE:
            (size,) = Struct(f"{self.order}I").unpack_from(body)
            interface = self.interfaces[0]
            size = min(size, interface.longest or size)
            return Record(None, interface.link, body[4 : 4 + size], interface.number)
        shape = "IIIII" if kind == _PACKET else "HxxIIII"
        index, high, low, size, _ = Struct(f"{self.order}{shape}").unpack_from(body)
        interface = self.interfaces[index]
        ticks = high << 32 | low
        time = interface.offset * 1_000_000_000 + ticks * 1_000_000_000 // interface.per_second
        data = body[20 : 20 + size]
        if len(data) < size:
            return None
        flags = self.options(body[20 + size + -size % 4 :]).get(_OPT_FLAGS, b"\0")
        way = flags[-1 if self.order == ">" else 0] & 3
        sent = True if way == _OUTBOUND else False if way == _INBOUND else None
        return Record(time, interface.link, data, interface.number, sent)


def pcapng_records(source: Source) -> Iterator[Record]:
    """Yield the packets of a pcapng file; a block that makes no sense ends it.

    Raises:
        UnreadableCaptureError: the file is cut, or a block makes no sense.
    """
    section = _Section("<", 0)
    while source.more():
        head = source.take(8)
        if head[:4] == MAGIC:
            order = _ORDERS.get(source.peek(4))
            if order is None:
                raise UnreadableCaptureError("a pcapng section of neither byte order")
            section = _Section(order, section.next_number)
        kind, size = Struct(f"{section.order}II").unpack(head)
        if size < 12 or size % 4:
            raise UnreadableCaptureError(f"a pcapng block of {size} bytes")
        if kind not in {_INTERFACE, _OLD_PACKET, _SIMPLE, _PACKET}:
            source.skip(size - 8)
            continue
        body = source.take(size - 8)[:-4]
        try:
            if kind == _INTERFACE:
                section.add_interface(body)
            elif record := section.packet(kind, body):
                yield record
        except (error, IndexError) as wrong:
            raise UnreadableCaptureError("a pcapng block that makes no sense") from wrong
