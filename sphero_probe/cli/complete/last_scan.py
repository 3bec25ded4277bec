"""Keeps the robots of the last scan in a cache file, so that a shell can complete their names."""

import json
import tempfile
from collections.abc import Iterable
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from sphero_probe.runs.folders import cache_folder

if TYPE_CHECKING:
    from sphero_probe.transports.base import Seen

MAX_ROBOTS: Final = 64
"""The most robots to remember, the strongest first."""
_MAX_BYTES: Final = 16_384
_MAX_WORD: Final = 40
_MAX_MODEL: Final = 32
_PUNCTUATION: Final = "-_."


class Remembered(NamedTuple):
    """A robot of the last scan.

    Attributes:
        name: what to type after ``--device``: its name, or its address if the name needs quoting.
        address: MAC address or an opaque identifier; empty if it needs quoting.
        model: the name of the model; empty for an unknown one.
    """

    name: str
    address: str
    model: str


def cache_file() -> Path | None:
    """Return the file in the cache folder; None if the home folder is not known."""
    try:
        return cache_folder() / "last_scan.json"
    except RuntimeError:
        return None


def remember(seen: Iterable["Seen"]) -> None:
    """Keep the robots of a scan for completion; a failure to write is ignored.

    A scan without robots keeps those of the scan before.

    Args:
        seen: the robots, the strongest first.
    """
    heard = (_fit(robot.name, robot.address, robot.robot.name if robot.robot else "") for robot in seen)
    robots = list(islice(filter(None, heard), MAX_ROBOTS))
    path = cache_file()
    if not robots or path is None:
        return
    with suppress(OSError, ValueError):
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        number, draft = tempfile.mkstemp(dir=path.parent, prefix=".last_scan-")
        try:
            with open(number, "w", encoding="utf-8") as file:  # noqa: PTH123 - a descriptor is no path
                json.dump({"robots": [robot._asdict() for robot in robots]}, file)
            Path(draft).replace(path)
        except BaseException:
            Path(draft).unlink(missing_ok=True)
            raise


def recall() -> list[Remembered]:
    """Return the robots of the last scan, the strongest first; none if no usable file exists."""
    path = cache_file()
    if path is None:
        return []
    try:
        with path.open("rb") as file:
            raw = file.read(_MAX_BYTES + 1)
        kept = json.loads(raw) if len(raw) <= _MAX_BYTES else {}
    except (OSError, ValueError, RecursionError):
        return []
    rows = kept.get("robots") if isinstance(kept, dict) else None
    found = (_fit(row.get("name"), row.get("address"), row.get("model")) for row in _dicts(rows))
    return list(filter(None, found))[:MAX_ROBOTS]


def _dicts(rows: Any) -> list[dict[str, Any]]:
    return [row for row in rows if isinstance(row, dict)] if isinstance(rows, list) else []


def _fit(name: Any, address: Any, model: Any) -> Remembered | None:
    """Return the robot in words that need no quoting in any shell; None if there are none."""
    address = address if _is_word(address, _PUNCTUATION + ":") else ""
    name = name if _is_word(name, _PUNCTUATION) else address
    said = model if isinstance(model, str) and len(model) <= _MAX_MODEL else ""
    return Remembered(name, address, "".join(filter(_is_harmless, said))) if name else None


def _is_word(text: Any, punctuation: str) -> bool:
    """Whether this is ASCII letters, digits and that punctuation, and begins with a letter or digit."""
    return (
        isinstance(text, str)
        and 0 < len(text) <= _MAX_WORD
        and text.isascii()
        and text[0].isalnum()
        and all(sign.isalnum() or sign in punctuation for sign in text)
    )


def _is_harmless(sign: str) -> bool:
    return sign.isascii() and (sign.isalnum() or sign in "-+. ")
