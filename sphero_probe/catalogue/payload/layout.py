"""Payload layouts: a line such as ``speed:u8 heading:u16[deg]`` comes in, its meaning for bytes comes out.

The grammar of a field, fields separated by blanks::

    name:TYPE[/SCALE][{VALUE_NAMES}]["["UNIT"]"][*[COUNT]][?]    percentage:u8[%]   frames:u16*   counts:i32*2
    name:const=NUMBER                                            end:const=0

``TYPE`` is one of ``u8 u16 u32 u64 i8 i16 i32 f32 bool bytes cstring uint``. Numbers of several bytes are
big-endian [vendor]. ``bytes`` and ``cstring`` run to the end unless a count gives their width; a ``cstring``
also ends at its first NUL. ``uint`` is one unsigned number over all bytes that are left, eight at most. ``*``
without a count repeats to the end. ``?`` marks a field that may be left out. What runs to the end or may be
left out must be the last field. ``""`` is an empty payload.
"""

from functools import cached_property
from typing import NamedTuple

from sphero_probe.catalogue.payload.fields import UINT_WIDTHS, Field, parse_field, put, take

__all__ = ["Decoded", "Field", "Layout"]


class Decoded(NamedTuple):
    """A payload taken apart.

    Attributes:
        fields: field name -> value; only JSON-able values.
        units: field name -> unit, for the fields that were there and have one.
        rest: the bytes that fit no field.
        problem: what does not fit the layout, empty when all is well.
    """

    fields: dict[str, object]
    units: dict[str, str]
    rest: bytes
    problem: str


class Layout:
    """What the bytes of a payload mean. The text is parsed when something is asked of it for the first time.

    Attributes:
        text: the line it was made from.
    """

    def __init__(self, text: str) -> None:
        self.text = text

    def __repr__(self) -> str:
        return f"Layout({self.text!r})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Layout) and other.text == self.text

    def __hash__(self) -> int:
        return hash(self.text)

    @cached_property
    def fields(self) -> tuple[Field, ...]:
        """The fields in the order of the wire.

        Raises:
            ValueError: the text does not follow the grammar.
        """
        fields = tuple(parse_field(word) for word in self.text.split())
        if len({field.name for field in fields}) != len(fields):
            raise ValueError(f"a field name stands twice in layout {self.text!r}")
        if any(field.to_end or field.optional for field in fields[:-1]):
            raise ValueError(f"only the last field may run to the end or be left out in layout {self.text!r}")
        return fields

    @cached_property
    def minimum_length(self) -> int:
        """The fewest bytes that fill every field."""
        return sum(field.least for field in self.fields)

    @cached_property
    def fixed_length(self) -> int | None:
        """The length in bytes, None when it varies."""
        varies = self.fields and (self.fields[-1].to_end or self.fields[-1].optional)
        return None if varies else self.minimum_length

    def accepts(self, length: int) -> bool:
        """Tell whether a payload of ``length`` bytes can follow this layout."""
        if self.fixed_length is not None:
            return length == self.fixed_length
        last = self.fields[-1]
        surplus = length - self.minimum_length
        if last.optional:
            return surplus in (0, last.size)
        if last.type == "uint":
            return 0 <= surplus < UINT_WIDTHS[-1]
        return surplus >= 0 and surplus % last.width == 0

    def zeros(self) -> bytes:
        """Give the shortest payload, all zero but for constants."""
        return b"".join(bytes([field.const]) if field.const else bytes(field.least) for field in self.fields)

    def decode(self, payload: bytes) -> Decoded:
        """Take a payload apart; whatever the bytes are, this never raises.

        Values are ints, floats (``"nan"``, ``"inf"``, ``"-inf"`` where not finite), bools (the number where
        it is neither 0 nor 1), text, lower-case hex for bytes, names in lower case (the number where
        unlisted), lists of names for flags with the unnamed bits as one number at the end, lists of these.
        """
        values: dict[str, object] = {}
        units: dict[str, str] = {}
        problems: list[str] = []
        at = 0
        for field in self.fields:
            if field.optional and at == len(payload):
                continue
            if field.size > len(payload) - at:
                missing = f"{field.name} needs {_count_bytes(field.size)}, {len(payload) - at} left"
                problems.append(f"short payload: {missing}")
                break
            value, at, problem = take(field, payload, at)
            if problem:
                problems.append(problem)
            if field.const is None or problem:
                values[field.name] = value
                if field.unit:
                    units[field.name] = field.unit
        else:
            if at < len(payload):
                problems.append(f"{_count_bytes(len(payload) - at)} more than the layout has")
        return Decoded(values, units, payload[at:], "; ".join(problems))

    def encode(self, values: dict[str, object]) -> bytes:
        """Build a payload of values as ``decode`` gives them; absent fields are zero, empty or left out.

        A ``cstring`` that runs to the end is closed with a NUL, a ``uint`` takes 1, 2, 4 or 8 bytes.

        Raises:
            ValueError: a field is unknown, or a value does not fit its field.
        """
        unknown = values.keys() - {field.name for field in self.fields}
        if unknown:
            raise ValueError(f"no field {', '.join(sorted(unknown))} in layout {self.text!r}")
        return b"".join(put(field, values.get(field.name)) for field in self.fields)


def _count_bytes(count: int) -> str:
    return "1 byte" if count == 1 else f"{count} bytes"
