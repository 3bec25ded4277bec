"""Opening a file that may be an Android bug report: a zip or a text with the Bluetooth log inside."""

import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, Final
from zipfile import BadZipFile, ZipFile

from sphero_probe.captures.btsnooz import as_btsnoop, btsnooz_in, is_btsnooz
from sphero_probe.captures.source import Reads
from sphero_probe.captures.text import is_text
from sphero_probe.errors import BadInputFileError, UnreadableCaptureError

_ZIP: Final = b"PK\x03\x04"
_FIRST, _MAX_LINE, _MAX_LOG = 1 << 12, 1 << 16, 1 << 25
_NO_LOG: Final = "turn on the Bluetooth HCI snoop log in Android's developer options, and report again"


@contextmanager
def recording(path: str) -> Iterator[Reads]:
    """Open a file; of an Android bug report, the Bluetooth log in it.

    Raises:
        BadInputFileError: it is a zip without such a log.
        UnreadableCaptureError: the log cannot be read.
        OSError: it cannot be opened.
    """
    with Path(path).open("rb") as file:
        if not file.seekable():
            yield file
            return
        first = file.read(_FIRST)
        file.seek(0)
        if not first.startswith(_ZIP):
            yield _logged(file, first) or file
            return
        try:
            with ZipFile(file) as archive, _member(archive, path) as log:
                yield log
        except (BadZipFile, NotImplementedError, RuntimeError, EOFError, zlib.error) as error:
            raise BadInputFileError(f"{path}: the zip cannot be read: {error}") from error


def _logged(file: BinaryIO, first: bytes) -> Reads | None:
    """Return the btsnooz log that a file is, or that is in its text; None where there is none."""
    if is_btsnooz(first):
        return BytesIO(as_btsnoop(file.read(_MAX_LOG)))
    if not is_text(first.rpartition(b"\n")[0]):
        return None
    log = btsnooz_in(iter(lambda: file.readline(_MAX_LINE), b""))
    file.seek(0)
    return None if log is None else BytesIO(as_btsnoop(log))


@contextmanager
def _member(archive: ZipFile, path: str) -> Iterator[Reads]:
    """Open the log in a bug report: a file of its own, else in the text of the report."""
    members = sorted(archive.infolist(), key=lambda member: -member.file_size)
    for mark in ("btsnoop", "btsnooz"):
        if named := next((member for member in members if mark in member.filename.lower()), None):
            with archive.open(named) as log:
                if mark == "btsnoop":
                    yield _Unzipped(log)
                else:
                    yield BytesIO(as_btsnoop(log.read(_MAX_LOG)))
            return
    for member in members:
        if member.filename.lower().endswith(".txt"):
            with archive.open(member) as text:
                found = btsnooz_in(iter(partial(text.readline, _MAX_LINE), b""))
            if found is not None:
                yield BytesIO(as_btsnoop(found))
                return
    raise BadInputFileError(f"{path}: a zip without a Bluetooth log", _NO_LOG)


class _Unzipped:
    """A member of a zip; damage ends it as the end of any file that is cut."""

    def __init__(self, member: Reads) -> None:
        self._member = member

    def read(self, size: int, /) -> bytes:
        """Return the next bytes.

        Raises:
            UnreadableCaptureError: the zip is damaged here.
        """
        try:
            return self._member.read(size)
        except (BadZipFile, EOFError, zlib.error) as error:
            raise UnreadableCaptureError("the zip is damaged") from error
