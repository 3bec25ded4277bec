"""One field of a payload, described by text such as ``heading:u16[deg]``: parse, read and write it."""

import re
import struct
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

from sphero_probe.catalogue.payload.enums import VALUE_NAMES
from sphero_probe.catalogue.payload.singles import all_shortest, shortest

if TYPE_CHECKING:
    from collections.abc import Callable

NUMBERS = {
    "u8": struct.Struct(">B"),
    "u16": struct.Struct(">H"),
    "u32": struct.Struct(">I"),
    "u64": struct.Struct(">Q"),
    "i8": struct.Struct(">b"),
    "i16": struct.Struct(">h"),
    "i32": struct.Struct(">i"),
    "f32": struct.Struct(">f"),
    "bool": struct.Struct(">B"),
    "const": struct.Struct(">B"),
}
"""Type -> what packs one number of it."""
UINT_WIDTHS = (1, 2, 4, 8)
"""The lengths in bytes that a ``uint`` can be written in."""
_FIELD = (
    r"(?P<name>[a-z][a-z0-9_]*):(?P<type>[a-z]+[0-9]*)"
    r"(?:=(?P<const>0x[0-9a-f]{1,2}|[0-9]+))?"
    r"(?:/(?P<scale>[1-9][0-9]*(?:\.[0-9]+)?))?"
    r"(?:\{(?P<values>\w+)\})?"
    r"(?:\[(?P<unit>[^\]\s]+)\])?"
    r"(?P<repeat>\*(?P<count>[1-9][0-9]*)?)?"
    r"(?P<optional>\?)?"
    r"(?P<identifying>!)?"
    r"(?P<volatile>~)?"
)


class Field(NamedTuple):
    """One field of a payload.

    Attributes:
        name: unique within its layout.
        type: ``u8``, ``cstring``, …
        scale: the number on the wire is the value times this; exact, because 2.55 has no exact float.
        values: the names of its values in ``enums.VALUE_NAMES``, empty where it has none.
        unit: of the value, empty where it has none.
        count: how often it repeats, or the bytes of ``bytes`` and ``cstring``; None: once, or to the end.
        to_end: takes all bytes that are left.
        const: the one value that is ever sent, None for an ordinary field.
        optional: some robots or firmwares leave it out.
        identifying: it tells one robot from others of its model, or says something about its owner.
        volatile: the value changes by itself, as that of a sensor, a battery or a clock does; two runs of one
            robot differ in it.
    """

    name: str
    type: str
    scale: int | Fraction = 1
    values: str = ""
    unit: str = ""
    count: int | None = None  # type: ignore[assignment]  # hides tuple.count, of no use here
    to_end: bool = False
    const: int | None = None
    optional: bool = False
    identifying: bool = False
    volatile: bool = False

    @property
    def width(self) -> int:
        """Bytes of one element: of one number, or of one byte where the type has no size of its own."""
        number = NUMBERS.get(self.type)
        return number.size if number else 1

    @property
    def size(self) -> int:
        """The fewest bytes it takes where it is present."""
        if self.to_end:
            return 1 if self.type == "uint" else 0
        return self.width * (self.count or 1)

    @property
    def least(self) -> int:
        """The fewest bytes it takes: none where it may be absent."""
        return 0 if self.optional else self.size


def parse_field(word: str) -> Field:
    """Read one word of a layout.

    Raises:
        ValueError: it does not follow the grammar, or contradicts itself.
    """
    found = re.fullmatch(_FIELD, word)
    if found is None:
        raise ValueError(f"{word!r} is not a layout field")
    kind, repeat, count = found["type"], found["repeat"], found["count"]
    blob = kind in ("bytes", "cstring")
    const = None if found["const"] is None else int(found["const"], 0)
    to_end = kind == "uint" or (not count and (blob or bool(repeat)))
    sensible = (
        (blob or kind == "uint" or kind in NUMBERS)
        and (kind == "const") == (const is not None)
        and (const is None or (const <= 0xFF and not repeat))
        and not (blob and (found["scale"] or found["values"] or (repeat and not count)))
        and not (kind == "uint" and repeat)
        and not (found["optional"] and (kind == "const" or to_end))
        and not (found["identifying"] and kind == "const")
        and not (found["volatile"] and kind == "const")
        and not (found["values"] and (found["values"] not in VALUE_NAMES or found["scale"] or kind == "f32"))
    )
    if not sensible:
        raise ValueError(f"{word!r} is not a valid layout field")
    return Field(
        name=found["name"],
        type=kind,
        scale=_scale(found["scale"] or "1"),
        values=found["values"] or "",
        unit=found["unit"] or "",
        count=int(count) if count else None,
        to_end=to_end,
        const=const,
        optional=bool(found["optional"]),
        identifying=bool(found["identifying"]),
        volatile=bool(found["volatile"]),
    )


def _scale(text: str) -> int | Fraction:
    """Read a scale; a whole one stays an int."""
    scale = Fraction(text)
    return int(scale) if scale.denominator == 1 else scale


def take(field: Field, payload: bytes, at: int) -> tuple[object, int, str]:
    """Read one field from a payload that is long enough; return its value, the offset after it, a problem."""
    if field.type == "bytes":
        end = len(payload) if field.count is None else at + field.count
        return payload[at:end].hex(), end, ""
    if field.type == "cstring":
        return _take_text(field, payload, at)
    if field.type == "uint":
        end = min(len(payload), at + UINT_WIDTHS[-1])
        return value_of(field, int.from_bytes(payload[at:end], "big")), end, ""
    number = NUMBERS[field.type]
    if field.const is not None:
        got = payload[at]
        return got, at + 1, "" if got == field.const else f"{field.name} is always {field.const}, here {got}"
    if field.count is None and not field.to_end:
        return value_of(field, number.unpack_from(payload, at)[0]), at + number.size, ""
    end = at + number.size * (field.count if field.count is not None else (len(payload) - at) // number.size)
    if field.type == "f32" and field.scale == 1:
        return all_shortest(payload[at:end]), end, ""
    return [value_of(field, raw) for (raw,) in number.iter_unpack(payload[at:end])], end, ""


def _take_text(field: Field, payload: bytes, at: int) -> tuple[object, int, str]:
    end = len(payload) if field.count is None else at + field.count
    text, nul, behind = payload[at:end].partition(b"\0")
    problem = ""
    if field.count is None:
        end = at + len(text) + len(nul)
    elif behind.strip(b"\0"):
        problem = f"{field.name} continues after its end: {behind.hex()}"
    return text.decode("utf-8", "backslashreplace"), end, problem


def value_of(field: Field, raw: Any) -> object:
    """Convert a number of the wire to the value that people and JSON read."""
    if field.type == "f32":
        return shortest(raw / field.scale)
    if field.scale != 1:
        return float(raw / field.scale)
    if field.values:
        return VALUE_NAMES[field.values].words(raw)
    if field.type == "bool" and raw in (0, 1):
        return bool(raw)
    return raw


def put(field: Field, value: object) -> bytes:
    """Write one field, the opposite of ``take``; None writes zeros, or nothing if the field is optional.

    Raises:
        ValueError: the value does not fit.
    """
    if field.const is not None:
        return bytes([field.const])
    if value is None:
        return bytes(field.least)
    try:
        return _put_value(field, value)
    except (TypeError, ValueError, OverflowError, struct.error) as error:
        raise ValueError(f"{value!r} does not fit field {field.name}:{field.type}") from error


def _put_value(field: Field, value: object) -> bytes:
    if field.type in ("bytes", "cstring"):
        if not isinstance(value, str):
            raise TypeError("not text")
        data = bytes.fromhex(value) if field.type == "bytes" else value.encode()
        if field.type == "cstring" and b"\0" in data:
            raise ValueError("text ends at a NUL")
        if field.count is None:
            return data if field.type == "bytes" else data + b"\0"
        if len(data) > field.count:
            raise ValueError("too long")
        return data.ljust(field.count, b"\0")
    if field.type == "uint":
        whole = _raw(field, value)
        width = next((width for width in UINT_WIDTHS if whole < 1 << 8 * width), UINT_WIDTHS[-1])
        return int(whole).to_bytes(width, "big")
    pack: Callable[[float], bytes] = NUMBERS[field.type].pack
    if field.count is None and not field.to_end:
        return pack(_raw(field, value))
    if not isinstance(value, list) or (field.count is not None and len(value) != field.count):
        raise ValueError("wrong number of elements")
    return b"".join(pack(_raw(field, one)) for one in value)


def _raw(field: Field, value: object) -> float:
    if field.values:
        return VALUE_NAMES[field.values].number(value)
    if field.type == "f32":
        return float(str(value)) * field.scale
    if not isinstance(value, int | float):
        raise TypeError("not a number")
    return round(value * field.scale)
