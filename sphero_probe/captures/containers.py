"""Which container a file is, by its first bytes: name and records; None for what is no capture."""

from collections.abc import Iterator
from functools import partial
from typing import Final, NamedTuple

from sphero_probe.captures import btsnoop, pcap, pcapng
from sphero_probe.captures.packetlogger import packetlogger_order, packetlogger_records
from sphero_probe.captures.record import Record
from sphero_probe.captures.source import Source

_OTHERS: Final = {
    b"snoop\0\0\0": "Sun snoop",
    b"\x34\xcd\xb2\xa1": "modified pcap",
    b"\xa1\xb2\xcd\x34": "modified pcap",
    b"Frontline": "Frontline",
    b"\x1f\x8b": "gzip",
    b"\x28\xb5\x2f\xfd": "zstd",
    b"PK\x03\x04": "zip",
}
"""First bytes -> the name of a file that may hold a capture and is not read."""


class Container(NamedTuple):
    """A recognised file.

    Attributes:
        name: what the format is called.
        records: its records, to be read once; None where the format is known and not read.
    """

    name: str
    records: Iterator[Record] | None


def recognise(source: Source) -> Container | None:
    """Return what a file is; nothing is taken from it yet. None where it is no capture."""
    head = source.peek(8)
    if head == btsnoop.MAGIC:
        return Container("btsnoop", btsnoop.btsnoop_records(source))
    if head[:4] in pcap.MAGICS:
        return Container("pcap", pcap.pcap_records(source))
    if head[:4] == pcapng.MAGIC:
        return Container("pcapng", pcapng.pcapng_records(source))
    if order := packetlogger_order(source):
        return Container("PacketLogger", partial(packetlogger_records, order=order)(source))
    name = next((said for start, said in _OTHERS.items() if source.peek(len(start)) == start), None)
    return Container(name, None) if name else None
