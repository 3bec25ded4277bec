"""Payload layouts: the format of a payload, written as a line such as ``speed:u8 heading:u16[deg]``.

Fields are separated by spaces. The grammar of a field::

    name:TYPE[/SCALE][{VALUE_NAMES}]["["UNIT"]"][*[COUNT]][?][!][~] level:u8[%]~   frames:u16*   counts:i32*2
    name:const=NUMBER                                               end:const=0

``TYPE`` is one of ``u8 u16 u32 u64 i8 i16 i32 f32 bool bytes cstring uint``. Numbers of several bytes are
big-endian [vendor]. ``bytes`` and ``cstring`` run to the end unless a count gives their width; a ``cstring``
also ends at its first NUL. ``uint`` is one unsigned number over all remaining bytes, eight at most. ``*``
without a count repeats to the end. ``?`` marks an optional field. A field that runs to the end or is optional
must be the last one. ``""`` is an empty payload. ``SCALE`` may have decimals: ``u8/2.55[%]``. ``!`` marks a
field that identifies one robot or its owner: ``mac_address:cstring!``. It is replaced in what is shared.
``~`` marks a volatile field: its value changes by itself, like that of a sensor, a battery or a clock, so a
comparison of two runs leaves it out.

Where robots or firmware versions use several lengths of the same payload, the layout has one variant per
length, separated by ``|``: ``speed:u8 | speed:u16``. A payload is decoded by the first variant that matches
its length, or not at all.
"""

from collections.abc import Callable
from functools import cached_property
from typing import Final, NamedTuple

from sphero_probe.catalogue.payload.fields import UINT_WIDTHS, Field, parse_field, put, take
from sphero_probe.catalogue.payload.numbers import numbers_reader

_new: Final = tuple.__new__  # a NamedTuple's own __new__ costs twice as much

__all__ = ["Decoded", "Field", "Layout", "Span"]


class Decoded(NamedTuple):
    """A decoded payload.

    Attributes:
        fields: field name -> value; only JSON-able values. Empty where the length matches no layout.
        units: field name -> unit, for the fields that are present and have one.
        rest: the bytes that belong to no field: all of them where the length matches no layout.
        problem: what does not match the layout, or empty.
    """

    fields: dict[str, object]
    units: dict[str, str]
    rest: bytes
    problem: str


class Span(NamedTuple):
    """Where a field is in a payload: ``payload[start:end]``, without the NULs that end a text."""

    field: Field
    start: int
    end: int


class Layout:
    """The format of a payload. The text is parsed on first use.

    Attributes:
        text: the line that describes it.
    """

    def __init__(self, text: str) -> None:
        self.text = text

    def __repr__(self) -> str:
        return f"Layout({self.text!r})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Layout) and other.text == self.text

    def __hash__(self) -> int:
        return hash(self.text)

    def __reduce__(self) -> tuple[type["Layout"], tuple[str]]:
        """Pickle the text only: what reads payloads quickly cannot be pickled."""
        return Layout, (self.text,)

    @cached_property
    def variants(self) -> tuple["Layout", ...]:
        """The variants, one per length; the layout itself where there is only one.

        Raises:
            ValueError: a variant is empty.
        """
        texts = self.text.split("|")
        if len(texts) == 1:
            return (self,)
        if not all(text.strip() for text in texts):
            raise ValueError(f"an empty variant in layout {self.text!r}")
        return tuple(Layout(text.strip()) for text in texts)

    @cached_property
    def fields(self) -> tuple[Field, ...]:
        """The fields of the first variant in the order of the wire.

        Raises:
            ValueError: the text does not follow the grammar.
        """
        if self.variants[0] is not self:
            return self.variants[0].fields
        fields = tuple(parse_field(word) for word in self.text.split())
        if len({field.name for field in fields}) != len(fields):
            raise ValueError(f"a field name occurs twice in layout {self.text!r}")
        if any(field.to_end or field.optional for field in fields[:-1]):
            raise ValueError(f"only the last field may run to the end or be left out in layout {self.text!r}")
        return fields

    @cached_property
    def minimum_length(self) -> int:
        """The fewest bytes that fill every field of some variant."""
        if self.variants[0] is not self:
            return min(variant.minimum_length for variant in self.variants)
        return sum(field.least for field in self.fields)

    @cached_property
    def fixed_length(self) -> int | None:
        """The length in bytes, None if it varies."""
        if self.variants[0] is not self:
            lengths = {variant.fixed_length for variant in self.variants}
            return lengths.pop() if len(lengths) == 1 else None
        varies = self.fields and (self.fields[-1].to_end or self.fields[-1].optional)
        return None if varies else self.minimum_length

    def accepts(self, length: int) -> bool:
        """Whether a payload of ``length`` bytes matches this layout, in any of its variants."""
        if self.variants[0] is not self:
            return any(variant.accepts(length) for variant in self.variants)
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
        """Return the shortest payload: zeros, except for constants."""
        if self.variants[0] is not self:
            return min(self.variants, key=lambda variant: variant.minimum_length).zeros()
        return b"".join(bytes([field.const]) if field.const else bytes(field.least) for field in self.fields)

    def decode(self, payload: bytes, *, raw_floats: bool = False) -> Decoded:
        """Decode a payload; no bytes make this raise.

        Args:
            payload: the bytes.
            raw_floats: 32-bit floats may be returned as they are (0.10000000149011612), not as their shortest
                decimals (0.1), for a reader that rounds them to six digits.

        Returns:
            Values are ints, floats (``"nan"``, ``"inf"``, ``"-inf"`` where not finite), bools (the number
            where it is neither 0 nor 1), text, lower-case hex for bytes, names in lower case (the number
            where unlisted), lists of names for flags with the unnamed bits as one number at the end, lists
            of these. A payload whose length matches no variant has no fields: if one byte is missing or
            left over, every field may be misread.
        """
        read = self._readers.get(len(payload)) or self._reader_of(len(payload))
        return read(payload, raw_floats)

    @cached_property
    def _readers(self) -> dict[int, Callable[[bytes, bool], Decoded]]:
        """Length of a payload -> what decodes it; floats as they are, or as their shortest decimals."""
        return {}

    def _reader_of(self, length: int) -> Callable[[bytes, bool], Decoded]:
        variant = next((one for one in self.variants if one.accepts(length)), None)
        read = self._readers[length] = variant.fitting_reader if variant else self._misfit
        return read

    def numbers_of(
        self, length: int, *, raw_floats: bool = False
    ) -> Callable[[bytes], dict[str, object]] | None:
        """Return what reads payloads of this length, if they are nothing but numbers without units.

        It returns the fields as ``decode`` does. None stands for any other payload.
        """
        variant = next((one for one in self.variants if one.accepts(length)), None)
        numbers = numbers_reader(variant.fields) if variant else None
        if numbers is None or numbers.units:
            return None
        return numbers.read_raw if raw_floats else numbers.read

    @cached_property
    def fitting_reader(self) -> Callable[[bytes, bool], Decoded]:
        """What decodes a payload whose length matches this one variant."""
        numbers = numbers_reader(self.fields)
        if numbers is None:
            return self._decode_fields
        read, read_raw, units = numbers

        def decode_numbers(payload: bytes, raw_floats: bool) -> Decoded:
            fields = read_raw(payload) if raw_floats else read(payload)
            return _new(Decoded, (fields, units.copy(), b"", ""))

        return decode_numbers

    def _decode_fields(self, payload: bytes, _raw_floats: bool) -> Decoded:
        values: dict[str, object] = {}
        units: dict[str, str] = {}
        problems: list[str] = []
        at = 0
        for field in self.fields:
            if field.optional and at == len(payload):
                continue
            value, at, problem = take(field, payload, at)
            if problem:
                problems.append(problem)
            if field.const is None or problem:
                values[field.name] = value
                if field.unit:
                    units[field.name] = field.unit
        if at < len(payload):  # after the NUL of a text
            problems.append(f"{_count_bytes(len(payload) - at)} more than the layout has")
        return Decoded(values, units, payload[at:], "; ".join(problems))

    def identifying_spans(self, payload: bytes) -> tuple[Span, ...]:
        """Return where the fields are that identify a robot or its owner, in the order of the wire.

        If the length matches no variant, and some variant has such a field, it is the whole payload.
        """
        marked = [field for variant in self.variants for field in variant.fields if field.identifying]
        if not marked or not payload:
            return ()
        variant = next((one for one in self.variants if one.accepts(len(payload))), None)
        if variant is None:
            return (Span(marked[0], 0, len(payload)),)
        spans: list[Span] = []
        at = 0
        for field in variant.fields:
            start, at = at, len(payload) if field.to_end else min(at + field.size, len(payload))
            end = at
            if field.type == "cstring":
                end = start + len(payload[start:at].rstrip(b"\0"))
            if field.identifying and start < end:
                spans.append(Span(field, start, end))
        return tuple(spans)

    def _misfit(self, payload: bytes, _raw_floats: bool) -> Decoded:
        """Return a payload whose length matches no variant, with the problem."""
        if len(self.variants) > 1:
            known = " or ".join(str(variant.minimum_length) for variant in self.variants)
            problem = f"{_count_bytes(len(payload))}, the known layouts have {known}"
        else:
            problem = self._missing_or_left(len(payload))
        return Decoded({}, {}, payload, problem)

    def _missing_or_left(self, length: int) -> str:
        """Say which field is missing in a payload of a wrong length, or how many bytes are left over."""
        at = 0
        for field in self.fields:
            if field.size > length - at and not (field.optional and at == length):
                return f"short payload: {field.name} needs {_count_bytes(field.size)}, {length - at} left"
            if field.type == "uint":
                at = min(length, at + UINT_WIDTHS[-1])
            elif field.to_end:
                at += (length - at) // field.width * field.width
            else:
                at += field.size
        return f"{_count_bytes(length - at)} more than the layout has"

    def encode(self, values: dict[str, object]) -> bytes:
        """Build a payload from values as ``decode`` returns them; absent fields are zero, empty or left out.

        A ``cstring`` that runs to the end gets a NUL; a ``uint`` takes 1, 2, 4 or 8 bytes. If there are
        several variants, the first one that has all the fields is used.

        Raises:
            ValueError: a field is unknown, or a value does not fit its field.
        """
        if self.variants[0] is not self:
            fitting = (one for one in self.variants if values.keys() <= {field.name for field in one.fields})
            return next(fitting, self.variants[0]).encode(values)
        unknown = values.keys() - {field.name for field in self.fields}
        if unknown:
            raise ValueError(f"no field {', '.join(sorted(unknown))} in layout {self.text!r}")
        return b"".join(put(field, values.get(field.name)) for field in self.fields)


def _count_bytes(count: int) -> str:
    return "1 byte" if count == 1 else f"{count} bytes"
