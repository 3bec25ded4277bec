"""Keep the tags of a run in a small file beside its journal, so that the journal itself never changes.

The tags of ``NAME.jsonl`` are in ``NAME.tags``: ASCII text, one tag per line, in order.
"""

import re
import tempfile
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Final

from sphero_probe.errors import OutputError, UsageError
from sphero_probe.json_files import why

SUFFIX: Final = ".tags"
_TAG: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,39}")
_MOST_BYTES: Final = 4096
_MOST_TAGS: Final = 32


def tags_file(journal: Path) -> Path:
    """Return the file that holds the tags of a journal; it may not exist."""
    return journal.with_suffix(SUFFIX)


def check_tag(word: str) -> str:
    """Return a tag.

    Raises:
        UsageError: it is none.
    """
    if not _TAG.fullmatch(word):
        raise UsageError(
            f"'{word}' is not a tag", "a tag has up to 40 letters, digits, dashes, dots and underscores"
        )
    return word


def tags_of(journal: Path) -> tuple[str, ...]:
    """Return the tags of a journal; none where its file cannot be read. Other lines are skipped."""
    try:
        with tags_file(journal).open("rb") as file:
            lines = file.read(_MOST_BYTES).decode("ascii", "replace").split("\n")
    except (OSError, ValueError):
        return ()
    return tuple(sorted({line for line in lines if _TAG.fullmatch(line)}))[:_MOST_TAGS]


def write_tags(journal: Path, tags: Iterable[str]) -> tuple[str, ...]:
    """Replace the tags of a journal, all at once; without tags its file is removed.

    Raises:
        OutputError: they cannot be written, or are too many.
    """
    kept = tuple(sorted(set(tags)))
    if len(kept) > _MOST_TAGS:
        raise OutputError(f"{journal.stem}: more than {_MOST_TAGS} tags")
    path = tags_file(journal)
    try:
        if not kept:
            path.unlink(missing_ok=True)
            return kept
        with tempfile.NamedTemporaryFile(
            "w", encoding="ascii", dir=path.parent, prefix=f".{path.stem}-", delete=False
        ) as draft:
            draft.write("".join(f"{tag}\n" for tag in kept))
        try:
            Path(draft.name).replace(path)
        except OSError:
            with suppress(OSError):
                Path(draft.name).unlink()
            raise
    except OSError as error:
        raise OutputError(f"cannot write {path}: {why(error)}") from error
    return kept
