"""Every exception of this tool, with its exit code.

::

    SpheroProbeError                1    failure
    ├── UsageError                  2    the command line or an argument is wrong
    ├── RobotNotFoundError          3    no such robot, or several
    ├── ConnectionFailedError       4    could not connect
    │   ├── LastingFailureError     4    could not connect, and a retry would not help
    │   ├── NoAnswerError           4    connected, but the robot never answers
    │   └── LinkLostError           4    the connection was lost
    ├── IncompleteError             5    part of the result is missing
    ├── RefusedByPolicyError        6    consent is missing
    ├── CommandFailedError          7    the command did not succeed
    │   ├── RobotRefusedError       7    the robot rejected it with an error code
    │   └── CommandSilentError      7    the robot answers other commands, but not this one
    ├── BadInputFileError           8    a plan, capture or journal that cannot be used
    │   ├── BadLineError            8    a bad line in a journal; the reader adds file and line number
    │   └── UnreadableCaptureError  8    a capture cannot be read on; what opened it adds the file
    │       └── CutCaptureError     8    a capture ends inside a record
    ├── UnavailableError            9    no Bluetooth, no serial port here
    │   └── NoSuchAdapterError      9    no Bluetooth adapter of that name
    ├── OutputError                 10   standard output or a file cannot be written
    └── InUseError                  11   the journal is in use by another process

    InterruptedRunError             128 + the signal's number; not an error, so not a SpheroProbeError

Faults of a robot are data (``Malformed``, ``Silent``, a finding), never exceptions. One exception is defined
elsewhere: the plan loader's private time limit, a ``BaseException``, so that ``except Exception`` in a plan
does not catch it; it never leaves that module.
"""

from collections.abc import Iterable


class SpheroProbeError(Exception):
    """A failure that this tool can explain in a line or two.

    Attributes:
        exit_code: the exit code of the process if this exception ends it.
        hint: what to do next, or an empty string.
    """

    exit_code = 1

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.hint = hint


class UsageError(SpheroProbeError):
    """The command line, a device address or an argument is wrong."""

    exit_code = 2


class RobotNotFoundError(SpheroProbeError):
    """No robot matches, or more than one does."""

    exit_code = 3


class ConnectionFailedError(SpheroProbeError):
    """The robot was seen, but no connection to it works."""

    exit_code = 4


class LastingFailureError(ConnectionFailedError):
    """Connecting failed for a reason that a retry does not change."""


class NoAnswerError(ConnectionFailedError):
    """The connection works, but the robot never answers."""


class LinkLostError(ConnectionFailedError):
    """The connection was lost."""


class IncompleteError(SpheroProbeError):
    """Part of the result is missing; the rest is shown."""

    exit_code = 5


class RefusedByPolicyError(SpheroProbeError):
    """A command was not sent because its risk class was not allowed."""

    exit_code = 6


class CommandFailedError(SpheroProbeError):
    """The command did not succeed."""

    exit_code = 7


class RobotRefusedError(CommandFailedError):
    """The robot rejected the command with an error code."""


class CommandSilentError(CommandFailedError):
    """The robot did not answer this command, but it answers others."""


class BadInputFileError(SpheroProbeError):
    """A plan, capture or journal cannot be used."""

    exit_code = 8


class BadLineError(BadInputFileError):
    """A line of a journal is not one that this tool writes; the message says why."""


class UnreadableCaptureError(BadInputFileError):
    """A capture cannot be read on from here; the message says why."""


class CutCaptureError(UnreadableCaptureError):
    """A capture ends inside a record."""


class UnavailableError(SpheroProbeError):
    """Bluetooth or the serial port cannot be used on this machine."""

    exit_code = 9


class NoSuchAdapterError(UnavailableError):
    """The requested Bluetooth adapter does not exist.

    Attributes:
        name: the requested adapter.
    """

    def __init__(self, name: str, hint: str = "list the adapters with: bluetoothctl list") -> None:
        super().__init__(f"there is no Bluetooth adapter {name}", hint)
        self.name = name


class OutputError(SpheroProbeError):
    """Standard output or a file cannot be written."""

    exit_code = 10


class InUseError(SpheroProbeError):
    """Another process is writing the journal."""

    exit_code = 11


class InterruptedRunError(Exception):
    """A signal stopped the run cleanly.

    Attributes:
        number: the signal.
        exit_code: the exit code of the process, by the convention of shells.
    """

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number
        self.exit_code = 128 + number


def nearest(word: str, known: Iterable[str], *, count: int = 1, similarity: float = 0.6) -> list[str]:
    """Return the known words that are most similar to a mistyped one.

    Args:
        word: what was typed.
        known: the words that exist.
        count: how many to return at most.
        similarity: how much is enough, 1 for equal words.

    Returns:
        The most similar first; empty if none is similar.
    """
    from difflib import get_close_matches  # noqa: PLC0415 - slow to import, and needed only after a mistake

    return get_close_matches(word, list(known), n=count, cutoff=similarity)


def did_you_mean(word: str, known: Iterable[str], otherwise: str | None = None) -> str:
    """Return the hint for an unknown word: the most similar known one, or a list of all.

    Args:
        word: what was typed.
        known: the words that exist.
        otherwise: the hint if none is similar; None lists all that exist.
    """
    known = list(known)
    for near in nearest(word, known):
        return f"did you mean '{near}'?"
    return f"known: {', '.join(known)}" if otherwise is None else otherwise
