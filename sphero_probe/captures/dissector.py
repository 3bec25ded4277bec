"""The Wireshark dissector: the Lua in ``dissector.lua``, with the catalogue written into it.

``dissector`` returns the whole script. Everything that other modules know (constants of the protocols, UUIDs,
rows) is written into the script from there, so it never differs from what the tool itself shows.
"""

from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from typing import Final

from sphero_probe.catalogue.commands import DEVICE_NAMES, all_rows, async_rows
from sphero_probe.catalogue.gatt import PROFILES
from sphero_probe.catalogue.model import CommandRow, Kind
from sphero_probe.catalogue.payload.enums import VALUE_NAMES
from sphero_probe.catalogue.payload.layout import Field, Layout
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Generation, Verdict
from sphero_probe.protocol.v1 import FIXED_PAYLOADS, OPTION_NAMES
from sphero_probe.protocol.v1_frames import MIN_FRAME
from sphero_probe.protocol.v2_decoder import (
    FLAG_ANSWER,
    FLAG_EXTENDED,
    FLAG_NAMES,
    FLAG_ONLY_ERRORS,
    FLAG_RESPONSE,
    FLAG_SOURCE,
    FLAG_TARGET,
    NOTIFICATION_SEQ,
)
from sphero_probe.protocol.v2_frames import MAX_FRAME

_TEMPLATE: Final = "dissector.lua"
_MARK: Final = "--@CATALOGUE@\n"
_PLAIN: Final = range(0x20, 0x7F)
_ESCAPED: Final = b'"\\'


def dissector(version: str) -> str:
    """Return the Lua script.

    Args:
        version: of this tool, for a comment in the script.
    """
    template = files(__package__).joinpath(_TEMPLATE).read_text(encoding="utf-8")
    before, _, after = template.partition(_MARK)
    lines = (
        f"catalogue.version = {quoted(version)}",
        f"catalogue.max_frame = {MAX_FRAME}",
        *_values(),
        *_generation(Generation.V1),
        *_v1(),
        *_generation(Generation.V2),
        *_v2(),
    )
    return before + "".join(f"{line}\n" for line in lines) + after


def quoted(text: str) -> str:
    """Return text as a Lua string; every byte but plain ASCII is written as its number."""
    octets = text.encode("utf-8", "surrogateescape")
    written = "".join(
        chr(octet) if octet in _PLAIN and octet not in _ESCAPED else f"\\{octet:03d}" for octet in octets
    )
    return f'"{written}"'


def _values() -> Iterable[str]:
    yield "catalogue.values = {}"
    for name, values in VALUE_NAMES.items():
        yield (
            f"catalogue.values[{quoted(name)}] = "
            f"{{ flags = {_boolean(values.flags)}, names = {_by_number(values.names)} }}"
        )


def _generation(generation: Generation) -> Iterable[str]:
    home = f"catalogue.{generation}"
    codec = CODECS[generation]
    codes = {
        code: codec.code_name(code) for code in range(256) if codec.verdict(code) is not Verdict.UNLISTED
    }
    profile = next(each for each in PROFILES if each.generation is generation)
    yield f"{home} = {{ commands = {{}}, notifications = {{}}, messages = {{}} }}"
    yield f"{home}.commands_characteristic = {quoted(profile.commands)}"
    yield f"{home}.responses_characteristic = {quoted(profile.answers)}"
    yield f"{home}.devices = {_by_number(DEVICE_NAMES[generation])}"
    yield f"{home}.codes = {_by_number(codes)}"
    for kind, table in ((Kind.COMMAND, "commands"), (Kind.NOTIFICATION, "notifications")):
        pairs: dict[int, list[CommandRow]] = {}
        for row in all_rows(generation):
            if row.kind is kind:
                pairs.setdefault(row.did << 8 | row.cid, []).append(row)
        yield from _rows(f"{home}.{table}", pairs)
    yield from _rows(f"{home}.messages", {row.cid: [row] for row in async_rows(generation)})


def _v1() -> Iterable[str]:
    fixed = (f"[{did << 8 | cid}] = {size}" for (did, cid), size in sorted(FIXED_PAYLOADS.items()))
    yield f"catalogue.v1.flags = {_listed(OPTION_NAMES)}"
    yield f"catalogue.v1.min_frame = {MIN_FRAME}"
    yield f"catalogue.v1.fixed = {_table(fixed)}"


def _v2() -> Iterable[str]:
    numbers = {
        "is_response": FLAG_RESPONSE,
        "requests_response": FLAG_ANSWER,
        "only_errors": FLAG_ONLY_ERRORS,
        "has_target": FLAG_TARGET,
        "has_source": FLAG_SOURCE,
        "extended": FLAG_EXTENDED,
        "notification_seq": NOTIFICATION_SEQ,
    }
    yield f"catalogue.v2.flags = {_listed(FLAG_NAMES)}"
    for name, number in numbers.items():
        yield f"catalogue.v2.{name} = {number}"


def _rows(table: str, pairs: Mapping[int, Sequence[CommandRow]]) -> Iterable[str]:
    """Write a line for each pair; where its meaning differs between robots, all names and layouts."""
    for pair, rows in sorted(pairs.items()):
        names = " / ".join(dict.fromkeys(row.name for row in rows))
        yield (
            f"{table}[{pair:#06x}] = {{ name = {quoted(names)}, "
            f"request = {_layouts(row.request for row in rows)}, "
            f"response = {_layouts(row.response for row in rows)} }}"
        )


def _layouts(layouts: Iterable[Layout | None]) -> str:
    """Write the variants of a pair's layouts, without those that robots read differently at one length."""
    known = [layout for layout in dict.fromkeys(layouts) if layout is not None]
    variants = dict.fromkeys(
        variant
        for layout in known
        for variant in layout.variants
        if all(variant in other.variants or not other.accepts(variant.minimum_length) for other in known)
    )
    return _table(_table(map(_field, variant.fields)) for variant in variants)


def _field(field: Field) -> str:
    values = f"catalogue.values[{quoted(field.values)}]" if field.values else "false"
    return (
        f"{{ {quoted(field.name)}, {quoted(field.type)}, {float(field.scale):g}, {values}, "
        f"{quoted(field.unit)}, size = {field.size}, least = {field.least}, width = {field.width}, "
        f"to_end = {_boolean(field.to_end)}, optional = {_boolean(field.optional)} }}"
    )


def _by_number(names: Mapping[int, str]) -> str:
    return _table(f"[{number}] = {quoted(name)}" for number, name in sorted(names.items()))


def _listed(names: Iterable[str]) -> str:
    return _table(map(quoted, names))


def _table(entries: Iterable[str]) -> str:
    return f"{{ {', '.join(entries)} }}"


def _boolean(value: bool) -> str:
    return "true" if value else "false"
