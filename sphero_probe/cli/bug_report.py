"""Opening a file that may be an Android bug report: a zip with the Bluetooth log somewhere inside."""

import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final
from zipfile import BadZipFile, ZipFile

from sphero_probe.captures.source import Reads
from sphero_probe.errors import BadInputFileError, UnreadableCaptureError

_ZIP: Final = b"PK\x03\x04"
_NO_LOG: Final = "turn on the Bluetooth HCI snoop log in Android's developer options, and report again"


@contextmanager
def recording(path: str) -> Iterator[Reads]:
    """Open a file; of an Android bug report, the Bluetooth log in it.

    Raises:
        BadInputFileError: it is a zip without such a log.
        OSError: it cannot be opened.
    """
    with Path(path).open("rb") as file:
        if not file.seekable() or file.read(len(_ZIP)) != _ZIP:
            if file.seekable():
                file.seek(0)
            yield file
            return
        try:
            with ZipFile(file) as archive:
                logs = [member for member in archive.infolist() if "btsnoop" in member.filename.lower()]
                if not logs:
                    raise BadInputFileError(f"{path}: a zip without a btsnoop log", _NO_LOG)
                largest = max(logs, key=lambda member: member.file_size)
                with archive.open(largest) as log:
                    yield _Unzipped(log)
        except (BadZipFile, NotImplementedError, RuntimeError) as error:
            raise BadInputFileError(f"{path}: the zip cannot be read: {error}") from error


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
