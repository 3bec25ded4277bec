"""Read evidence files, which may come from strangers: size, type and range of everything are checked."""

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final, TypeVar

from sphero_probe.catalogue import ROBOTS
from sphero_probe.errors import BadInputFileError, BadLineError
from sphero_probe.json_files import open_regular, parse, why
from sphero_probe.probing.evidence import (
    Asked,
    Burst,
    Ending,
    Evidence,
    Heard,
    Idle,
    MeasuredNode,
    Replaced,
    Topic,
)
from sphero_probe.probing.profiles import Strictness
from sphero_probe.protocol.packets import Command, Generation
from sphero_probe.runs.evidence import DIGEST_BYTES, SCHEMA_VERSION, TYPE
from sphero_probe.runs.fields import Fields
from sphero_probe.transports.registry import SCHEMES

MAX_FILE: Final = 1 << 20
"""Bytes of a file."""
LINES: Final = tuple(dict.fromkeys((*SCHEMES, "replay")))
"""How a robot is reached: the schemes of device addresses."""
_MOST: Final = 1024
"""Entries of a list."""
_BYTES: Final = 1024
"""Bytes of a payload."""
_WORD: Final = 64
_TEXT: Final = 256
_SECONDS: Final = 1e6
_COUNT: Final = 1 << 31
_VERSION: Final = re.compile(r"[0-9]{1,10}(\.[0-9]{1,10}){0,3}", re.ASCII)
_DIGEST: Final = re.compile(rf"[0-9a-f]{{{2 * DIGEST_BYTES}}}", re.ASCII)
_Entry = TypeVar("_Entry")


def read_evidence(path: Path) -> Evidence:
    """Return what an evidence file holds.

    Raises:
        BadInputFileError: it cannot be read, or is no evidence file; the message says why.
    """
    with open_regular(path) as file:
        try:
            text = file.read(MAX_FILE + 1)
        except OSError as error:
            raise BadInputFileError(f"{path}: {why(error)}") from error
    try:
        return decode(text)
    except BadLineError as error:
        raise BadInputFileError(f"{path}: {error}") from error


def decode(text: bytes) -> Evidence:
    """Return the evidence in the text of a file.

    Raises:
        BadLineError: it is too large, or a field is missing, unknown, of a wrong type or out of range.
    """
    if len(text) > MAX_FILE:
        raise BadLineError(f"larger than {MAX_FILE} bytes: not an evidence file")
    data = parse(text)
    if data.get("type") != TYPE:
        raise BadLineError("not an evidence file: its type is not evidence")
    if data.get("schema_version") != SCHEMA_VERSION:
        raise BadLineError(f"an evidence file of another version; this tool reads {SCHEMA_VERSION}")
    fields = _exactly(data, ("type", "schema_version", *Evidence._fields))
    return Evidence(
        tool_version=fields.text("tool_version", _WORD),
        robot=fields.one_of("robot", {"": "", **{key: key for key in ROBOTS}}),
        generation=fields.one_of("generation", {word.value: word for word in Generation}),
        line=fields.one_of("line", {line: line for line in LINES}),
        firmware=_firmware(fields),
        write_size=_optional(data, "write_size", lambda: fields.whole("write_size", 1, _COUNT)),
        chunks=_chunks(fields),
        nodes=_entries(data, "nodes", _node),
        asked=_entries(data, "asked", _decode_asked),
        bursts=_entries(data, "bursts", _burst),
        idle=_optional(data, "idle", lambda: _idle(data["idle"])),
        surprises=_entries(data, "surprises", _surprise),
        complete=fields.flag("complete"),
        frames_sent=fields.whole("frames_sent", 0, _COUNT),
        seconds=_seconds(data, "seconds"),
    )


def _exactly(data: object, keys: Sequence[str]) -> Fields:
    """Return the fields of an object that has these keys and no others."""
    if not isinstance(data, dict):
        raise BadLineError("an entry is not an object")
    if missing := [key for key in keys if key not in data]:
        raise BadLineError(f"{missing[0]} is missing")
    if len(data) > len(keys):
        raise BadLineError("a field that no evidence file has")
    return Fields(data)


def _entries(
    data: dict[str, object], key: str, read: Callable[[object], _Entry], most: int = _MOST
) -> tuple[_Entry, ...]:
    held = data.get(key)
    if not isinstance(held, list) or len(held) > most:
        raise BadLineError(f"{key} is not a list of at most {most} entries")
    entries: list[_Entry] = []
    for number, one in enumerate(held, 1):
        try:
            entries.append(read(one))
        except BadLineError as error:
            raise BadLineError(f"{key}, entry {number}: {error}") from error
    return tuple(entries)


def _optional(data: dict[str, object], key: str, read: Callable[[], _Entry]) -> _Entry | None:
    return None if data.get(key) is None else read()


def _seconds(data: object, key: str) -> float:
    value = data.get(key) if isinstance(data, dict) else data
    if not isinstance(value, int | float) or isinstance(value, bool) or not 0 <= value <= _SECONDS:
        raise BadLineError(f"{key} is not a duration")
    return float(value)


def _firmware(fields: Fields) -> dict[str, str]:
    versions = fields.texts("firmware")
    for node, version in versions.items():
        if len(node) > _WORD or not _VERSION.fullmatch(version):
            raise BadLineError("firmware is not a version for each node")
    return versions


def _chunks(fields: Fields) -> dict[int, int]:
    held = fields.details("chunks")
    if not all(size.isascii() and size.isdecimal() and len(size) < 7 for size in held):
        raise BadLineError("chunks is not a count for each number of bytes")
    counts = fields.counts("chunks", held)
    return {int(size): count for size, count in counts.items()}


def _node(data: object) -> MeasuredNode:
    fields = _exactly(data, MeasuredNode._fields)
    words = {word.value: word.value for word in Strictness}
    return MeasuredNode(
        fields.byte_or_none("target"), fields.one_of("strictness", words), fields.text("why", _TEXT)
    )


def _read_command(fields: Fields) -> Command:
    payload = fields.raw("payload", _BYTES)
    return Command(fields.byte("did"), fields.byte("cid"), payload, fields.byte_or_none("target"))


def _surprise(data: object) -> Command:
    return _read_command(_exactly(data, ("target", "did", "cid", "payload")))


def _decode_asked(data: object) -> Asked:
    fields = _exactly(data, ("target", "did", "cid", "payload", *(set(Asked._fields) - {"command"})))
    held: dict[str, Any] = data if isinstance(data, dict) else {}
    return Asked(
        fields.one_of("topic", {word.value: word for word in Topic}),
        _read_command(fields),
        _optional(held, "flags", lambda: fields.whole("flags", 0, 0xFFFF)),
        fields.one_of("ending", {word.value: word for word in Ending}),
        fields.byte_or_none("code"),
        _replaced(held["data"]) if isinstance(held["data"], dict) else fields.raw("data", _BYTES),
        fields.byte_or_none("source"),
        fields.byte_or_none("client"),
        _optional(held, "milliseconds", lambda: _seconds(held, "milliseconds")),
    )


def _replaced(data: object) -> Replaced:
    fields = _exactly(data, Replaced._fields)
    digest = fields.text("digest", 2 * DIGEST_BYTES)
    if not _DIGEST.fullmatch(digest):
        raise BadLineError("digest is not one")
    return Replaced(fields.whole("length", 1, _BYTES), digest)


def _burst(data: object) -> Burst:
    fields = _exactly(data, Burst._fields)
    held: dict[str, Any] = data if isinstance(data, dict) else {}
    return Burst(
        fields.whole("sent", 1, _MOST),
        fields.whole("answered", 0, _MOST),
        fields.whole("busy", 0, _MOST),
        fields.flag("in_order"),
        _entries(held, "milliseconds", lambda one: _seconds(one, "a round trip")),
    )


def _idle(data: object) -> Idle:
    fields = _exactly(data, Idle._fields)
    held: dict[str, Any] = data if isinstance(data, dict) else {}
    return Idle(
        _seconds(held, "seconds"),
        _entries(held, "heard", _heard),
        fields.flag("dropped"),
        _optional(held, "awake", lambda: fields.flag("awake")),
    )


def _heard(data: object) -> Heard:
    fields = _exactly(data, Heard._fields)
    return Heard(fields.byte_or_none("did"), fields.byte("cid"), _seconds(data, "after"))
