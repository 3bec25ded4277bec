"""Layouts with an optional last field."""

from typing import Any

import pytest

from sphero_probe.catalogue.payload.layout import Layout

COLOUR = Layout("red:u8 green:u8 blue:u8 persist:bool?")
VERSION = Layout("record:u8 api:u8*2?")


def test_both_lengths_are_right() -> None:
    assert [length for length in range(20) if COLOUR.accepts(length)] == [3, 4]
    assert [length for length in range(20) if VERSION.accepts(length)] == [1, 3]
    assert (COLOUR.fixed_length, COLOUR.minimum_length, COLOUR.zeros()) == (None, 3, bytes(3))


@pytest.mark.parametrize(
    ("layout", "payload", "fields"),
    [
        pytest.param(COLOUR, "010203", {"red": 1, "green": 2, "blue": 3}, id="left out"),
        pytest.param(COLOUR, "01020301", {"red": 1, "green": 2, "blue": 3, "persist": True}, id="there"),
        pytest.param(VERSION, "07", {"record": 7}, id="array left out"),
        pytest.param(VERSION, "070102", {"record": 7, "api": [1, 2]}, id="array there"),
    ],
)
def test_decode_and_back(layout: Layout, payload: str, fields: dict[str, Any]) -> None:
    assert layout.decode(bytes.fromhex(payload)) == (fields, {}, b"", "")
    assert layout.encode(fields).hex() == payload


@pytest.mark.parametrize(
    ("layout", "payload", "rest", "problem"),
    [
        pytest.param(COLOUR, "0102", "0102", "short payload: blue needs 1 byte, 0 left", id="too short"),
        pytest.param(COLOUR, "0102030405", "0102030405", "1 byte more than the layout has", id="too long"),
        pytest.param(VERSION, "0701", "0701", "short payload: api needs 2 bytes, 1 left", id="half of it"),
    ],
)
def test_mismatches_are_reported(layout: Layout, payload: str, rest: str, problem: str) -> None:
    decoded = layout.decode(bytes.fromhex(payload))
    assert (decoded.rest.hex(), decoded.problem) == (rest, problem)


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("a:u8? b:u8", id="not the last"),
        pytest.param("a:bytes?", id="runs to the end anyway"),
        pytest.param("a:u16*?", id="repeats to the end anyway"),
        pytest.param("a:uint?", id="uint"),
        pytest.param("a:const=1?", id="constant"),
    ],
)
def test_nonsense_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="layout"):
        Layout(text).fields  # noqa: B018
