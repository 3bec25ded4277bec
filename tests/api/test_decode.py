"""Tests of ``decode``: bytes to named packets, without a robot; the frames are those of tests/protocol."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe import DecodedPacket, Generation, Malformed, Notification, Request, Response, decode
from sphero_probe.protocol import CODECS

BATTERY = bytes.fromhex("8d0a131007cbd8")
PERCENTAGE = bytes.fromhex("8d09131007005f6dd8")
PING_V1 = bytes.fromhex("ffff00015201ab")


def test_a_command_and_its_answer() -> None:
    asked, answered = decode(BATTERY + PERCENTAGE)
    assert (asked.kind, asked.name, asked.fields) == ("command", "power.get_battery_percentage", {})
    assert isinstance(asked.packet, Request)
    assert (asked.raw, asked.payload, asked.note) == (BATTERY, b"", "")
    assert (answered.kind, answered.percentage, answered.units) == ("response", 95, {"percentage": "%"})
    assert isinstance(answered.packet, Response)
    assert answered["percentage"] == 95
    assert answered.payload == b"\x5f"


def test_both_generations_in_one_input() -> None:
    first, second = decode(PING_V1 + BATTERY)
    assert (first.generation, first.name) == (Generation.V1, "core.ping")
    assert (second.generation, second.name) == (Generation.V2, "power.get_battery_percentage")


def test_a_generation_can_be_named() -> None:
    (ping,) = decode(PING_V1, "v1")
    assert ping.name == "core.ping"
    assert {packet.kind for packet in decode(PING_V1, Generation.V2)} == {"malformed"}
    with pytest.raises(ValueError, match="v3"):
        decode(PING_V1, "v3")


def test_damage_is_a_packet_with_a_reason() -> None:
    (broken,) = decode(BATTERY[:-2] + b"\x00\xd8")
    assert broken.kind == "malformed"
    assert isinstance(broken.packet, Malformed)
    assert "checksum" in broken.note
    assert (broken.name, broken.payload, broken.fields) == (None, b"", {})


def test_a_notification_has_its_fields() -> None:
    sent = CODECS[Generation.V2].encode_notification(Notification(0x13, 0x06, bytes([2]), seq=0xFF))
    (packet,) = decode(sent)
    assert isinstance(packet.packet, Notification)
    assert (packet.kind, packet.name) == ("notification", "power.battery_state_changed_notify")
    assert packet.fields


@given(st.binary(max_size=200))
def test_no_bytes_raise_and_none_are_lost(data: bytes) -> None:
    packets = decode(data)
    assert all(isinstance(packet, DecodedPacket) for packet in packets)
    assert b"".join(packet.raw for packet in packets) == data
