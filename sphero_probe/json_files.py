"""Open files that may come from strangers, and read the JSON objects in them."""

import gc
import json
import math
import os
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, Final, NoReturn

from sphero_probe.errors import BadInputFileError, BadLineError

FLAGS: Final = getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
"""Flags to open a file of any kind without waiting."""
MAX_LINE: Final = 1 << 20
"""Bytes of one line, with its end."""
_MAX_ARRAY: Final = 1 << 26
"""Bytes of an array that does not have one object per line: it is parsed at once."""


def open_regular(path: Path | str, hint: str = "", most: int | None = None) -> BinaryIO:
    """Open a file to read it.

    Args:
        path: its name.
        hint: what to do if it cannot be read.
        most: bytes that it may have, None for any number.

    Raises:
        BadInputFileError: it cannot be read, is too large, or is not a regular file.
    """
    try:
        file = os.fdopen(os.open(path, os.O_RDONLY | FLAGS), "rb")
    except (OSError, ValueError) as error:
        raise BadInputFileError(f"cannot read {path}: {why(error)}", hint) from error
    status = os.fstat(file.fileno())
    if stat.S_ISREG(status.st_mode) and (most is None or status.st_size <= most):
        return file
    file.close()
    if stat.S_ISREG(status.st_mode):
        raise BadInputFileError(f"{path}: larger than {most} bytes")
    raise BadInputFileError(f"{path}: not a regular file")


def why(error: OSError | ValueError) -> str:
    """Return the system's message for a file error."""
    return (error.strerror if isinstance(error, OSError) else "") or str(error)


@contextmanager
def without_collector() -> Iterator[None]:
    """Keep the garbage collector off: very many small objects without cycles cost a tenth of the time."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def parse(line: bytes) -> dict[str, object]:
    """Return the JSON object of a line.

    Raises:
        BadLineError: the line is not a JSON object.
    """
    data = _value(line, _decode)
    if not isinstance(data, dict):
        raise BadLineError("not a JSON object")
    return data


class JsonObjects:
    """The objects of a file: one per line, as this tool writes them, or one array of any layout."""

    def __init__(self, file: BinaryIO, path: Path | str, *, lenient: bool = False) -> None:
        """Take an open file.

        Args:
            file: at its start.
            path: its name, for messages.
            lenient: other values than objects are skipped, and half a last line; numbers may be infinite.
        """
        self._file, self._path = file, path
        self._is_lenient = lenient
        self._decode = _decode_any if lenient else _decode
        self._number = 0
        self._is_array = False

    def __iter__(self) -> Iterator[dict[str, object]]:
        """Yield the objects in order.

        Raises:
            BadInputFileError: the file cannot be read, or this is not JSON, or not an object.
        """
        try:
            line = self._read_line()
            if line.strip() == b"[":
                line = self._read_line()
                self._is_array = line[:1] != b"" and not line.rstrip(b",\r\n ").endswith((b"}", b"]"))
            else:
                self._is_array = line.lstrip()[:1] not in (b"{", b"")
            yield from self._in_array() if self._is_array else self._in_lines(line)
        except BadLineError as error:
            raise self.bad(error) from error
        except OSError as error:
            raise BadInputFileError(f"cannot read {self._path}: {why(error)}") from error

    def bad(self, problem: BadLineError, hint: str = "") -> BadInputFileError:
        """Return the error that names the object that was yielded last."""
        place = f": object {self._number}" if self._is_array else f":{self._number}"
        return BadInputFileError(f"{self._path}{place}: {problem}", hint)

    def _read_line(self) -> bytes:
        line = self._file.readline(MAX_LINE + 1)
        self._number += bool(line)
        return line

    def _in_lines(self, line: bytes) -> Iterator[dict[str, object]]:
        while line:
            if len(line) > MAX_LINE:
                raise BadLineError(f"a line of more than {MAX_LINE} bytes")
            text = line.strip().removesuffix(b",")
            if text not in (b"", b"]"):
                try:
                    value = _value(text, self._decode)
                except BadLineError:
                    if self._is_lenient and self._number > 1 and not line.endswith(b"\n"):
                        return
                    raise
                yield from self._object(value)
            line = self._read_line()

    def _in_array(self) -> Iterator[dict[str, object]]:
        self._number = 1
        self._file.seek(0)
        text = self._file.read(_MAX_ARRAY + 1)
        if len(text) > _MAX_ARRAY:
            raise BadLineError(f"more than {_MAX_ARRAY} bytes without a line for each object")
        held = _value(text, self._decode)
        for self._number, value in enumerate(held if isinstance(held, list) else [held], 1):
            yield from self._object(value)

    def _object(self, value: object) -> Iterator[dict[str, object]]:
        if isinstance(value, dict):
            yield value
        elif not self._is_lenient:
            raise BadLineError("not a JSON object")


def _value(text: bytes, decode: Callable[[str], object]) -> object:
    try:
        return decode(text.decode("utf-8", "surrogatepass"))
    except (ValueError, RecursionError) as error:
        raise BadLineError("not valid JSON") from error


def _reject_constant(_: str) -> NoReturn:
    raise ValueError("not a finite number")


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError("not a finite number")
    return value


_decode = json.JSONDecoder(parse_constant=_reject_constant, parse_float=_finite).decode
"""One decoder for all lines: ``json.loads`` would make one for each."""
_decode_any = json.JSONDecoder().decode
