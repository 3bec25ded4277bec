"""The journal of a run on a worker: it lives in the client's file, and its lines are sent there."""

from collections.abc import Awaitable, Callable
from io import BytesIO
from pathlib import Path
from typing import Self

from sphero_probe.probing.attempt import PreparedProbe
from sphero_probe.runs.interrupted import InterruptedRun
from sphero_probe.runs.journal import Journal
from sphero_probe.runs.resume import RunJournal


def read_lines(lines: bytes, place: str) -> InterruptedRun | None:
    """Return the run whose journal has these lines; None if there are none.

    Args:
        lines: whole lines, from the first.
        place: the path of their file, for messages.

    Raises:
        BadInputFileError: they are not those of a journal.
    """
    return InterruptedRun(BytesIO(lines), Path(place)) if lines else None


class SentJournal(Journal):
    """A journal whose lines are sent elsewhere."""

    def __init__(
        self, place: Path, interrupted: InterruptedRun | None, send: Callable[[bytes], None]
    ) -> None:
        super().__init__(-1, place, interrupted, ours=False)
        self._send = send

    def close(self) -> None:
        """Give up what was read; there is no file here."""
        if self.interrupted:
            self.interrupted.close()

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
        interrupted = read_lines(self._held, self._place)
        self.journal = SentJournal(Path(self._place), interrupted, self._send)
        return self

    async def _announce(self, probe: PreparedProbe) -> None:
        self.intend(probe)
        await self._written()
