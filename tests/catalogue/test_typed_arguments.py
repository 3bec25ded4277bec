"""Arguments typed by name: against the bytes that spherov2 0.12.1 makes, and against decoding."""

from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from spherov2.commands.connection import Connection
from spherov2.commands.drive import Drive, DriveFlags, RawMotorModes
from spherov2.commands.power import Power
from spherov2.commands.sensor import Sensor
from spherov2.controls.v2 import Packet

from sphero_probe.catalogue import all_rows, row_by_name
from sphero_probe.catalogue.model import CommandRow, Kind
from sphero_probe.catalogue.payload.enums import VALUE_NAMES
from sphero_probe.catalogue.payload.fields import Field
from sphero_probe.catalogue.payload.layout import Layout
from sphero_probe.catalogue.payload.typed import example_words, how_to_type, typed_arguments
from sphero_probe.errors import UsageError
from sphero_probe.protocol.packets import Generation
from tests.support.narrowing import known


def layout_of(name: str) -> Layout:
    return known(known(row_by_name(Generation.V2, name)).request)


def arguments(name: str, words: str) -> bytes:
    return typed_arguments(layout_of(name), words.split(), name)


def spherov2_sends(method: Any, *arguments: object) -> bytes:
    """Return the payload that a command of spherov2 sends."""
    sent: list[Packet] = []
    toy = SimpleNamespace(_require_target=False, _packet_manager=Packet.Manager(), _execute=sent.append)
    method(toy, *arguments)
    return bytes(sent[0]._Packet__data if hasattr(sent[0], "_Packet__data") else sent[0].data)


@pytest.mark.parametrize(
    ("name", "words", "theirs"),
    [
        pytest.param(
            "drive.drive_with_heading",
            "speed=64 heading=90deg flags=backward+turbo",
            (Drive.drive_with_heading, 64, 90, DriveFlags.BACKWARD | DriveFlags.TURBO),
            id="flags-and-unit",
        ),
        pytest.param(
            "drive.drive_with_heading",
            "0x40 350 forward",
            (Drive.drive_with_heading, 64, 350, DriveFlags.FORWARD),
            id="by-place",
        ),
        pytest.param(
            "drive.set_raw_motors",
            "left_mode=reverse left_speed=255 right_mode=forward right_speed=0",
            (Drive.set_raw_motors, RawMotorModes.REVERSE, 255, RawMotorModes.FORWARD, 0),
            id="named-values",
        ),
        pytest.param(
            "power.enable_battery_voltage_state_change_notify",
            "on",
            (Power.enable_battery_voltage_state_change_notify, True),
            id="switch",
        ),
        pytest.param(
            "connection.set_bluetooth_name",
            "name=Astro",
            (Connection.set_bluetooth_name, b"Astro"),
            id="text",
        ),
        pytest.param(
            "sensor.set_sensor_streaming_mask",
            "interval=150ms count=0 sensor_masks=0x0007e000",
            (Sensor.set_sensor_streaming_mask, 150, 0, 0x0007E000),
            id="mask",
        ),
    ],
)
def test_the_bytes_are_those_of_spherov2(name: str, words: str, theirs: tuple[Any, ...]) -> None:
    method, *values = theirs
    assert arguments(name, words) == spherov2_sends(method, *values)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        pytest.param("speed=300 heading=0 flags=0", "speed: 300 is out of range", id="too-large"),
        pytest.param("speed=-1 heading=0 flags=0", "out of range", id="negative"),
        pytest.param("speed=1.5 heading=0 flags=0", "not a whole number", id="fraction"),
        pytest.param("speed=fast heading=0 flags=0", "'fast' is not a number", id="word"),
        pytest.param("speed=nan heading=0 flags=0", "out of range", id="nan"),
        pytest.param("sped=1 heading=0 flags=0", "no argument 'sped'", id="unknown"),
        pytest.param("speed=1 flags=0", "heading missing", id="missing"),
        pytest.param("speed=1 speed=2 heading=0 flags=0", "given twice", id="twice"),
        pytest.param("1 2 forward 4", "'4' belongs to no argument", id="too-many"),
        pytest.param("heading=1 2 forward", "'2' belongs to no argument", id="place-after-name"),
        pytest.param("speed=1 heading=0 flags=trubo", "no value 'trubo'", id="unknown-value"),
        pytest.param("speed=1 heading=0 flags=0x1ff", "out of range", id="flags-too-large"),
    ],
)
def test_wrong_arguments_are_said(words: str, said: str) -> None:
    with pytest.raises(UsageError, match=said):
        arguments("drive.drive_with_heading", words)


def test_a_near_name_is_suggested() -> None:
    with pytest.raises(UsageError) as caught:
        arguments("drive.drive_with_heading", "speed=1 heading=0 flags=trubo")
    assert caught.value.hint == "did you mean 'turbo'?"


ROWS = [
    pytest.param(row, id=f"{row.generation.value} {row.name}")
    for generation in Generation
    for row in all_rows(generation)
    if row.kind is Kind.COMMAND and row.request is not None
]


@pytest.mark.parametrize("row", ROWS)
def test_the_example_of_every_command_is_valid(row: CommandRow) -> None:
    layout = known(row.request)
    typed = typed_arguments(layout, example_words(layout), row.name)
    assert layout.accepts(len(typed))
    assert not layout.decode(typed).problem
    assert how_to_type(layout, row.name).startswith(f"write {row.name}")


def as_typed(field: Field, value: object) -> str:
    """A second way from values to words, without the code under test."""
    if field.values and VALUE_NAMES[field.values].flags and isinstance(value, list):
        return "+".join(map(str, value)) or "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list):
        return ",".join(as_typed(field._replace(values=""), one) for one in value)
    return repr(value) if isinstance(value, float) else str(value)


FIXED = [row.values[0] for row in ROWS]
NUMERIC = [
    row
    for row in FIXED
    if isinstance(row, CommandRow)
    and known(row.request).fixed_length
    and all(field.type not in ("cstring", "const") for field in known(row.request).fields)
]


@given(st.sampled_from(NUMERIC), st.data())
def test_what_was_decoded_can_be_typed_again(row: CommandRow, data: st.DataObject) -> None:
    layout = known(row.request).variants[0]
    length = known(layout.fixed_length)
    payload = data.draw(st.binary(min_size=length, max_size=length))
    decoded = layout.decode(payload)
    fields = {field.name: field for field in layout.fields}
    words = [f"{name}={as_typed(fields[name], value)}" for name, value in decoded.fields.items()]
    if any(word.endswith(("=nan", "=inf", "=-inf")) or "inf," in word or "nan," in word for word in words):
        return
    typed = typed_arguments(layout, words, row.name)
    assert layout.decode(typed).fields == decoded.fields
