"""Decoding sensor streams, from exchanges and from recorded traffic.

The bytes were written by hand from the mask layouts in spherov2's ``sensor.py``.
"""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue.packet_json import packet_json
from sphero_probe.catalogue.streams import StreamDecoder
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation, Notification, Packet, Request, Response, Role

V1, V2 = Generation.V1, Generation.V2
ATTITUDE = Command(0x18, 0x00, bytes.fromhex("00960000070000"), 0x12)
NOTHING = ATTITUDE._replace(payload=bytes(7))
STREAM = Notification(0x18, 0x02, struct.pack(">3f", 1.0, -2.0, 90.0), 0x02)
PITCH_ROLL_YAW = {"pitch": 1.0, "roll": -2.0, "yaw": 90.0}
V1_ACCELEROMETER = Command(0x02, 0x11, bytes.fromhex("0028 0001 00006000 00".replace(" ", "")))
V1_STREAM = Notification(None, 0x03, struct.pack(">2h", -4096, 2048))


def fields(decoder: StreamDecoder, notification: Notification) -> dict[str, object] | None:
    decoded = decoder.decode(notification)
    return dict(decoded.fields) if decoded else None


def test_a_stream_is_named_by_the_masks_that_were_executed() -> None:
    decoder = StreamDecoder(V2)
    assert fields(decoder, STREAM) is None
    decoder.executed(ATTITUDE)
    assert fields(decoder, STREAM) == PITCH_ROLL_YAW
    decoder.executed(Command(0x13, 0x10))
    assert fields(decoder, STREAM) == PITCH_ROLL_YAW
    decoder.executed(NOTHING)
    assert fields(decoder, STREAM) is None


def test_each_node_streams_by_its_own_masks() -> None:
    """As the services of RVR do in the maker's SDK, whose node 1 and node 2 have different ones."""
    decoder = StreamDecoder(V2)
    speed = ATTITUDE._replace(payload=bytes.fromhex("00960000000004"), target=0x11)
    one_number = STREAM._replace(payload=struct.pack(">f", 0.5), source=0x01)
    decoder.executed(ATTITUDE)
    assert fields(decoder, one_number) is None
    assert fields(decoder, STREAM._replace(source=None)) == PITCH_ROLL_YAW
    decoder.executed(speed)
    assert fields(decoder, STREAM) == PITCH_ROLL_YAW
    assert fields(decoder, one_number) == {"speed": 0.5}
    assert fields(decoder, STREAM._replace(source=None)) is None
    decoder.executed(NOTHING)
    assert fields(decoder, STREAM) is None
    assert fields(decoder, one_number) == {"speed": 0.5}
    decoder.executed(NOTHING._replace(target=None))
    assert fields(decoder, one_number) is None


def test_a_command_without_a_target_tells_every_node() -> None:
    decoder = StreamDecoder(V2)
    decoder.executed(ATTITUDE._replace(target=None))
    assert fields(decoder, STREAM) == PITCH_ROLL_YAW
    decoder.executed(NOTHING)
    assert fields(decoder, STREAM) is None
    assert fields(decoder, STREAM._replace(source=0x01)) == PITCH_ROLL_YAW


def test_a_stream_of_the_first_generation() -> None:
    decoder = StreamDecoder(V1)
    decoder.executed(V1_ACCELEROMETER)
    assert fields(decoder, V1_STREAM) == {"accelerometer_y": -1.0, "accelerometer_z": 0.5}


def test_other_notifications_are_left_to_the_catalogue() -> None:
    decoder = StreamDecoder(V2)
    decoder.executed(ATTITUDE)
    assert decoder.decode(STREAM._replace(cid=0x03)) is None


@pytest.mark.parametrize(
    ("traffic", "known"),
    [
        pytest.param([Request(ATTITUDE, 7), Response(7, 0, b"", 0x18, 0x00)], True, id="accepted"),
        pytest.param([Request(ATTITUDE, 7)], False, id="not answered yet"),
        pytest.param([Request(ATTITUDE, 7), Response(7, 5, b"", 0x18, 0x00)], False, id="refused"),
        pytest.param([Request(ATTITUDE, 7), Response(8, 0, b"", 0x18, 0x00)], False, id="another's answer"),
        pytest.param(
            [Request(ATTITUDE, 7), Response(7, 0, b"", 0x13, 0x10), Response(7, 0, b"", 0x18, 0x00)],
            True,
            id="an answer that names another command changes nothing",
        ),
        pytest.param([Request(ATTITUDE, 7, wants_answer=False)], True, id="without an answer"),
        pytest.param(
            [
                *(Request(ATTITUDE, 7), Response(7, 0, b"", 0x18, 0x00)),
                *(Request(NOTHING, 8), Response(8, 6, b"", 0x18, 0x00)),
            ],
            True,
            id="switching off was refused",
        ),
        pytest.param(
            [
                Request(ATTITUDE, 7),
                Request(NOTHING, 8),
                Response(8, 0, b"", 0x18, 0),
                Response(7, 0, b"", 0x18, 0),
            ],
            True,
            id="in the order of the answers",
        ),
    ],
)
def test_recorded_traffic(traffic: list[Packet], known: bool) -> None:
    decoder = StreamDecoder(V2)
    for packet in traffic:
        decoder.observe(packet)
    assert fields(decoder, STREAM) == (PITCH_ROLL_YAW if known else None)


def test_recorded_traffic_of_the_first_generation_has_answers_without_ids() -> None:
    decoder = StreamDecoder(V1)
    decoder.observe(Request(V1_ACCELEROMETER, 3))
    assert fields(decoder, V1_STREAM) is None
    decoder.observe(Response(3, 0))
    assert fields(decoder, V1_STREAM) == {"accelerometer_y": -1.0, "accelerometer_z": 0.5}


def test_a_described_stream_has_the_sensors_and_their_units() -> None:
    decoder = StreamDecoder(V2)
    raw = CODECS[V2].frame_of(STREAM)
    before = packet_json(STREAM, V2, raw, None, decoder)
    decoder.executed(ATTITUDE)
    described = packet_json(STREAM, V2, raw, None, decoder)
    assert described["fields"] == PITCH_ROLL_YAW
    assert described["units"] == dict.fromkeys(PITCH_ROLL_YAW, "deg")
    changed = {"fields", "units", "note"}
    assert {key: value for key, value in before.items() if key not in changed} == {
        key: value for key, value in described.items() if key not in changed
    }
    cut = packet_json(STREAM._replace(payload=STREAM.payload[:-1]), V2, raw, None, decoder)
    assert cut["note"]


@given(st.sampled_from([V1, V2]), st.lists(st.binary(max_size=40)))
def test_whatever_was_recorded_is_decoded_without_raising(
    generation: Generation, chunks: list[bytes]
) -> None:
    decoder, reader = StreamDecoder(generation), CODECS[generation].decoder(Role.OBSERVER)
    for chunk in chunks:
        for packet in reader.feed(chunk):
            decoder.observe(packet)
            if isinstance(packet, Notification):
                decoder.decode(packet)
