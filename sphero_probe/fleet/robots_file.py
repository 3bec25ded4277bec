"""Read and write the file of a fleet: TOML or CSV with the name, address and label of each robot.

The file may come from a stranger: it is bounded, and every value is checked. TOML::

    [[robot]]
    name = "BP-1234"
    address = "AA:BB:CC:DD:EE:01"
    label = "table 3"

CSV has the same three columns, named in its first line. ``label`` may be left out, and one of the other two.
"""

import csv
import io
import json
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Final

from sphero_probe.errors import BadInputFileError, OutputError, UsageError
from sphero_probe.fleet.robots import FleetRobot, check_robots

MAX_BYTES: Final = 1 << 20
MAX_ROBOTS: Final = 1000
MAX_TEXT: Final = 1024
"""Characters of a name, an address or a label."""
KEYS: Final = ("name", "address", "label")
_SUFFIXES: Final = (".toml", ".csv")


def read_robots(path: Path) -> tuple[FleetRobot, ...]:
    """Return the robots of a file.

    Raises:
        BadInputFileError: it cannot be read, or a value is not valid; the message says which.
    """
    text = _text(path)
    try:
        entries = _toml(text) if _suffix(path) == ".toml" else _csv(text)
        robots = tuple(_robot(entry, number) for number, entry in enumerate(entries, 1))
        if len(robots) > MAX_ROBOTS:
            raise BadInputFileError(f"more than {MAX_ROBOTS} robots")  # noqa: TRY301 - one place adds the path
        check_robots(robots)
    except (BadInputFileError, UsageError) as error:
        raise BadInputFileError(f"{path}: {error}", error.hint) from error
    return robots


def check_writable(path: Path) -> None:
    """Check that the suffix is that of a fleet file.

    Raises:
        OutputError: it is another.
    """
    if path.suffix.lower() not in _SUFFIXES:
        raise OutputError(f"cannot write {path}: a fleet file ends in .toml or .csv")


def write_robots(path: Path, robots: Iterable[FleetRobot]) -> None:
    """Write robots as TOML or CSV, as the suffix says.

    Raises:
        OutputError: it cannot be written, or has another suffix.
    """
    check_writable(path)
    text = _as_toml(robots) if _suffix(path) == ".toml" else _as_csv(robots)
    try:
        path.write_text(text, encoding="utf-8", errors="replace", newline="")
    except (OSError, ValueError) as error:
        raise OutputError(f"cannot write {path}: {getattr(error, 'strerror', '') or error}") from error


def _suffix(path: Path) -> str:
    suffix = path.suffix.lower()
    if suffix not in _SUFFIXES:
        raise BadInputFileError("a fleet file ends in .toml or .csv")
    return suffix


def _text(path: Path) -> str:
    try:
        if not path.is_file():
            reason = "not a regular file" if path.exists() else "no such file"
            raise BadInputFileError(f"{path}: {reason}", "to write one: sphero-probe fleet scan --save FILE")
        with path.open("rb") as file:
            raw = file.read(MAX_BYTES + 1)
        if len(raw) > MAX_BYTES:
            raise BadInputFileError(f"{path}: larger than {MAX_BYTES} bytes: not a fleet file")
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise BadInputFileError(f"{path}: not UTF-8 text") from error
    except (OSError, ValueError) as error:
        raise BadInputFileError(f"{path}: {getattr(error, 'strerror', '') or error}") from error


def _toml(text: str) -> list[Mapping[str, object]]:
    try:
        document = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise BadInputFileError(f"not valid TOML: {error}") from error
    entries = document.pop("robot", [])
    if document:
        raise BadInputFileError(f"unknown key {_short(next(iter(document)))}", "each robot is a [[robot]]")
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
        raise BadInputFileError("robot is not a list of tables", "each robot is a [[robot]]")
    return entries


def _csv(text: str) -> list[Mapping[str, object]]:
    try:
        rows = list(csv.DictReader(io.StringIO(text, newline=""), strict=True))
    except csv.Error as error:
        raise BadInputFileError(f"not valid CSV: {error}") from error
    return [{key: value for key, value in row.items() if value or key is None} for row in rows]


def _robot(entry: Mapping[str, object], number: int) -> FleetRobot:
    for key, value in entry.items():
        if key not in KEYS:
            what = "more values than columns" if key is None else f"unknown key {_short(key)}"
            raise BadInputFileError(f"robot {number}: {what}", f"known: {', '.join(KEYS)}")
        if not isinstance(value, str):
            raise BadInputFileError(f"robot {number}: {key} is not text")
        if len(value) > MAX_TEXT:
            raise BadInputFileError(f"robot {number}: {key} has more than {MAX_TEXT} characters")
    name, address, label = (str(entry.get(key, "")).strip() for key in KEYS)
    if not name and not address:
        raise BadInputFileError(f"robot {number}: neither name nor address")
    return FleetRobot(name or address, address or name, label)


def _short(text: str) -> str:
    return repr(text[:40])


def _as_toml(robots: Iterable[FleetRobot]) -> str:
    tables = []
    for robot in robots:
        values = zip(KEYS, robot, strict=True)
        lines = [f"{key} = {_toml_text(value)}" for key, value in values if value]
        tables.append("\n".join(["[[robot]]", *lines, ""]))
    return "\n".join(tables)


def _toml_text(value: str) -> str:
    """Return a TOML string; its escapes are those of JSON, and DEL must be escaped, too [TOML 1.0]."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _as_csv(robots: Iterable[FleetRobot]) -> str:
    out = io.StringIO(newline="")
    writer = csv.writer(out)  # its line ends, CR and LF, make it quote both within a label
    writer.writerow(KEYS)
    writer.writerows(robots)
    return out.getvalue()
