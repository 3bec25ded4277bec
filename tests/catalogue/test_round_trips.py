"""Round trips of every layout: values to bytes and back, bytes to values and back."""

import json
import struct
from collections.abc import Iterator
from random import Random
from typing import Final, NamedTuple

import pytest

from sphero_probe.catalogue import all_rows, async_rows
from sphero_probe.catalogue.model import CommandRow
from sphero_probe.catalogue.payload.enums import VALUE_NAMES
from sphero_probe.catalogue.payload.layout import Field, Layout
from sphero_probe.protocol.packets import Generation

EXAMPLES: Final = 12
"""Random payloads per layout and direction."""
BOUNDS: Final = {
    "u8": (0, 0xFF),
    "u16": (0, 0xFFFF),
    "u32": (0, 0xFFFF_FFFF),
    "u64": (0, 0xFFFF_FFFF_FFFF_FFFF),
    "i8": (-0x80, 0x7F),
    "i16": (-0x8000, 0x7FFF),
    "i32": (-0x8000_0000, 0x7FFF_FFFF),
    "uint": (0, 0xFFFF_FFFF),
}
SHORTENED: Final = {"cstring", "uint"}
"""Types that can be encoded in more than one way: bytes after a NUL, zeros before a number."""


class Case(NamedTuple):
    row: CommandRow
    side: str
    layout: Layout


def cases(generation: Generation) -> Iterator[Case]:
    for row in all_rows(generation) + async_rows(generation):
        for side, layout in (("request", row.request), ("response", row.response)):
            for variant in layout.variants if layout else ():
                yield Case(row, side, variant)


CASES: Final = [case for generation in Generation for case in cases(generation)]
EACH: Final = pytest.mark.parametrize(
    "case", [pytest.param(case, id=f"{case.row.name} {case.side} {len(case.layout.text)}") for case in CASES]
)


def raw_number(field: Field, chance: Random) -> int:
    low, high = BOUNDS[field.type]
    return chance.choice((low, high, chance.randint(low, high), chance.randint(max(low, -9), 9)))


def example_number(field: Field, chance: Random) -> object:
    if field.values:
        names = VALUE_NAMES[field.values]
        if names.flags:
            return [name for name in names.names.values() if chance.random() < 1 / 2]
        return chance.choice(list(names.names.values()))
    if field.type == "bool":
        return chance.random() < 1 / 2
    if field.type == "f32":
        (value,) = struct.unpack(">f", struct.pack(">f", chance.uniform(-1000, 1000)))
        return float(f"{value:.9g}")
    raw = raw_number(field, chance)
    return raw if field.scale == 1 else float(raw / field.scale)


def example(field: Field, chance: Random) -> object:
    """A value as ``decode`` returns it."""
    length = field.count if field.count is not None else chance.randrange(5)
    if field.type == "bytes":
        return chance.randbytes(length).hex()
    if field.type == "cstring":
        return "".join(chance.choices("abc XYZ-é", k=length // 2))
    if field.count is None and (not field.to_end or field.type == "uint"):
        return example_number(field, chance)
    return [example_number(field, chance) for _ in range(length)]


def test_every_pair_of_the_survey_is_tried() -> None:
    rows = {(case.row.generation, case.row.did, case.row.cid) for case in CASES}
    unknown = {
        (row.generation, row.did, row.cid)
        for generation in Generation
        for row in all_rows(generation)
        if row.request is None and row.response is None
    }
    pairs = {(generation, row.did, row.cid) for generation in Generation for row in all_rows(generation)}
    assert pairs <= rows | unknown
    surveyed = {
        (generation, len({pair for pair in pairs if pair[0] is generation})) for generation in Generation
    }
    assert surveyed == {(Generation.V1, 83 + 10), (Generation.V2, 391 + 2)}


@EACH
def test_values_to_bytes_and_back(case: Case) -> None:
    chance = Random(f"{case.row.name} {case.side} {case.layout.text}")
    for _ in range(EXAMPLES):
        fields = [field for field in case.layout.fields if field.const is None]
        if fields and fields[-1].optional and chance.random() < 1 / 2:
            fields.pop()
        values = {field.name: example(field, chance) for field in fields}
        payload = case.layout.encode(values)
        assert case.layout.accepts(len(payload))
        decoded = case.layout.decode(payload)
        assert (decoded.rest, decoded.problem) == (b"", "")
        assert _alike(decoded.fields, values)
        assert decoded.units == {field.name: field.unit for field in fields if field.unit}
        whole = case.row.request if case.side == "request" else case.row.response
        assert whole is not None
        assert whole.decode(payload).fields or not values


@EACH
def test_bytes_to_values_and_back(case: Case) -> None:
    chance = Random(f"{case.row.name} {case.side} {case.layout.text} bytes")
    least = case.layout.minimum_length
    lengths = [length for length in range(least, least + 90) if case.layout.accepts(length)]
    assert lengths
    for _ in range(EXAMPLES):
        payload = _without_nan(case.layout, chance, chance.choice(lengths))
        decoded = case.layout.decode(payload)
        json.dumps(decoded.fields, allow_nan=False)
        if decoded.problem:  # bytes after the NUL of a text, or another constant
            assert any(field.type in ("cstring", "const") for field in case.layout.fields)
            continue
        again = case.layout.encode(decoded.fields)
        assert _alike(case.layout.decode(again).fields, decoded.fields)
        if not SHORTENED.intersection(field.type for field in case.layout.fields):
            assert again == payload


@EACH
def test_a_length_that_fits_nothing_names_nothing(case: Case) -> None:
    for length in range(90):
        if not case.layout.accepts(length):
            decoded = case.layout.decode(bytes(length))
            assert (decoded.fields, decoded.units, decoded.rest) == ({}, {}, bytes(length))
            assert decoded.problem


def test_samples_are_decoded_and_built_again() -> None:
    samples = [
        (row.request, row.sample) for row in all_rows(Generation.V2) if row.sample is not None and row.request
    ]
    assert len(samples) == 3
    for layout, sample in samples:
        assert layout.encode(layout.decode(sample).fields) == sample


def _without_nan(layout: Layout, chance: Random, length: int) -> bytes:
    """Random bytes, with ASCII text and finite numbers."""
    payload = bytearray(chance.randbytes(length))
    at = 0
    for field in layout.fields:
        end = length if field.to_end else min(length, at + field.size)
        if field.type == "cstring":
            payload[at:end] = bytes(chance.choice(b"abc xyz\0") for _ in range(end - at))
        if field.type == "f32":
            for start in range(at, end, 4):
                payload[start : start + 4] = struct.pack(">f", chance.uniform(-9, 9))
        if field.const is not None:
            payload[at:end] = bytes([field.const])
        at = end
    return bytes(payload)


def _alike(ours: object, theirs: object) -> bool:
    """Whether values are the same, floats with the precision of 32 bits."""
    match ours, theirs:
        case dict(), dict():
            return ours.keys() == theirs.keys() and all(_alike(ours[key], theirs[key]) for key in ours)
        case list(), list():
            return len(ours) == len(theirs) and all(map(_alike, ours, theirs))
        case float(), float():
            return struct.pack(">f", ours) == struct.pack(">f", theirs)
        case _:
            return ours == theirs
