"""The exception tree: what goes in is a thing that went wrong, what comes out is one line and an exit code.

::

    SpheroProbeError            1    failure
    ├── UsageError              2    the command line makes no sense
    ├── RobotNotFoundError      3    no such robot, or several
    ├── ConnectionFailedError   4    could not connect
    │   ├── NoAnswerError       4    connected, but nothing is answered
    │   └── LinkLostError       4    connected once, not any more
    ├── IncompleteError         5    part of what was asked is missing
    ├── RefusedByPolicyError    6    consent is missing
    ├── RobotRefusedError       7    the robot answered with an error code
    ├── BadInputFileError       8    a plan, capture or journal that cannot be used
    ├── UnavailableError        9    no Bluetooth, no serial port here
    └── OutputError             10   standard output or a file cannot be written

What a robot does wrong is data (``Malformed``, ``Silent``, a finding), never one of these.
"""


class SpheroProbeError(Exception):
    """Anything this tool can explain in a line or two.

    Attributes:
        exit_code: what the process returns when this reaches the top.
        hint: what to do next, or an empty string.
    """

    exit_code = 1

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.hint = hint


class UsageError(SpheroProbeError):
    """The command line, a device address or an argument makes no sense."""

    exit_code = 2


class RobotNotFoundError(SpheroProbeError):
    """No robot matches, or more than one does."""

    exit_code = 3


class ConnectionFailedError(SpheroProbeError):
    """The robot was seen but could not be talked to."""

    exit_code = 4


class NoAnswerError(ConnectionFailedError):
    """The connection stands, but the robot answers nothing at all."""


class LinkLostError(ConnectionFailedError):
    """The connection stood and fell."""


class IncompleteError(SpheroProbeError):
    """Part of what was asked could not be found out; what was found is shown."""

    exit_code = 5


class RefusedByPolicyError(SpheroProbeError):
    """A command was not sent because its risk class was not allowed."""

    exit_code = 6


class RobotRefusedError(SpheroProbeError):
    """The robot answered a command with an error code."""

    exit_code = 7


class BadInputFileError(SpheroProbeError):
    """A plan, capture or journal cannot be used."""

    exit_code = 8


class UnavailableError(SpheroProbeError):
    """Bluetooth or the serial port cannot be used on this machine."""

    exit_code = 9


class OutputError(SpheroProbeError):
    """Standard output or a file cannot be written."""

    exit_code = 10
