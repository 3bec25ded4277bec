"""A recording is read as its packets are, one by one: what the reader remembers changes no meaning."""

import struct

from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue import ROBOTS
from sphero_probe.catalogue.capture_context import CaptureContext
from sphero_probe.catalogue.packet_json import packet_keys
from sphero_probe.catalogue.packet_reader import PacketReader
from sphero_probe.catalogue.streams import StreamDecoder
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import (
    Command,
    Generation,
    Malformed,
    Notification,
    Packet,
    Request,
    Response,
)

V1, V2 = Generation.V1, Generation.V2
ACCELEROMETER = bytes.fromhex("0014000000e000")
"""Arguments of 0x18:0x00: every 20 ms, the three axes of the accelerometer [spherov2]."""

NUMBERS = st.lists(st.floats(width=32), max_size=4).map(
    lambda values: struct.pack(f">{len(values)}f", *values)
)
PAYLOADS = NUMBERS | st.binary(max_size=5)
ADDRESS = st.sampled_from((None, 0x01, 0x11, 0x12))
V2_PACKETS: st.SearchStrategy[Packet] = st.one_of(
    st.builds(
        Notification,
        st.just(0x18),
        st.sampled_from((0x02, 0x3D, 0x12)),
        PAYLOADS,
        ADDRESS,
        ADDRESS,
        st.sampled_from((None, 0xFF, 3)),
        st.sampled_from((0x08, 0x28, 0x38)),
    ),
    st.builds(
        lambda did, cid, payload, source, target: Notification(did, cid, payload, source, target, 0xFF, 0x38),
        *(st.integers(0, 255), st.integers(0, 255), PAYLOADS, ADDRESS, ADDRESS),
    ),
    st.builds(
        lambda payload, seq, source: Request(
            Command(0x18, 0x00, payload, 0x12), seq, source, 0x3A, wants_answer=True
        ),
        st.sampled_from([ACCELEROMETER, bytes(7), b""]),
        st.integers(0, 2),
        ADDRESS,
    ),
    st.builds(
        lambda seq, code: Response(seq, code, b"", 0x18, 0x00), st.integers(0, 2), st.sampled_from((0, 7))
    ),
    st.builds(Malformed, st.binary(max_size=9), st.text(max_size=9)),
)
V1_PACKETS: st.SearchStrategy[Packet] = st.one_of(
    st.builds(lambda cid, payload: Notification(None, cid, payload), st.integers(0, 16), PAYLOADS),
    st.builds(lambda cid, seq: Request(Command(0x02, cid), seq), st.integers(0, 255), st.integers(0, 2)),
    st.builds(lambda seq, payload: Response(seq, 0, payload), st.integers(0, 2), PAYLOADS),
)
RECORDING = st.lists(st.tuples(st.just(V2), V2_PACKETS) | st.tuples(st.just(V1), V1_PACKETS), max_size=12)


@given(
    recording=RECORDING,
    repeats=st.integers(1, 3),
    robot=st.sampled_from((None, "bolt", "mini", "rvr", "sphero")),
    raw_floats=st.booleans(),
)
def test_packets_are_read_as_one_by_one(
    recording: list[tuple[Generation, Packet]], repeats: int, robot: str | None, raw_floats: bool
) -> None:
    model = ROBOTS[robot] if robot else None
    reader, context = PacketReader(model, raw_floats=raw_floats), CaptureContext(model)
    streams = {spoken: StreamDecoder(spoken, model) for spoken in Generation}
    for generation, heard in recording * repeats:
        packet = context.complete(generation, heard)
        raw = CODECS[generation].frame_of(packet)
        streams[generation].observe(packet)
        keys = packet_keys(packet, generation, raw, model, streams[generation], raw_floats=raw_floats)
        read = reader.read(generation, heard)
        assert (read.packet, read.raw) == (packet, raw)
        assert repr(read.keys.data(read.values)) == repr(keys.all)  # the same order, and nan is equal to nan


def test_a_mask_in_between_names_the_numbers() -> None:
    """What was remembered before the command must not outlast it."""
    reader = PacketReader(ROBOTS["bolt"])
    numbers = Notification(0x18, 0x02, struct.pack(">3f", 1, 2, 3), 0x12, None, 0xFF, 0x28)
    before = [reader.read(V2, numbers).values[1] for _ in range(3)]
    assert before == [{"values": [1, 2, 3]}] * 3
    asked = Request(Command(0x18, 0x00, ACCELEROMETER, 0x12), 5, 0x01, 0x3A, wants_answer=True)
    for packet in (asked, Response(5, 0, b"", 0x18, 0x00, 0x12)):
        reader.read(V2, packet)
    read = reader.read(V2, numbers)
    fields = read.keys.data(read.values)["fields"]
    assert fields == {"accelerometer_x": 1, "accelerometer_y": 2, "accelerometer_z": 3}
