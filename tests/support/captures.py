"""The made-up conversation in every container and link type that is read."""

from collections.abc import Callable
from typing import Final

from tests.support import capture_writers as writers
from tests.support.capture_conversation import cached_v1, foreign, found_v1, found_v2, woven
from tests.support.capture_radio import radio

TALK: Final = woven(found_v2(), cached_v1(), foreign(), found_v1())
"""Four connections at once: a BOLT+ and a V1 robot by discovery, a V1 robot by its traffic, a thermometer."""
_HCI: Final = writers.hci(TALK)


def _raw(link: int) -> list[writers.Raw]:
    return writers.as_raw(_HCI, link)


CAPTURES: Final[dict[str, Callable[[], bytes]]] = {
    "btsnoop 1001": lambda: writers.btsnoop(_HCI, 1001),
    "btsnoop 1002": lambda: writers.btsnoop(_HCI, 1002),
    "btsnoop 2001": lambda: writers.btsnoop(_HCI, 2001),
    "btsnoop, pieces of 5": lambda: writers.btsnoop(writers.hci(TALK, 5)),
    "btsnoop, in one piece": lambda: writers.btsnoop(writers.hci(TALK, 300)),
    "packetlogger": lambda: writers.packetlogger(_HCI),
    "packetlogger, little": lambda: writers.packetlogger(_HCI, "<"),
    "pcap 187": lambda: writers.pcap(_raw(187)),
    "pcap 201": lambda: writers.pcap(_raw(201)),
    "pcap 201, big": lambda: writers.pcap(_raw(201), ">"),
    "pcap 254, ns": lambda: writers.pcap(_raw(254), nanoseconds=True),
    "pcap 254, ns, big": lambda: writers.pcap(_raw(254), ">", nanoseconds=True),
    "pcapng 187": lambda: writers.pcapng(_raw(187)),
    "pcapng 201, big": lambda: writers.pcapng(_raw(201), ">"),
    "pcapng 201, ns": lambda: writers.pcapng(_raw(201), resolution=9, offset=1_600_000_000),
    "pcapng 201, binary": lambda: writers.pcapng(_raw(201), resolution=0x80 | 24, offset=1_600_000_000),
    "pcapng 187, simple": lambda: writers.pcapng(_raw(187), simple=True),
    "pcapng 254": lambda: writers.pcapng(_raw(254)),
    "pcapng 251": lambda: writers.pcapng(radio(TALK, 251)),
    "pcap 251": lambda: writers.pcap(radio(TALK, 251)),
    "pcap 256": lambda: writers.pcap(radio(TALK, 256)),
    "pcapng 256": lambda: writers.pcapng(radio(TALK, 256)),
    "pcap 272": lambda: writers.pcap(radio(TALK, 272)),
    "pcapng 272": lambda: writers.pcapng(radio(TALK, 272), ">"),
}
"""What it is -> the file."""
