"""Addresses in words, and packets byte by byte."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue import ROBOTS
from sphero_probe.catalogue.addresses import Use, address_meaning, address_meanings
from sphero_probe.catalogue.dissection import dissect
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import (
    Command,
    Generation,
    Notification,
    Request,
    Response,
    Role,
    SendOptions,
)
from sphero_probe.protocol.v1 import V1
from sphero_probe.protocol.v2 import V2


@pytest.mark.parametrize(
    ("byte", "use", "robot", "words"),
    [
        # UART capture: command TID 01 SID 01 -> response TID 21 SID 01
        (0x21, Use.ANSWER_TARGET, None, "port 2, node 1: the client behind the robot's UART"),
        (0x21, Use.ANSWER_TARGET, "rvr", "port 2, node 1: the client behind the robot's UART"),
        (0x21, Use.ANSWER_TARGET, "bolt", "port 2, node 1: the client behind the robot's UART (inferred)"),
        (0x01, Use.ANSWER_SOURCE, "rvr", "port 0, node 1: node 1 (primary) of the robot, which answers"),
        # the BOLT+ reference, step 4
        (0x11, Use.ANSWER_TARGET, "bolt-plus", "port 1, node 1: the client behind the robot's Bluetooth"),
        (0x01, Use.COMMAND_SOURCE, None, "port 0, node 1: the client itself"),
        (
            0x12,
            Use.COMMAND_TARGET,
            "rvr",
            "port 1, node 2: node 2 (secondary) of the robot, behind the client's Bluetooth",
        ),
        (
            0x10,
            Use.COMMAND_TARGET,
            None,
            "port 1, node 0: whichever node of the robot can serve it, behind the client's Bluetooth",
        ),
    ],
)
def test_an_address_in_words(byte: int, use: Use, robot: str | None, words: str) -> None:
    assert address_meaning(byte, use, ROBOTS[robot] if robot else None).words == words


@pytest.mark.parametrize("byte", range(256))
def test_every_byte_has_words_in_every_place(byte: int) -> None:
    for said in address_meanings(byte):
        assert said.words.startswith(f"port {byte >> 4}, node {byte & 15}: ")
        assert ("inferred" in said.basis) == said.words.endswith("(inferred)")


REFERENCE = {
    # seed "Sphero V2 Protocol Reference", "Worked example", steps 1 to 3; its sum is misprinted as 0x1BF
    "8d3a11011a1c003fff0000ff000040d8": (
        "SOP FLAGS TID SID DID CID SEQ DATA DATA DATA DATA DATA DATA DATA CHK EOP",
        "sum 0x2bf; 0xff - 0xbf = 0x40",
    ),
    # the same, step 4
    "8d3911011a1c00007ed8": ("SOP FLAGS TID SID DID CID SEQ ERR CHK EOP", "sum 0x81; 0xff - 0x81 = 0x7e"),
}


@pytest.mark.parametrize("frame", REFERENCE)
def test_the_worked_example_of_the_reference(frame: str) -> None:
    names, checksum = REFERENCE[frame]
    raw = bytes.fromhex(frame)
    (packet,) = V2.decoder(Role.OBSERVER).feed(raw)
    parts = dissect(packet, V2.generation, raw)
    assert " ".join(part.field.partition("[")[0] for part in parts) == names
    assert [part.raw for part in parts] == [bytes([byte]) for byte in raw]
    assert [part.value for part in parts[1:-1]] == list(raw[1:-1])
    assert [part.meaning for part in parts if part.field == "CHK"] == [checksum]


def test_escapes_and_the_checksum_are_told() -> None:
    raw = bytes.fromhex("8d091a0e4100ab05d8")  # real: an escaped checksum
    (packet,) = V2.decoder(Role.HOST).feed(raw)
    checksum = dissect(packet, V2.generation, raw)[-2]
    assert (checksum.offset, checksum.raw, checksum.field, checksum.value) == (6, b"\xab\x05", "CHK", 0x8D)
    assert checksum.meaning == "sum 0x72; 0xff - 0x72 = 0x8d; escaped: 0x8d & ~0x88 = 0x05"


@pytest.mark.parametrize(
    ("frame", "role", "names"),
    [
        ("ffff005201ac", Role.HOST, "SOP1 SOP2 MRSP SEQ DLEN CHK"),
        ("fffe0300050001fff8ff", Role.HOST, "SOP1 SOP2 ID DLEN_hi DLEN_lo DATA DATA DATA DATA CHK"),  # real
        ("ffff00015201ab", Role.ROBOT, "SOP1 SOP2 DID CID SEQ DLEN CHK"),
    ],
)
def test_v1_byte_by_byte(frame: str, role: Role, names: str) -> None:
    raw = bytes.fromhex(frame)
    found = V1.decoder(role).feed(raw)
    parts = dissect(found[0], V1.generation, V1.frame_of(found[0]))
    assert " ".join(part.field.partition("[")[0] for part in parts) == names


BYTES = st.integers(0, 255)
ADDRESSES = st.none() | BYTES


@given(
    st.sampled_from(list(Generation)),
    st.one_of(
        st.builds(
            Command,
            BYTES,
            BYTES,
            st.binary(max_size=12),
            ADDRESSES,
            st.builds(SendOptions, st.booleans(), st.booleans(), st.booleans(), ADDRESSES, st.booleans()),
        ),
        st.builds(
            Response, BYTES, BYTES, st.binary(max_size=12), BYTES, BYTES, ADDRESSES, ADDRESSES, st.just(0)
        ),
        st.builds(Notification, st.none(), BYTES, st.binary(max_size=12), *[st.none()] * 3, st.just(0)),
    ),
)
def test_the_parts_joined_are_the_frame(
    generation: Generation, said: Command | Response | Notification
) -> None:
    codec = CODECS[generation]
    match said:
        case Command():
            raw, role = codec.encode_command(said, 7), Role.ROBOT
        case Response():
            raw, role = codec.encode_response(said), Role.HOST
        case Notification():
            named = said._replace(did=0x13, seq=0xFF) if codec.has_addresses else said
            raw, role = codec.encode_notification(named), Role.HOST
    packets = codec.decoder(role).feed(raw)
    assert len(packets) == 1
    parts = dissect(packets[0], generation, raw)
    assert b"".join(part.raw for part in parts) == raw
    assert [part.offset for part in parts] == [
        sum(len(part.raw) for part in parts[:at]) for at in range(len(parts))
    ]
    data = bytes(part.value or 0 for part in parts if part.field.startswith("DATA"))
    assert data == said.payload
    names = codec.flag_names(packets[0]) or ()
    if isinstance(packets[0], Request) and isinstance(said, Command):
        assert ("requests_response" in names) == said.options.answer
        if codec.has_addresses:
            assert ("has_target_id" in names) == (said.target is not None)
            source = said.options.source is not None
            usual = said.target is not None and not said.options.without_source
            assert ("has_source_id" in names) == (source or usual)
