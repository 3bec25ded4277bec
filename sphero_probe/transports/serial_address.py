"""Read what follows ``serial:`` or ``rfcomm:``: the port, its robot and the rate."""

from typing import Final, NamedTuple
from urllib.parse import parse_qsl

from sphero_probe.catalogue import ROBOTS, robot_by_word
from sphero_probe.catalogue.model import Robot
from sphero_probe.errors import UsageError, did_you_mean

BAUD: Final = 115200
"""Bits per second of an RVR's UART, at 8 data bits, no parity, one stop bit [vendor]."""
PORT: Final = 0
"""The port nibble of addresses on a wire: nodes are 0x01 and 0x02 [real, RVR]."""
USUAL: Final = {"serial": "rvr", "rfcomm": "sphero"}
"""Scheme of an address -> the robot to assume where ``robot=`` names none."""
LIKE: Final = "write a port like /dev/ttyUSB0 or COM3"
"""What to do where an address names no port."""

_SLOWEST, _FASTEST = 50, 10_000_000
_PARAMETERS: Final = ("robot", "baud")


class Port(NamedTuple):
    """An address, read.

    Attributes:
        url: what serialx opens: a path, ``COM3``, ``socket://host:port``.
        robot: the model at the other end.
        baud: bits per second.
    """

    url: str
    robot: Robot
    baud: int


def parse_port(text: str, usual: str) -> Port:
    """Read ``URL?robot=KEY&baud=115200``; what follows the last ``?`` is ours, percent-encoded or plain.

    Args:
        text: the address without its scheme.
        usual: the robot to assume where none is named.

    Raises:
        UsageError: no port, an unknown parameter or robot, a rate that is none.
    """
    url, mark, query = text.rpartition("?")
    if not mark:
        url, query = text, ""
    values: dict[str, str] = {}
    plus_kept = query.replace("+", "%2B")  # parse_qsl would read a plus sign as a blank, as web forms do
    for key, value in parse_qsl(plus_kept, keep_blank_values=True):
        if key not in _PARAMETERS:
            own = " (a query of the URL's own ends with one more '?')" if "://" in url else ""
            raise UsageError(f"unknown serial port parameter '{key}'", did_you_mean(key, _PARAMETERS) + own)
        if key in values:
            raise UsageError(f"serial port parameter '{key}' is given twice")
        values[key] = value
    if not url:
        raise UsageError("no serial port is named", LIKE)
    return Port(url, _robot(values.get("robot", usual)), _baud(values.get("baud", str(BAUD))))


def _robot(word: str) -> Robot:
    robot = robot_by_word(word)
    if robot is None:
        raise UsageError(f"no robot '{word}' in the catalogue", did_you_mean(word.casefold(), ROBOTS))
    return robot


def _baud(text: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 10 and _SLOWEST <= int(text) <= _FASTEST):
        raise UsageError(
            f"baud={text} is no rate", f"write bits per second from {_SLOWEST} to {_FASTEST}, like {BAUD}"
        )
    return int(text)
