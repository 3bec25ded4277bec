"""Layouts: parsing, lengths, decoding and encoding."""

import json
import math
import struct
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue import all_rows
from sphero_probe.catalogue.payload.enums import VALUE_NAMES
from sphero_probe.catalogue.payload.layout import Field, Layout
from sphero_probe.protocol.packets import Generation

SAMPLES = (
    "",
    "value:u8",
    "a:u64 b:i8 c:i32 end:const=7",
    "temperature:f32[°C]",
    "values:f32*",
    "counts:i32*2 flag:bool",
    "state:u8{BatteryVoltageStates}",
    "states:u8{BatteryVoltageStates}*",
    "voltage:uint/100[V]",
    "flags:uint{PendingUpdateFlags}",
    "acceleration:i16/4096[g]",
    "message:bytes*4 name:cstring*6",
    "token:u8 data:bytes",
    "name:cstring",
)
LAYOUTS = sorted(
    {
        layout.text
        for generation in Generation
        for row in all_rows(generation)
        for layout in (row.request, row.response)
        if layout is not None
    }
    | set(SAMPLES)
)
RANGES = {"bool": (0, 1)} | {
    f"{sign}{bits}": (0, 2**bits - 1) if sign == "u" else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    for sign, bits in (("u", 8), ("u", 16), ("u", 32), ("u", 64), ("i", 8), ("i", 16), ("i", 32))
}


def shortened(number: float) -> object:
    """The shortest decimal of the same 32-bit float, computed in another way than in the code."""
    if not math.isfinite(number):
        return str(number)
    return Layout("x:f32").decode(Layout("x:f32").encode({"x": number})).fields["x"]


def element(field: Field) -> st.SearchStrategy[Any]:
    if field.values:
        names = VALUE_NAMES[field.values]
        if names.flags:
            return st.sets(st.sampled_from(sorted(names.names))).map(
                lambda bits: [name for bit, name in names.names.items() if bit in bits]
            )
        return st.sampled_from(sorted(names.names.values()))
    if field.type == "f32":
        return st.floats(width=32).map(shortened)
    low, high = RANGES["u32" if field.type == "uint" else field.type]
    numbers = st.integers(low, high)
    if field.type == "bool":
        return numbers.map(bool)
    return numbers if field.scale == 1 else numbers.map(lambda number: number / field.scale)


def values_for(field: Field) -> st.SearchStrategy[Any]:
    if field.type == "bytes":
        size = {} if field.count is None else {"min_size": field.count}
        return st.binary(max_size=field.count or 40, **size).map(bytes.hex)
    if field.type == "cstring":
        texts = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=40)
        return texts.filter(lambda text: field.count is None or len(text.encode()) <= field.count)
    if field.count is not None:
        return st.lists(element(field), min_size=field.count, max_size=field.count)
    return st.lists(element(field), max_size=9) if field.to_end and field.type != "uint" else element(field)


@st.composite
def layouts_with_values(draw: st.DrawFn) -> tuple[Layout, dict[str, Any]]:
    layout = Layout(draw(st.sampled_from(LAYOUTS)))
    return layout, {field.name: draw(values_for(field)) for field in layout.fields if field.const is None}


@given(layouts_with_values())
def test_what_was_encoded_decodes_to_the_same(case: tuple[Layout, dict[str, Any]]) -> None:
    layout, values = case
    payload = layout.encode(values)
    assert layout.accepts(len(payload))
    fields, units, rest, problem = layout.decode(payload)
    assert (fields, rest, problem) == (values, b"", "")
    assert units == {field.name: field.unit for field in layout.fields if field.unit}


@given(st.sampled_from(LAYOUTS), st.binary(max_size=80))
def test_any_payload_decodes_to_plain_json(text: str, payload: bytes) -> None:
    layout = Layout(text)
    decoded = layout.decode(payload)
    json.dumps(decoded.fields, allow_nan=False)
    assert payload.endswith(decoded.rest)
    if decoded.rest:
        assert decoded.problem
    if not layout.accepts(len(payload)):
        assert decoded.problem


@given(st.sampled_from(LAYOUTS))
def test_zeros_are_the_shortest_payload_that_fits(text: str) -> None:
    layout = Layout(text)
    zeros = layout.zeros()
    assert len(zeros) == layout.minimum_length
    assert layout.accepts(len(zeros))
    assert not any(layout.accepts(length) for length in range(len(zeros)))
    assert layout.decode(zeros).problem == ""


@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_floats_have_as_few_digits_as_tell_them_apart(number: float) -> None:
    (shown,) = Layout("x:f32").decode(struct.pack(">f", number)).fields.values()
    candidates = [float(f"{number:.{digits}g}") for digits in range(6, 10)]
    fitting = [one for one in candidates if struct.pack(">f", one) == struct.pack(">f", number)]
    assert isinstance(shown, float)
    assert math.copysign(1, shown) == math.copysign(1, number)
    assert shown == fitting[0]


HARD_SINGLES = (
    0x00000000,
    0x80000000,
    0x7F800000,
    0xFFC00000,
    0x00000001,
    0x7F7FFFFF,
    0x501502F9,
    0x4B800000,
)
"""Zeros, infinite, not a number, the smallest, the largest, 1e10, 2**24."""


@given(st.lists(st.integers(0, 0xFFFF_FFFF) | st.sampled_from(HARD_SINGLES), max_size=70))
def test_lists_of_floats_have_the_digits_of_each_alone(words: list[int]) -> None:
    payload = struct.pack(f">{len(words)}I", *words)
    each = [Layout("x:f32[deg]?").decode(payload[at : at + 4]) for at in range(0, len(payload), 4)]
    together = Layout("values:f32*").decode(payload).fields["values"]
    assert repr(together) == repr([one.fields["x"] for one in each])  # repr tells 0.0 from -0.0
    raw = Layout("values:f32*").decode(payload, raw_floats=True).fields["values"]
    assert repr(raw) == repr([*struct.unpack(f">{len(words)}f", payload)])


@given(st.floats(width=32, allow_nan=False))
def test_floats_keep_their_bytes(number: float) -> None:
    layout, payload = Layout("x:f32"), struct.pack(">f", number)
    assert layout.encode(layout.decode(payload).fields) == payload


@pytest.mark.parametrize(
    ("text", "fixed", "minimum", "accepted", "refused"),
    [
        pytest.param("", 0, 0, [0], [1, 11], id="nothing"),
        pytest.param("speed:u8 heading:u16[deg] flags:u8", 4, 4, [4], [0, 3, 5], id="fixed"),
        pytest.param("a:u64 b:f32 c:bool end:const=0", 14, 14, [14], [13, 15], id="wide"),
        pytest.param("encoder_counts:i32*2", 8, 8, [8], [4, 12], id="counted"),
        pytest.param("message:bytes*32", 32, 32, [32], [31, 33], id="blob"),
        pytest.param("frames:u16*", None, 0, [0, 2, 40], [1, 3], id="repeat"),
        pytest.param("mask:u16 values:bytes", None, 2, [2, 3, 40], [0, 1], id="tail"),
        pytest.param("name:cstring", None, 0, [0, 1, 40], [], id="text"),
        pytest.param("voltage:uint/100[V]", None, 1, [1, 2, 3, 8], [0, 9], id="uint"),
    ],
)
def test_lengths(text: str, fixed: int | None, minimum: int, accepted: list[int], refused: list[int]) -> None:
    layout = Layout(text)
    assert layout.fixed_length == fixed
    assert layout.minimum_length == minimum
    assert all(layout.accepts(length) for length in accepted)
    assert not any(layout.accepts(length) for length in refused)


@pytest.mark.parametrize(
    ("text", "payload", "fields"),
    [
        pytest.param("percentage:u8[%]", "5f", {"percentage": 95}, id="battery percentage"),
        pytest.param(
            "major:u16 minor:u16 revision:u16",
            "0009000101ce",
            {"major": 9, "minor": 1, "revision": 462},
            id="version",
        ),
        pytest.param("voltage:uint/100[V]", "018f", {"voltage": 3.99}, id="battery voltage"),
        pytest.param("state:u8{BatteryVoltageStates}", "02", {"state": "low"}, id="named"),
        pytest.param("state:u8{BatteryVoltageStates}", "63", {"state": 99}, id="unlisted keeps its number"),
        pytest.param("flags:u8{DriveFlags}", "05", {"flags": ["backward", "fast_turn"]}, id="flags"),
        pytest.param("flags:u8{DriveFlags}", "00", {"flags": []}, id="no flags"),
        pytest.param(
            "flags:u8{DriveFlags}", "c1", {"flags": ["backward", 0xC0]}, id="unnamed flags as one number"
        ),
        pytest.param("on:bool off:bool odd:bool", "010007", {"on": True, "off": False, "odd": 7}, id="bool"),
        pytest.param("value:f32", "3dcccccd", {"value": 0.1}, id="float in its fewest digits"),
        pytest.param("value:f32", "3f800001", {"value": 1.0000001}, id="float of eight digits"),
        pytest.param("value:f32", "3c344c41", {"value": 0.0110045085}, id="float of nine digits"),
        pytest.param("value:f32", "7f7fffff", {"value": 3.4028235e38}, id="largest float"),
        pytest.param(
            "values:f32*", "7fc000007f800000ff800000", {"values": ["nan", "inf", "-inf"]}, id="not finite"
        ),
        pytest.param("counts:i32*2", "ffffffff00000010", {"counts": [-1, 16]}, id="counted"),
        pytest.param("name:cstring", "52562d3100", {"name": "RV-1"}, id="text with NUL"),
        pytest.param("name:cstring", "52562d31", {"name": "RV-1"}, id="text without NUL"),
        pytest.param("name:cstring", "1b5d41ff", {"name": "\x1b]A\\xff"}, id="text as it is"),
        pytest.param("name:cstring*4 line:u16", "6d00000000 07", {"name": "m", "line": 7}, id="padded text"),
        pytest.param("data:bytes", "8DAB", {"data": "8dab"}, id="bytes as hex"),
        pytest.param("x:const=3 y:u8", "0309", {"y": 9}, id="a constant says nothing"),
    ],
)
def test_decode(text: str, payload: str, fields: dict[str, Any]) -> None:
    decoded = Layout(text).decode(bytes.fromhex(payload))
    assert decoded.fields == fields
    assert (decoded.rest, decoded.problem) == (b"", "")


@pytest.mark.parametrize(
    ("text", "payload", "fields", "rest", "problem"),
    [
        pytest.param("a:u8 b:u16", "01ff", {}, "01ff", "short payload: b needs 2 bytes, 1 left", id="short"),
        pytest.param("a:u8", "", {}, "", "short payload: a needs 1 byte, 0 left", id="empty"),
        pytest.param("a:u8", "010203", {}, "010203", "2 bytes more than the layout has", id="surplus"),
        pytest.param("", "01", {}, "01", "1 byte more than the layout has", id="surplus of nothing"),
        pytest.param("frames:u16*", "000102", {}, "000102", "1 byte more than the layout has", id="odd tail"),
        pytest.param(
            "name:cstring",
            "41004200",
            {"name": "A"},
            "4200",
            "2 bytes more than the layout has",
            id="after NUL",
        ),
        pytest.param(
            "n:cstring*4", "41004200", {"n": "A"}, "", "n continues after its end: 4200", id="dirty padding"
        ),
        pytest.param(
            "v:uint",
            "00" * 8 + "01",
            {},
            "00" * 8 + "01",
            "1 byte more than the layout has",
            id="long number",
        ),
        pytest.param(
            "a:u8 b:u8 | a:u16 b:u16",
            "010203",
            {},
            "010203",
            "3 bytes, the known layouts have 2 or 4",
            id="variants",
        ),
        pytest.param(
            "x:const=3 y:u8", "0409", {"x": 4, "y": 9}, "", "x is always 3, here 4", id="other constant"
        ),
    ],
)
def test_mismatches_are_reported(
    text: str, payload: str, fields: dict[str, Any], rest: str, problem: str
) -> None:
    decoded = Layout(text).decode(bytes.fromhex(payload))
    assert decoded.fields == fields
    assert decoded.rest.hex() == rest
    assert decoded.problem == problem


def test_units_go_with_the_fields_that_were_there() -> None:
    layout = Layout("interval:u16[ms] yaw:u16[deg]")
    assert layout.decode(bytes(4)).units == {"interval": "ms", "yaw": "deg"}
    assert layout.decode(bytes(3)).units == {}


SPEED = Layout("speed:u8[cm/s] | x:i16 speed:u16/10[cm/s]")


@pytest.mark.parametrize(
    ("payload", "fields"),
    [
        pytest.param("07", {"speed": 7}, id="the first"),
        pytest.param("fffe000f", {"x": -2, "speed": 1.5}, id="the second"),
    ],
)
def test_the_variant_whose_length_fits_decodes_and_encodes(payload: str, fields: dict[str, object]) -> None:
    decoded = SPEED.decode(bytes.fromhex(payload))
    assert decoded == (fields, {"speed": "cm/s"}, b"", "")
    assert SPEED.encode(fields).hex() == payload


def test_a_layout_of_variants_takes_all_their_lengths_and_stands_for_the_first() -> None:
    assert [length for length in range(9) if SPEED.accepts(length)] == [1, 4]
    assert (SPEED.minimum_length, SPEED.fixed_length, SPEED.zeros()) == (1, None, b"\0")
    assert SPEED.fields == Layout("speed:u8[cm/s]").fields
    assert [variant.text for variant in SPEED.variants] == ["speed:u8[cm/s]", "x:i16 speed:u16/10[cm/s]"]
    assert Layout("a:u8 b:u8 | a:u16").fixed_length == 2
    with pytest.raises(ValueError, match="no field"):
        SPEED.encode({"y": 1})


@pytest.mark.parametrize("text", ["a:u8 |", "| a:u8", "a:u8 | | b:u16"])
def test_an_empty_variant_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="empty variant"):
        Layout(text).accepts(1)


def test_a_scale_may_have_decimals_and_stays_exact() -> None:
    share = Layout("share:u8/2.55[%]")
    decoded = [share.decode(bytes([raw])).fields["share"] for raw in range(256)]
    assert (decoded[0], decoded[51], decoded[255]) == (0.0, 20.0, 100.0)
    assert [share.encode({"share": value})[0] for value in decoded] == list(range(256))


@pytest.mark.parametrize(
    ("text", "values", "payload"),
    [
        pytest.param(
            "speed:u8 heading:u16[deg] flags:u8{DriveFlags}",
            {"speed": 255, "flags": ["turbo"]},
            "ff000002",
            id="gaps",
        ),
        pytest.param("flags:u8{DriveFlags}", {"flags": ["backward", 0xC0]}, "c1", id="unnamed flags"),
        pytest.param("flags:u8{DriveFlags}", {"flags": 3}, "03", id="flags as a number"),
        pytest.param("state:u8{BatteryVoltageStates}", {"state": 99}, "63", id="unlisted"),
        pytest.param("voltage:uint/100[V]", {"voltage": 3.99}, "018f", id="scaled"),
        pytest.param("value:uint", {"value": 65536}, "00010000", id="uint of four bytes"),
        pytest.param("value:f32", {"value": "-inf"}, "ff800000", id="not finite"),
        pytest.param("name:cstring", {"name": "RV-1"}, "52562d3100", id="NUL added"),
        pytest.param("name:cstring*4 x:const=7", {"name": "m"}, "6d00000007", id="padded"),
        pytest.param("a:u8 frames:u16*", {}, "00", id="nothing given"),
    ],
)
def test_encode(text: str, values: dict[str, Any], payload: str) -> None:
    assert Layout(text).encode(values).hex() == payload


@pytest.mark.parametrize(
    ("text", "values", "message"),
    [
        pytest.param("a:u8", {"b": 1}, "no field b", id="unknown field"),
        pytest.param("a:u8", {"a": 256}, "256 does not fit field a:u8", id="too big"),
        pytest.param("a:u8", {"a": "1"}, "does not fit", id="text for a number"),
        pytest.param("a:u8{DriveFlags}", {"a": ["sideways"]}, "does not fit", id="unlisted flag"),
        pytest.param("a:u8{BatteryStates}", {"a": "sideways"}, "does not fit", id="unlisted name"),
        pytest.param("a:uint", {"a": -1}, "does not fit", id="negative uint"),
        pytest.param("a:uint", {"a": 2**64}, "does not fit", id="uint beyond eight bytes"),
        pytest.param("a:bytes*2", {"a": "010203"}, "does not fit", id="too long"),
        pytest.param("a:bytes", {"a": "0g"}, "does not fit", id="no hex"),
        pytest.param("a:bytes", {"a": 7}, "does not fit", id="number for bytes"),
        pytest.param("a:cstring", {"a": "x\0y"}, "does not fit", id="NUL inside"),
        pytest.param("a:i32*2", {"a": [1]}, "does not fit", id="too few"),
        pytest.param("a:u16*", {"a": 1}, "does not fit", id="no list"),
    ],
)
def test_encode_refuses(text: str, values: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Layout(text).encode(values)


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("speed", id="no type"),
        pytest.param("speed:u7", id="unknown type"),
        pytest.param("Speed:u8", id="capital"),
        pytest.param("x:u8=3", id="constant of another type"),
        pytest.param("x:const", id="constant without value"),
        pytest.param("x:const=300", id="constant beyond a byte"),
        pytest.param("x:const=1*2", id="repeated constant"),
        pytest.param("x:const=1!", id="identifying constant"),
        pytest.param("x:const=1~", id="volatile constant"),
        pytest.param("x:u8~!", id="marks in another order"),
        pytest.param("x:bytes/2", id="scaled bytes"),
        pytest.param("x:cstring*", id="repeated text"),
        pytest.param("x:uint*2", id="repeated uint"),
        pytest.param("x:u8{NoSuchNames}", id="unknown names"),
        pytest.param("x:f32{DriveFlags}", id="named float"),
        pytest.param("x:u8 x:u8", id="same name twice"),
        pytest.param("x:bytes y:u8", id="something behind the end"),
    ],
)
def test_nonsense_is_refused_when_first_used(text: str) -> None:
    layout = Layout(text)
    with pytest.raises(ValueError, match="layout"):
        layout.fields  # noqa: B018


def test_fields_are_parsed() -> None:
    assert Layout("speed:u8 yaw:i16/10[deg] names:u8{EfuseIds}*3").fields == (
        Field("speed", "u8"),
        Field("yaw", "i16", scale=10, unit="deg"),
        Field("names", "u8", values="EfuseIds", count=3),
    )


@pytest.mark.parametrize(
    ("text", "payload", "expected"),
    [
        pytest.param("mac:cstring!", b"A1B2\0", [("mac", b"A1B2")], id="text without its NUL"),
        pytest.param("n:cstring*4! a:u8 id:u16!", b"x\0\0\0\7\1\2", [("n", b"x"), ("id", b"\1\2")], id="two"),
        pytest.param("a:u8 id:uint!", b"\7\1\2\3", [("id", b"\1\2\3")], id="to the end"),
        pytest.param("a:u8 id:u16?!", b"\7", [], id="absent"),
        pytest.param("a:u8 | a:u8 id:u16!", b"\7\1\2", [("id", b"\1\2")], id="variant"),
        pytest.param("a:u8 id:u16!", b"\7\1\2\3", [("id", b"\7\1\2\3")], id="no layout has this length"),
        pytest.param("a:u8 id:u16", b"\7\1\2\3", [], id="none is marked"),
        pytest.param("id:bytes!", b"", [], id="empty"),
    ],
)
def test_identifying_fields_are_found_in_a_payload(
    text: str, payload: bytes, expected: list[tuple[str, bytes]]
) -> None:
    found = Layout(text).identifying_spans(payload)
    assert [(field.name, payload[start:end]) for field, start, end in found] == expected


def test_layouts_of_one_text_are_equal() -> None:
    assert Layout("a:u8") == Layout("a:u8") != Layout("a:u16")
    assert len({Layout("a:u8"), Layout("a:u8")}) == 1
    assert repr(Layout("a:u8")) == "Layout('a:u8')"


def test_the_mark_of_a_volatile_field_changes_nothing_else() -> None:
    marked, bare = (
        Layout("id:cstring*4!~ level:u8[%]~ more:u16?"),
        Layout("id:cstring*4! level:u8[%] more:u16?"),
    )
    assert [field.volatile for field in marked.fields] == [True, True, False]
    assert tuple(field._replace(volatile=False) for field in marked.fields) == bare.fields
    assert marked.decode(b"ab\0\0\x57") == bare.decode(b"ab\0\0\x57")
