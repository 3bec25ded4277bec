"""btsnoop files, as Android and BlueZ write them.

From RFC 1761 with the datalink numbers of Symbian's btsnoop and of BlueZ (``src/shared/btsnoop.h``).
"""

from collections.abc import Iterator
from struct import Struct
from typing import Final

from sphero_probe.captures.record import HCI_H4, LINUX_MONITOR, Record
from sphero_probe.captures.source import Source
from sphero_probe.errors import UnreadableCaptureError

MAGIC: Final = b"btsnoop\0"
_HEAD: Final = Struct(">8sII")
_RECORD: Final = Struct(">IIIIq")
EPOCH: Final = 0x00DCDDB30F2F8000
"""Microseconds from the year 0, where btsnoop starts to count, to 1970."""
_H1, _H4, _MONITOR = 1001, 1002, 2001
_RECEIVED, _COMMAND_OR_EVENT = 1, 2
_H4_TYPES: Final = {0: 2, _RECEIVED: 2, _COMMAND_OR_EVENT: 1, _COMMAND_OR_EVENT | _RECEIVED: 4}
"""Flags of datalink 1001 -> the type byte that H4 puts before the same packet."""


def btsnoop_records(source: Source) -> Iterator[Record]:
    """Yield the records of a btsnoop file.

    Raises:
        UnreadableCaptureError: the file is cut, or its datalink is none of those that are read.
    """
    _, _, datalink = _HEAD.unpack(source.take(_HEAD.size))
    if datalink not in {_H1, _H4, _MONITOR}:
        raise UnreadableCaptureError(f"btsnoop datalink {datalink} is not read")
    while source.more():
        _, size, flags, _, stamp = _RECORD.unpack(source.take(_RECORD.size))
        data = source.take(size)
        time = (stamp - EPOCH) * 1000
        if datalink == _MONITOR:
            yield Record(time, LINUX_MONITOR, flags.to_bytes(4) + data)
            continue
        if datalink == _H1:
            data = bytes((_H4_TYPES[flags & 3],)) + data
        yield Record(time, HCI_H4, data, 0, not flags & _RECEIVED)
