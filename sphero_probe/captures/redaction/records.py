"""One record without what identifies, where it carries no part of a connection's traffic."""

from typing import Final

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
from sphero_probe.captures.redaction.hci import redacted_command, redacted_event
from sphero_probe.captures.redaction.link_layer import (
    is_advertising,
    redacted_advertisement,
    redacted_control,
)
from sphero_probe.captures.redaction.pseudonyms import Pseudonyms

ON_AIR: Final = frozenset({LE_LINK_LAYER, LE_LINK_LAYER_RADIO, NORDIC_SNIFFER})
SERIAL: Final = frozenset({RTAC_SERIAL, USER_SERIAL})
_COMMAND, _EVENT = 1, 4
_MONITOR_KINDS: Final = {2: _COMMAND, 3: _EVENT}
_NEW_INDEX, _DEL_INDEX, _OPEN_INDEX, _CLOSE_INDEX, _INDEX_INFO = 0, 1, 8, 9, 10
_INDEX_NAME: Final = 8
"""Where the name of an adapter is that the Linux monitor announces; its address is before it."""


def redacted_record(record: Record, pseudonyms: Pseudonyms) -> Record | None:
    """Return a record, None where it is left out."""
    if record.link in ON_AIR:
        return (
            redacted_advertisement(record, pseudonyms) if is_advertising(record) else redacted_control(record)
        )
    if record.link == LINUX_MONITOR:
        return _monitor(record, pseudonyms)
    if record.link not in {HCI_H4, HCI_H4_DIRECTION}:
        return None
    start = 4 if record.link == HCI_H4_DIRECTION else 0
    head, data = record.data[: start + 1], record.data[start + 1 :]
    made = _hci(head[-1] if len(head) > start else 0, data, pseudonyms)
    return None if made is None else record._replace(data=head + made)


def _hci(kind: int, data: bytes, pseudonyms: Pseudonyms) -> bytes | None:
    if kind == _COMMAND:
        return redacted_command(data, pseudonyms)
    return redacted_event(data, pseudonyms) if kind == _EVENT else None


def _monitor(record: Record, pseudonyms: Pseudonyms) -> Record | None:
    head, data = record.data[:4], record.data[4:]
    opcode = int.from_bytes(head[2:4])
    made: bytes | None
    if opcode == _NEW_INDEX:
        made = data[:2] + pseudonyms.reversed_address(data[2:8]) + bytes(len(data[_INDEX_NAME:]))
    elif opcode == _INDEX_INFO:
        made = pseudonyms.reversed_address(data[:6]) + data[6:8]
    elif opcode in {_DEL_INDEX, _OPEN_INDEX, _CLOSE_INDEX}:
        made = data and None  # it has no data; with some, damage made it of another packet
    else:
        made = _hci(_MONITOR_KINDS.get(opcode, 0), data, pseudonyms)
    return None if made is None else record._replace(data=head + made)
