"""btsnooz, the compressed Bluetooth log that Android writes into the text of a bug report, as btsnoop.

From AOSP, ``system/tools/scripts/btsnooz.py`` and ``btif_debug_btsnoop.cc``: base64 of a header and a zlib
stream of records. Versions 1 and 2 are read. Of most data packets Android keeps only the first 14 bytes.
"""

import zlib
from base64 import b64decode
from collections.abc import Iterable, Iterator
from struct import Struct
from typing import Final, NamedTuple

from sphero_probe.captures.btsnoop import EPOCH, MAGIC
from sphero_probe.errors import UnreadableCaptureError

_BEGIN, _END = b"--- BEGIN:BTSNOOP_LOG_SUMMARY", b"--- END:BTSNOOP_LOG_SUMMARY"
_HEAD: Final = Struct("<BQ")
_RECORDS: Final = {1: Struct("<HIB"), 2: Struct("<HHIB")}
"""Version -> the head of a record: bytes kept, in version 2 bytes of the packet, microseconds, kind."""
_ZLIB: Final = 0x78
"""First byte of the compressed part."""
_KINDS: Final = {
    0x10: (4, False),
    0x11: (2, False),
    0x12: (3, False),
    0x17: (5, False),
    0x20: (1, True),
    0x21: (2, True),
    0x22: (3, True),
    0x2D: (5, True),
}
"""Kind of a record -> the type byte of H4, and whether it was sent."""
_MAX_ENCODED: Final = 1 << 25
_MAX_DECODED: Final = 1 << 26
_OUT_HEAD: Final = Struct(">8sII")
_OUT_RECORD: Final = Struct(">IIIIq")
_H4_DATALINK: Final = 1002


class _Kept(NamedTuple):
    """One record: its H4 type, whether it was sent, microseconds since the one before, sizes and bytes."""

    kind: int
    sent: bool
    after: int
    size: int
    data: bytes


def btsnooz_in(lines: Iterable[bytes]) -> bytes | None:
    """Return the log in the text of a bug report, None where it has none.

    Raises:
        UnreadableCaptureError: it is too long.
    """
    held: bytearray | None = None
    for line in lines:
        if held is None:
            held = bytearray() if _BEGIN in line else None
        elif _END in line:
            break
        else:
            held += line.strip()
            if len(held) > _MAX_ENCODED:
                raise UnreadableCaptureError(f"a btsnooz log of more than {_MAX_ENCODED} characters")
    if held is None:
        return None
    try:
        return b64decode(held[: len(held) // 4 * 4])
    except ValueError as error:
        raise UnreadableCaptureError("a btsnooz log that is not base64") from error


def is_btsnooz(first: bytes) -> bool:
    """Whether a file that starts like this is a btsnooz log by itself."""
    return len(first) > _HEAD.size and first[0] in _RECORDS and first[_HEAD.size] == _ZLIB


def as_btsnoop(log: bytes) -> bytes:
    """Return a btsnooz log as a btsnoop file; what a damaged log lacks at its end is missing there, too.

    Raises:
        UnreadableCaptureError: it is of another version, or too long.
    """
    if len(log) < _HEAD.size or log[0] not in _RECORDS:
        raise UnreadableCaptureError("a btsnooz log of an unknown version")
    version, time = _HEAD.unpack_from(log)
    stream = zlib.decompressobj()
    try:
        plain = stream.decompress(log[_HEAD.size :], _MAX_DECODED)
    except zlib.error as error:
        raise UnreadableCaptureError("a btsnooz log that is damaged") from error
    if stream.unconsumed_tail:
        raise UnreadableCaptureError(f"a btsnooz log of more than {_MAX_DECODED} bytes")
    records = list(_records(plain, _RECORDS[version]))
    time += EPOCH - sum(record.after for record in records)  # the header has the time of the last record
    made = bytearray(_OUT_HEAD.pack(MAGIC, 1, _H4_DATALINK))
    for kind, sent, after, size, data in records:
        time += after
        flags = (not sent) | (kind in {1, 4}) << 1
        made += _OUT_RECORD.pack(size, len(data) + 1, flags, 0, time & (1 << 63) - 1)
        made += bytes((kind,)) + data
    return bytes(made)


def _records(plain: bytes, head: Struct) -> Iterator[_Kept]:
    at = passed = 0
    while at + head.size <= len(plain):
        kept, *packet, after, kind = head.unpack_from(plain, at)
        passed += after
        at += head.size
        data = plain[at : at + max(0, kept - 1)]
        if not kept or len(data) < kept - 1:
            return
        at += kept - 1
        if kind in _KINDS:
            yield _Kept(*_KINDS[kind], passed, packet[0] if packet else kept, data)
            passed = 0
