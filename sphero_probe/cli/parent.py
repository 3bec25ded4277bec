"""Detect that the program which started this one has ended, and that nothing else waits for the result."""

import asyncio
import os
import signal
import sys
from contextlib import suppress
from typing import Final, TextIO

_LOOK: Final = 0.5
"""Seconds between two looks."""


async def parent_gone() -> None:
    """Wait until the program that started this one has ended; never returns where that means nothing.

    It means nothing at a terminal, after ``nohup`` or ``setsid``, while another program reads standard output
    (``… | tee file &``), and on Windows, which does not tell.
    """
    parent = os.getppid()
    while os.name == "nt" or parent == os.getppid() or not _is_abandoned():  # noqa: ASYNC110 - the system tells only those who ask
        await asyncio.sleep(_LOOK)


def _is_abandoned() -> bool:
    """Whether a process that has lost its parent was not meant to outlive it."""
    if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN or os.getsid(0) == os.getpid():
        return False
    return not (_is_terminal(sys.stdin) or _is_terminal(sys.stdout) or _is_read(sys.stdout))


def _is_terminal(stream: TextIO | None) -> bool:
    with suppress(OSError, ValueError):
        return stream is not None and stream.isatty()
    return False


def _is_read(stream: TextIO | None) -> bool:
    """Whether a stream is a pipe with a reader."""
    import select  # noqa: PLC0415 - needed only once the parent is gone
    import stat  # noqa: PLC0415 - likewise

    with suppress(OSError, ValueError, AttributeError):
        if stream is not None and stat.S_ISFIFO(os.fstat(stream.fileno()).st_mode):
            poll = select.poll()
            poll.register(stream, select.POLLOUT)
            return not any(happened & (select.POLLERR | select.POLLHUP) for _, happened in poll.poll(0))
    return False
