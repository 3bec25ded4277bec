"""Reads the arguments of a command as people type them: ``speed=64 heading=90deg flags=turbo``."""

import struct
from collections.abc import Sequence
from typing import Final

from sphero_probe.catalogue.payload.enums import VALUE_NAMES
from sphero_probe.catalogue.payload.fields import Field, put
from sphero_probe.catalogue.payload.layout import Layout
from sphero_probe.errors import UsageError, did_you_mean

_SWITCHES: Final = {
    **dict.fromkeys(("true", "yes", "on", "1"), True),
    **dict.fromkeys(("false", "no", "off", "0"), False),
}
_NO_FLAGS: Final = "none"
_NAMES_OF_NO_FLAGS: Final = {"DriveFlags": "forward"}
"""What no flag at all means, where it has a name [spherov2: DriveFlags.FORWARD]."""
_RANGES: Final = {
    "bool": (0, 0xFF),
    "u8": (0, 0xFF),
    "u16": (0, 0xFFFF),
    "u32": (0, 0xFFFF_FFFF),
    "u64": (0, 0xFFFF_FFFF_FFFF_FFFF),
    "uint": (0, 0xFFFF_FFFF_FFFF_FFFF),
    "i8": (-0x80, 0x7F),
    "i16": (-0x8000, 0x7FFF),
    "i32": (-0x8000_0000, 0x7FFF_FFFF),
}


def typed_arguments(layout: Layout, words: Sequence[str], command: str) -> bytes:
    """Return the argument bytes that words stand for.

    The first words may be values in the order of the layout, the others are ``name=value``. A value is a
    number (also followed by the field's unit), a name, ``on`` or ``off``, text, or hex for a field of bytes.
    Flags are joined by ``+``, the elements of a list by commas.

    Args:
        layout: of the command's arguments.
        words: as typed.
        command: its name, for messages.

    Raises:
        UsageError: a field is unknown, missing or given twice, or a value does not fit its field.
    """
    variant = _variant_for(layout, words)
    fields = [field for field in variant.fields if field.const is None]
    if not fields and words:
        raise UsageError(
            f"{command} takes no arguments, got '{words[0]}'", "to send bytes anyway, write 00ff"
        )
    given: dict[str, str] = {}
    for at, word in enumerate(words):
        name, equals, value = word.partition("=")
        if not equals:
            if any("=" in earlier for earlier in words[:at]) or at >= len(fields):
                raise UsageError(f"{command}: '{word}' belongs to no argument", how_to_type(layout, command))
            name, value = fields[at].name, word
        if name not in {field.name for field in fields}:
            known = [field.name for field in fields]
            raise UsageError(f"{command} has no argument '{name}'", did_you_mean(name, known))
        if name in given:
            raise UsageError(f"{command}: {name} is given twice")
        given[name] = value
    missing = [field.name for field in fields if field.name not in given and field.least]
    if missing:
        raise UsageError(f"{command}: {', '.join(missing)} missing", how_to_type(layout, command))
    return b"".join(
        put(field, _value(field, given[field.name]) if field.name in given else None)
        for field in variant.fields
    )


def how_to_type(layout: Layout, command: str) -> str:
    """Return a hint that shows the arguments of a command: ``drive.x speed=0..255 heading=0..65535[deg]``."""
    return " ".join(("write", command, *(f"{field.name}={values_of(field)}" for field in layout.fields)))


def values_of(field: Field) -> str:
    """Return which values a field takes, in a few words."""
    unit = f"[{field.unit}]" if field.unit else ""
    if field.const is not None:
        return str(field.const)
    if field.values:
        names = VALUE_NAMES[field.values]
        return (
            "+".join(names.names.values()) + f", or {_NO_FLAGS}"
            if names.flags
            else "|".join(names.names.values())
        )
    if field.type == "bool":
        return "on|off"
    if field.type in _RANGES:
        low, high = (float(end / field.scale) for end in _RANGES[field.type])
        return f"{low:g}..{high:g}{unit}{',…' * (field.to_end or field.count is not None)}"
    return {"f32": f"NUMBER{unit}", "cstring": "TEXT", "bytes": "HEX"}.get(field.type, field.type)


def example_words(layout: Layout) -> list[str]:
    """Return arguments of a command as words, with the values that are zero on the wire."""
    fields = {field.name: field for field in layout.variants[0].fields}
    return [
        f"{name}={_example(fields[name], value)}"
        for name, value in layout.variants[0].decode(layout.variants[0].zeros()).fields.items()
        if fields[name].const is None
    ]


def _example(field: Field, value: object) -> str:
    if field.values and VALUE_NAMES[field.values].flags:
        return _NO_FLAGS
    match value:
        case bool():
            return "on" if value else "off"
        case list():
            return ",".join(map(str, value))
        case float():
            return f"{value:g}"
    return str(value)


def _variant_for(layout: Layout, words: Sequence[str]) -> Layout:
    """Return the first variant that has all the named fields."""
    named = {word.partition("=")[0] for word in words if "=" in word}
    variants = layout.variants
    return next((one for one in variants if named <= {field.name for field in one.fields}), variants[0])


def _value(field: Field, text: str) -> object:
    """Return a value as ``put`` takes it.

    Raises:
        UsageError: it does not fit.
    """
    many = field.type not in ("bytes", "cstring", "uint") and (field.to_end or field.count is not None)
    parts = [text] if not many else text.split(",") if text else []
    values = [_one(field, part.strip()) for part in parts]
    value = values if many else values[0]
    try:
        put(field, value)
    except (ValueError, struct.error):
        raise UsageError(f"{field.name}: '{text}' does not fit", f"it takes {values_of(field)}") from None
    return value


def _one(field: Field, text: str) -> object:
    if field.type in ("bytes", "cstring"):
        return text
    if field.values:
        return _named(field, text)
    if field.type == "bool":
        return _SWITCHES[text.lower()] if text.lower() in _SWITCHES else _number(field, text)
    return _number(field, text)


def _named(field: Field, text: str) -> object:
    """Return names of the catalogue, or a number."""
    names = VALUE_NAMES[field.values]
    known = list(names.names.values())
    no_flags = (_NO_FLAGS, _NAMES_OF_NO_FLAGS.get(field.values))
    words = text.lower().split("+") if names.flags else [text.lower()]
    values: list[object] = []
    for word in words:
        if names.flags and word in no_flags:
            continue
        if word in known:
            values.append(word)
        elif word[:1].isdigit():
            values.append(int(_number(field, word)))
        else:
            raise UsageError(f"{field.name}: no value '{word}'", did_you_mean(word, known))
    return values if names.flags else values[0]


def _number(field: Field, text: str) -> float:
    """Return a number, with or without the field's unit.

    Raises:
        UsageError: it is none, or out of range.
    """
    digits = text.removesuffix(field.unit).strip() if field.unit else text
    try:
        number = int(digits, 0) if digits[:2].lower() == "0x" else float(digits)
    except ValueError:
        raise UsageError(f"{field.name}: '{text}' is not a number", f"it takes {values_of(field)}") from None
    if field.type in _RANGES:
        low, high = _RANGES[field.type]
        if not low <= number * field.scale <= high:
            raise UsageError(f"{field.name}: {text} is out of range", f"it takes {values_of(field)}")
        if field.scale == 1 and number != int(number):
            raise UsageError(f"{field.name}: {text} is not a whole number", f"it takes {values_of(field)}")
        return int(number) if field.scale == 1 else number
    return number
