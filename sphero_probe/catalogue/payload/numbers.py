"""Read a payload of plain numbers with one compiled struct, instead of field by field."""

from collections.abc import Callable
from struct import Struct
from typing import NamedTuple

from sphero_probe.catalogue.payload.fields import NUMBERS, Field, value_of
from sphero_probe.catalogue.payload.singles import all_raw, all_shortest


class NumbersReader(NamedTuple):
    """Reads the payloads of one layout whose length fits it.

    Attributes:
        read: a payload -> field name -> value.
        read_raw: the same, but 32-bit floats as they are instead of their shortest decimals.
        units: field name -> unit, for the fields that have one.
    """

    read: Callable[[bytes], dict[str, object]]
    read_raw: Callable[[bytes], dict[str, object]]
    units: dict[str, str]


def numbers_reader(fields: tuple[Field, ...]) -> NumbersReader | None:
    """Return what reads these fields at once; None if one may be absent or is not a plain number."""
    names = tuple(field.name for field in fields)
    units = {field.name: field.unit for field in fields if field.unit}
    singles = bool(fields) and all(field.type == "f32" and field.scale == 1 for field in fields)
    if len(fields) == 1 and singles and fields[0].to_end:
        (name,) = names
        return NumbersReader(
            lambda payload: {name: all_shortest(payload)}, lambda payload: {name: all_raw(payload)}, units
        )
    if not all(_is_plain(field) for field in fields):
        return None
    if singles:
        return NumbersReader(
            lambda payload: dict(zip(names, all_shortest(payload), strict=True)),
            lambda payload: dict(zip(names, all_raw(payload), strict=True)),
            units,
        )
    unpack = Struct(">" + "".join(NUMBERS[field.type].format[1:] for field in fields)).unpack

    def read(payload: bytes) -> dict[str, object]:
        values = zip(fields, unpack(payload), strict=True)
        return {field.name: value_of(field, raw) for field, raw in values}

    return NumbersReader(read, read, units)


def _is_plain(field: Field) -> bool:
    """Whether a field is one number, always there and of any value."""
    varies = field.optional or field.to_end or field.count is not None or field.const is not None
    return field.type in NUMBERS and not varies
