"""Bluetooth LE packets from the air without what identifies, with correct checksums.

From the Bluetooth Core Specification, volume 6, part B; Nordic's header as in ``captures.link_layer``.
"""

from typing import Final

from sphero_probe.captures.link_layer import crc24_again
from sphero_probe.captures.record import LE_LINK_LAYER_RADIO, NORDIC_SNIFFER, Record
from sphero_probe.captures.redaction.advertising import redacted_advertising
from sphero_probe.captures.redaction.pseudonyms import Pseudonyms

ADVERTISING_ACCESS: Final = 0x8E89BED6
_ADDRESSES: Final = {0: 1, 1: 2, 2: 1, 3: 2, 4: 1, 5: 2, 6: 1}
"""Type of an advertising packet -> how many addresses it begins with; extended ones are not read."""
_WITH_DATA: Final = frozenset({0, 2, 4, 6})
_PDU_TYPE: Final = 0xF
_HEAD, _CRC = 6, 3
_KIND: Final = 3
"""Bits of a data header that say what it is; all are set in a control packet."""
_CONTROL: Final = {
    **dict.fromkeys((0x05, 0x06, 0x0A, 0x0B, 0x12, 0x13), 1),
    **dict.fromkeys((0x02, 0x07, 0x0D), 2),
    **dict.fromkeys((0x11, 0x16, 0x17), 3),
    **dict.fromkeys((0x08, 0x09, 0x0E, 0x14, 0x15), 9),
    **dict.fromkeys((0x0F, 0x10), 24),
    0x00: 12,
    0x01: 8,
    0x0C: 6,
    0x18: 5,
}
"""Opcode of a control packet that is kept -> its length; parts of keys are in 0x03 and 0x04."""
_NORDIC_HEAD, _NORDIC_MORE = 7, 10
"""Bytes of Nordic's two headers; the second begins with its length."""
_ONE_BYTE_LENGTH: Final = 1
"""Version of Nordic's protocol whose header has a length of one byte."""
_RADIO_HEAD: Final = 10
_LONGEST: Final = 255


def radio_start(record: Record) -> int:
    """Return where the access address is in a record; its end where there is none."""
    if record.link == NORDIC_SNIFFER:
        is_sound = record.data[_NORDIC_HEAD : _NORDIC_HEAD + 1] == bytes((_NORDIC_MORE,))
        return min(len(record.data), _NORDIC_HEAD + _NORDIC_MORE) if is_sound else len(record.data)
    return _RADIO_HEAD if record.link == LE_LINK_LAYER_RADIO else 0


def is_advertising(record: Record) -> bool:
    """Whether it is a packet of an advertising channel."""
    start = radio_start(record)
    return record.data[start : start + 4] == ADVERTISING_ACCESS.to_bytes(4, "little")


def redacted_advertisement(record: Record, pseudonyms: Pseudonyms) -> Record | None:
    """Return a packet of an advertising channel, None where its type is not known or it is cut."""
    start = radio_start(record)
    body = record.data[start:]
    size = body[5] if len(body) > 5 else 0
    count = _ADDRESSES.get(body[4] & _PDU_TYPE if size else -1)
    payload = body[_HEAD : _HEAD + size]
    if count is None or len(payload) < max(size, 6 * count):
        return None
    made = b"".join(pseudonyms.reversed_address(payload[at : at + 6]) for at in range(0, 6 * count, 6))
    rest = payload[6 * count :]
    made += redacted_advertising(rest, pseudonyms) if body[4] & _PDU_TYPE in _WITH_DATA else rest
    return with_payload(record, made)


def redacted_control(record: Record) -> Record | None:
    """Return a control packet or an empty packet of a connection; None for others, and for parts of keys."""
    body = record.data[radio_start(record) :]
    if len(body) < _HEAD:
        return None
    size = body[5]
    control = body[4] & _KIND == _KIND and len(body) > _HEAD and _CONTROL.get(body[_HEAD]) == size
    return trimmed(record) if control or not size else None


def trimmed(record: Record) -> Record:
    """Return a record without what follows its packet, which a damaged length may have added."""
    start = radio_start(record)
    size = record.data[start + 5] if len(record.data) > start + 5 else 0
    return record._replace(data=record.data[: start + _HEAD + size + _CRC])


def with_payload(record: Record, payload: bytes) -> Record | None:
    """Return a packet with another payload, with fitting lengths and checksum; None if it is too long."""
    start = radio_start(record)
    body = record.data[start:]
    old = body[: _HEAD + body[5]]
    if len(payload) > _LONGEST:
        return None
    new = old[:5] + bytes((len(payload),)) + payload
    checksum = body[len(old) : len(old) + _CRC]
    if len(checksum) == _CRC:
        checksum = crc24_again(old[4:], checksum, new[4:])
    head = _lengthened(record, len(new) - len(old)) if record.link == NORDIC_SNIFFER else record.data[:start]
    return record._replace(data=head + new + checksum)


def _lengthened(record: Record, more: int) -> bytes:
    """Return Nordic's headers with the length of what follows the first one changed."""
    head = bytearray(record.data[: radio_start(record)])
    if head[3] == _ONE_BYTE_LENGTH:
        head[2] = head[2] + more & 0xFF
    else:
        head[1:3] = (int.from_bytes(head[1:3], "little") + more & 0xFFFF).to_bytes(2, "little")
    return bytes(head)
