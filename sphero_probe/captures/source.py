"""A file as the container readers see it: exact reads, a look ahead, the end of the last whole record."""

from typing import Final, Protocol

from sphero_probe.errors import CutCaptureError, UnreadableCaptureError

MAX_RECORD: Final = 1 << 18
"""Bytes of the longest record that is kept; no Bluetooth packet is a quarter as long."""


class Reads(Protocol):
    """A file as far as it is needed here."""

    def read(self, size: int, /) -> bytes:
        """Return at most so many bytes, none at the end."""
        ...


class Source:
    """A binary file, read once from start to end.

    Attributes:
        whole: bytes up to the end of the last whole record.
    """

    def __init__(self, file: Reads, ahead: bytes = b"") -> None:
        """Read from where the file stands; ``ahead`` is what was read of it before."""
        self._read = file.read
        self._some = getattr(file, "read1", file.read)
        self._ahead = ahead
        self._offset = 0
        self.whole = 0

    def peek(self, size: int) -> bytes:
        """Return the next bytes without taking them; fewer at the end."""
        while len(self._ahead) < size and (more := self._read(size - len(self._ahead))):
            self._ahead += more
        return self._ahead[:size]

    def read1(self, size: int) -> bytes:
        """Return the next bytes, whatever is there, for who reads the file as something else."""
        ahead, self._ahead = self._ahead[:size], self._ahead[size:]
        return ahead or self._some(size)

    read = read1

    def more(self) -> bool:
        """Whether anything follows; called between records only."""
        self.whole = self._offset
        return bool(self.peek(1))

    def take(self, size: int) -> bytes:
        """Return exactly so many bytes.

        Raises:
            UnreadableCaptureError: the file ends before, or no record is so long.
        """
        if size > MAX_RECORD:
            raise UnreadableCaptureError(f"a record of {size} bytes")
        taken = self._ahead[:size]
        self._ahead = self._ahead[size:]
        while len(taken) < size:
            more = self._read(size - len(taken))
            if not more:
                raise CutCaptureError("the file ends inside a record")
            taken += more
        self._offset += size
        return taken

    def skip(self, size: int) -> None:
        """Pass over so many bytes.

        Raises:
            CutCaptureError: the file ends before.
        """
        while size:
            piece = min(size, MAX_RECORD)
            self.take(piece)
            size -= piece
