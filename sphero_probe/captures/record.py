"""What a container holds: one record a packet, whatever the file calls it."""

from typing import Final, NamedTuple

HCI_H4: Final = 187
HCI_H4_DIRECTION: Final = 201
LINUX_MONITOR: Final = 254
LE_LINK_LAYER: Final = 251
LE_LINK_LAYER_RADIO: Final = 256
NORDIC_SNIFFER: Final = 272
RTAC_SERIAL: Final = 250
USER_SERIAL: Final = 147
"""Link types by their numbers [tcpdump.org: link-layer header types]."""


class Record(NamedTuple):
    """One packet of a capture file.

    Attributes:
        time: nanoseconds since 1970, None where the file does not say.
        link: the link type of the data.
        data: the packet.
        interface: number of the interface that it was captured on, from 0.
        sent: whether the capturing host sent it; None where the container does not say.
    """

    time: int | None
    link: int
    data: bytes
    interface: int = 0
    sent: bool | None = None
