"""Lock a journal, so that only one process writes it at a time."""

import os
import sys
from pathlib import Path
from typing import Final

from sphero_probe.errors import InUseError, OutputError
from sphero_probe.json_files import why

_LOCK_AT: Final = 1 << 40
"""The byte to lock on Windows, which locks bytes, not files; far behind the end of any journal."""
_LOCKS: Final = Path("/proc/locks")
"""The kernel's list of file locks; only Linux has it."""


def lock(descriptor: int, path: Path) -> None:
    """Lock an open file until it is closed.

    Args:
        descriptor: the open file.
        path: its name, for messages.

    Raises:
        InUseError: another process has locked it.
        OutputError: it cannot be locked.
    """
    try:
        if sys.platform == "win32":
            import msvcrt  # noqa: PLC0415 - exists only on Windows

            os.lseek(descriptor, _LOCK_AT, os.SEEK_SET)
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl  # noqa: PLC0415 - does not exist on Windows

            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError) as error:
        pid = holder(descriptor)
        raise InUseError(
            f"{path}: in use by {'another process' if pid is None else f'process {pid}'}",
            "wait until that run has ended, or name another journal",
        ) from error
    except OSError as error:
        raise OutputError(f"cannot write {path}: {why(error)}") from error


def holder(descriptor: int, table: Path = _LOCKS) -> int | None:
    """Return the id of the process that has locked a file; None if the system does not tell.

    Args:
        descriptor: the open file.
        table: the kernel's list, one per line: ``1: FLOCK  ADVISORY  WRITE 1234 fe:01:5678 0 EOF`` with the
            process, and the device and inode of the file [proc_locks(5)].
    """
    status = os.fstat(descriptor)
    try:
        lines = table.read_text(encoding="ascii", errors="replace").splitlines()
        file = f"{os.major(status.st_dev):02x}:{os.minor(status.st_dev):02x}:{status.st_ino}"
    except (OSError, AttributeError):  # os.major does not exist on Windows
        return None
    for line in lines:
        words = line.split()
        # A process of another container is shown as 0 or -1; a process waiting for a lock has "->".
        if words[1:2] == ["FLOCK"] and words[5:6] == [file] and words[4].isdecimal() and int(words[4]):
            return int(words[4])
    return None
