"""The journal of a run on a worker: it lives in the client's file, and its lines are sent there."""

from collections.abc import Awaitable, Callable
from pathlib import Path
from tempfile import TemporaryFile
from typing import Self

from sphero_probe.probing.attempt import PreparedProbe
from sphero_probe.runs.journal import Journal
from sphero_probe.runs.reader import Recorded, read_descriptor
from sphero_probe.runs.resume import RunJournal


def read_lines(lines: bytes, place: str) -> Recorded | None:
    """Return what these lines of a journal hold; None if there are none.

    Args:
        lines: whole lines, from the first.
        place: the path of their file, for messages.

    Raises:
        BadInputFileError: they are not those of a journal.
    """
    if not lines:
        return None
    with TemporaryFile() as file:
        file.write(lines)
        file.flush()
        return read_descriptor(file.fileno(), Path(place))


class SentJournal(Journal):
    """A journal whose lines are sent elsewhere."""

    def __init__(self, place: Path, recorded: Recorded | None, send: Callable[[bytes], None]) -> None:
        super().__init__(-1, place, recorded, ours=False)
        self._send = send

    def close(self) -> None:
        """Do nothing: there is no file here."""

    def _write(self, line: bytes) -> None:
        self._send(line)


class SentRunJournal(RunJournal):
    """Keeps the journal of one command in another process.

    Attributes:
        announce: waits until the intent to send a probe is in the file.
    """

    def __init__(
        self,
        command: str,
        place: str,
        held: bytes,
        send: Callable[[bytes], None],
        written: Callable[[], Awaitable[None]],
    ) -> None:
        """Prepare a journal.

        Args:
            command: the command that runs.
            place: the path of the file, for messages.
            held: the lines that the file holds.
            send: takes each new line.
            written: waits until all lines that were sent are in the file.
        """
        super().__init__(command)
        self.announce = self._announce
        self._place, self._held, self._send, self._written = place, held, send, written

    def __enter__(self) -> Self:
        """Read what the file holds.

        Raises:
            BadInputFileError: it is not a journal.
        """
        recorded = read_lines(self._held, self._place)
        self.journal = SentJournal(Path(self._place), recorded, self._send)
        return self

    async def _announce(self, probe: PreparedProbe) -> None:
        self.intend(probe)
        await self._written()
