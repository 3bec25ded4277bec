"""JSON objects: the same text as Python's own encoder, with what rows share written once, and with orjson."""

import json
import struct
from math import isfinite

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sphero_probe.catalogue.packet_json import SharedKeys, packet_keys
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
from sphero_probe.reports import json_text
from sphero_probe.reports.json_text import JsonObjects
from sphero_probe.reports.rows import Row, packet_row

BYTES = st.integers(0, 255)
SINGLES = st.lists(st.floats(width=32), max_size=14).map(
    lambda values: struct.pack(f">{len(values)}f", *values)
)
PACKETS = st.one_of(
    SINGLES.map(lambda payload: Notification(0x18, 0x02, payload, 0x12, None, 0xFF, 0x28)),
    st.builds(
        Notification, st.just(0x13), BYTES, st.binary(max_size=9), st.none(), st.none(), BYTES, st.just(8)
    ),
    st.builds(
        Response,
        BYTES,
        st.sampled_from((0, 5, 0x42)),
        st.binary(max_size=4),
        st.just(0x13),
        BYTES,
        st.just(0x12),
        st.just(1),
    ),
    st.builds(lambda cid, seq: Request(Command(0x11, cid, b"", 0x12), seq, 0x01, 0x3A), BYTES, BYTES),
    st.builds(Malformed, st.binary(max_size=9), st.text(max_size=9)),
)


def plainly(row: Row, *, first: bool) -> str:
    """The object by the standard library, at once."""
    whole = {"type": row.type} | ({"schema_version": json_text.SCHEMA_VERSION} if first else {}) | row.data

    def finite(value: object) -> object:
        if isinstance(value, dict):
            return {key: finite(held) for key, held in value.items()}
        if isinstance(value, list):
            return [finite(held) for held in value]
        return str(value) if isinstance(value, float) and not isfinite(value) else value

    return json.dumps(finite(whole)).replace("\x7f", r"\u007f")


def row_of(packet: Packet) -> Row:
    return packet_row(packet, Generation.V2, CODECS[Generation.V2].frame_of(packet))


@pytest.mark.parametrize("with_orjson", [False, True])
@settings(max_examples=40)
@given(packets=st.lists(PACKETS, max_size=8))
def test_packets_are_written_as_the_standard_library_writes_them(
    packets: list[Packet], with_orjson: bool
) -> None:
    with pytest.MonkeyPatch.context() as patch:
        if with_orjson:
            patch.setattr(json_text, "dumps", pytest.importorskip("orjson").dumps)
        else:
            patch.setattr(json_text, "dumps", None)
        rows = [row_of(packet) for packet in packets]
        objects = JsonObjects()
        for number, row in enumerate(rows):
            assert objects.text(row) == plainly(row, first=not number)


@pytest.mark.parametrize("with_orjson", [False, True])
@settings(max_examples=40)
@given(
    data=st.dictionaries(
        st.text(),
        st.recursive(
            st.none() | st.booleans() | st.integers() | st.text() | st.floats() | st.lists(st.floats()),
            lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
        ),
    )
)
def test_any_row_is_written_as_the_standard_library_writes_it(
    data: dict[str, object], with_orjson: bool
) -> None:
    with pytest.MonkeyPatch.context() as patch:
        dumps = pytest.importorskip("orjson").dumps if with_orjson else None
        patch.setattr(json_text, "dumps", dumps)
        objects = JsonObjects()
        fixed = {key: data[key] for key in list(data)[::2]}
        keys = [SharedKeys(data, fixed) for _ in range(2)]
        values = tuple(data[key] for key in keys[0].varying)
        rows = [Row("100 %", None, keys[0], values), Row("y", None, keys[1], values)]
        for number, row in enumerate((Row("x", data), *rows, *rows)):
            assert objects.text(row) == plainly(row, first=not number)


def test_packets_of_one_kind_share_their_header() -> None:
    packets = [Notification(0x18, 0x02, bytes(4 * count), 0x12, None, 0xFF, 0x28) for count in range(3)]
    shared = [packet_keys(packet, Generation.V2, b"\x8d\xd8").keys for packet in packets]
    assert shared[0] is shared[1] is shared[2]
    assert shared[0].varying == ("seq", "fields", "payload", "raw")
    other = packet_keys(packets[0]._replace(source=0x11), Generation.V2, b"\x8d\xd8").keys
    assert other.fixed["source"] == 0x11
