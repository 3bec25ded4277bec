"""Packets to rows: the keys that apply, in their order, decoded by the catalogue."""

from typing import Any

import pytest

from sphero_probe.protocol.packets import Command, Malformed, Notification, Packet, Request, Response, Role
from sphero_probe.reports.rows import (
    packet_row,
)
from tests.support.reports_by_hand import CODEC, V2


@pytest.mark.parametrize(
    ("packet", "expected"),
    [
        pytest.param(
            Request(Command(0x13, 0x10), 7, wants_answer=True),
            {
                "kind": "command",
                "did": 19,
                "cid": 16,
                "seq": 7,
                "name": "power.get_battery_percentage",
                "fields": {},
                "payload": "",
            },
            id="command",
        ),
        pytest.param(
            Request(Command(0x18, 0x00, bytes.fromhex("00960100000003"), 0x12), 8, 0x01),
            {
                "kind": "command",
                "did": 0x18,
                "cid": 0,
                "seq": 8,
                "target": 0x12,
                "source": 1,
                "name": "sensor.set_sensor_streaming_mask",
                "fields": {"interval": 150, "count": 1, "sensor_masks": 3},
                "units": {"interval": "ms"},
                "payload": "00960100000003",
            },
            id="command with arguments and addresses",
        ),
        pytest.param(
            Response(7, 0, b"\x5f", 0x13, 0x10, 0x11),
            {
                "kind": "response",
                "did": 19,
                "cid": 16,
                "seq": 7,
                "code": 0,
                "code_name": "success",
                "source": 17,
                "name": "power.get_battery_percentage",
                "fields": {"percentage": 95},
                "units": {"percentage": "%"},
                "payload": "5f",
            },
            id="response",
        ),
        pytest.param(
            Response(7, 5, b"\x5f", 0x13, 0x10),
            {
                "kind": "response",
                "did": 19,
                "cid": 16,
                "seq": 7,
                "code": 5,
                "code_name": "bad data length",
                "name": "power.get_battery_percentage",
                "payload": "5f",
            },
            id="error response",
        ),
        pytest.param(
            Response(7, 0x42),
            {"kind": "response", "seq": 7, "code": 0x42, "code_name": "unlisted", "payload": ""},
            id="response without ids",
        ),
        pytest.param(
            Notification(0x13, 0x21, b"\x02\x00", 0x11, seq=255),
            {
                "kind": "notification",
                "did": 19,
                "cid": 33,
                "seq": 255,
                "source": 17,
                "name": "power.charger_state_changed_notify",
                "fields": {},
                "payload": "0200",
                "note": "1 byte more than the layout has",
            },
            id="notification with surplus",
        ),
        pytest.param(
            Notification(0x13, 0x1F, b"\x02"),
            {
                "kind": "notification",
                "did": 19,
                "cid": 31,
                "name": "power.battery_state_changed",
                "payload": "02",
            },
            id="the pair's notification, not its command",
        ),
        pytest.param(
            Notification(0x13, 0x10, b"\x02"),
            {
                "kind": "notification",
                "did": 19,
                "cid": 16,
                "name": "power.get_battery_percentage",
                "payload": "02",
            },
            id="a command's pair names a notification but does not decode it",
        ),
        pytest.param(
            Notification(None, 3, b"\x00"), {"kind": "notification", "cid": 3, "payload": "00"}, id="async"
        ),
        pytest.param(
            Request(Command(0x99, 0x99, b"\x01"), 1),
            {"kind": "command", "did": 0x99, "cid": 0x99, "seq": 1, "payload": "01"},
            id="unknown command",
        ),
    ],
)
def test_packet_has_the_keys_that_apply(packet: Packet, expected: dict[str, Any]) -> None:
    row = packet_row(packet, V2, b"\x8d\xd8")
    data = row.data
    assert row.type == "packet"
    assert data.pop("flags") == []  # made by hand, without the flag byte of a frame
    for key in ("target_means", "source_means"):
        assert (data.pop(key, None) is not None) == (key.removesuffix("_means") in expected)
    assert data == {"generation": "v2", "raw": "8dd8", **expected}
    order = [
        "generation",
        "kind",
        "did",
        "cid",
        "seq",
        "code",
        "code_name",
        "target",
        "source",
        "name",
        "fields",
        "units",
        "payload",
        "raw",
        "reason",
        "note",
    ]
    assert sorted(data, key=order.index) == list(data)


def test_malformed_packet() -> None:
    expected = {"generation": "v2", "kind": "malformed", "raw": "8dff", "reason": "checksum"}
    assert packet_row(Malformed(b"\x8d\xff", "checksum"), V2, b"\x8d\xff").data == expected
    assert packet_row(Malformed(b"\x8d\xff", "checksum"), V2, b"").data == expected


def test_packets_of_a_real_frame() -> None:
    raw = bytes.fromhex("8d09131007005f6dd8")
    (packet,) = CODEC.decoder(Role.HOST).feed(raw)
    assert packet_row(packet, V2, raw).data["fields"] == {"percentage": 95}
