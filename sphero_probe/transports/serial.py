"""A serial port or URL goes in, an open pipe to the robot behind it comes out; the one place with serialx."""

import asyncio
import errno
from collections.abc import AsyncIterator
from contextlib import AbstractAsyncContextManager, asynccontextmanager, suppress
from difflib import get_close_matches
from typing import TYPE_CHECKING, Final, NamedTuple, cast
from urllib.parse import unquote

from sphero_probe.catalogue import ROBOTS, robot_by_word
from sphero_probe.catalogue.model import Robot
from sphero_probe.errors import (
    ConnectionFailedError,
    LinkLostError,
    RobotNotFoundError,
    SpheroProbeError,
    UnavailableError,
    UsageError,
)
from sphero_probe.transports.base import Connection, OpenOptions

if TYPE_CHECKING:
    from serialx import BaseSerialTransport

BAUD: Final = 115200
"""Bits per second of an RVR's UART, at 8 data bits, no parity, one stop bit [vendor]."""
PORT: Final = 0
"""The port nibble of addresses on a wire: nodes are 0x01 and 0x02 [real, RVR]."""
USUAL: Final = {"serial": "rvr", "rfcomm": "sphero"}
"""Scheme of an address -> the robot to assume where ``robot=`` names none."""
INSTALL: Final = "pip install 'sphero-probe[serial]'"
"""What brings the library that this transport needs."""

_WRITE_TIMEOUT: Final = 5.0
_CLOSE_TIMEOUT: Final = 5.0
_SLOWEST, _FASTEST = 50, 10_000_000
_PARAMETERS: Final = ("robot", "baud")
_PLUGGED_IN: Final = "is it still plugged in and switched on?"

_ERRORS: Final[dict[int, tuple[type[SpheroProbeError], str, str]]] = {
    **dict.fromkeys(
        (errno.ENOENT, errno.ENXIO, errno.ENODEV, errno.EIO),
        (
            RobotNotFoundError,
            "there is no serial port {}",
            "is it plugged in (an rfcomm port: bound)? list them: python -m serialx.tools.list_ports",
        ),
    ),
    **dict.fromkeys(
        (errno.EACCES, errno.EPERM),
        (
            UnavailableError,
            "not allowed to use {}",
            "add your user to the group dialout and log in again (Windows: close what else uses the port)",
        ),
    ),
    **dict.fromkeys(
        (errno.EBUSY, errno.EAGAIN),
        (
            ConnectionFailedError,
            "{} is in use by another program",
            "close that one (a terminal program, another sphero-probe) and try again",
        ),
    ),
    **dict.fromkeys(
        (errno.EISDIR, errno.ENOTTY),
        (UsageError, "{} is no serial port", "write a port like /dev/ttyUSB0 or COM3"),
    ),
    errno.ECONNREFUSED: (
        ConnectionFailedError,
        "nobody listens at {}",
        "is the serial server running there?",
    ),
}
"""What opening a port may fail with -> the error, its message with the port, and what to do."""


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


class SerialTransport(asyncio.Protocol):
    """A pipe through a serial port; the callbacks only enqueue."""

    def __init__(self) -> None:
        self._line: BaseSerialTransport | None = None
        self._heard: asyncio.Queue[bytes] = asyncio.Queue()
        self._drained = asyncio.Event()
        self._drained.set()

    async def write(self, data: bytes) -> None:
        """Send bytes and wait until the system has taken them.

        Raises:
            LinkLostError: the robot is gone, or the port takes nothing any more.
        """
        line = self._open_line()
        try:
            line.write(data)
            async with asyncio.timeout(_WRITE_TIMEOUT):
                await self._drained.wait()
        except TimeoutError as error:
            line.abort()  # half a frame must not leave later
            raise LinkLostError("write: the serial port takes no more bytes", _PLUGGED_IN) from error
        except OSError as error:
            raise LinkLostError(
                f"the serial port is gone ({error.strerror or error})", _PLUGGED_IN
            ) from error
        self._open_line()

    async def read(self) -> bytes:
        """Wait for bytes; ``b""`` once the robot is gone."""
        data = await self._heard.get()
        if not data:
            self._heard.put_nowait(data)  # whoever reads again finds it gone, too
        return data

    async def close(self) -> None:
        """Close the port, whatever state it is in."""
        line, self._line = self._line, None
        self.connection_lost(None)
        if line is None:
            return
        with suppress(OSError):  # a time-out is one, too
            async with asyncio.timeout(_CLOSE_TIMEOUT):
                line.abort()  # everything that was written has drained, or it never will
                await line.wait_closed()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Take in that the port is open; let it tell of every byte that it holds back."""
        self._line = cast("BaseSerialTransport", transport)
        self._line.set_write_buffer_limits(high=0)

    def data_received(self, data: bytes) -> None:
        """Take in what the robot sent."""
        self._heard.put_nowait(bytes(data))

    def pause_writing(self) -> None:
        """Take in that the system holds bytes back."""
        self._drained.clear()

    def resume_writing(self) -> None:
        """Take in that all bytes have left."""
        self._drained.set()

    def connection_lost(self, _: Exception | None) -> None:
        """Take in that the port is gone: unplugged, switched off or closed."""
        self._heard.put_nowait(b"")
        self._drained.set()

    def _open_line(self) -> "BaseSerialTransport":
        """Return the port; once it is closing it would swallow bytes without a word."""
        if self._line is None or self._line.is_closing():
            raise LinkLostError("the serial port is closed", _PLUGGED_IN)
        return self._line


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
    for part in query.split("&") if query else ():
        key, _, value = part.partition("=")
        if key not in _PARAMETERS:
            own = " (a query of the URL's own ends with one more '?')" if "://" in url else ""
            raise UsageError(f"unknown serial port parameter '{key}'", _guess(key, _PARAMETERS) + own)
        if key in values:
            raise UsageError(f"serial port parameter '{key}' is given twice")
        values[key] = unquote(value)
    if not url:
        raise UsageError("no serial port is named", "write a port like /dev/ttyUSB0 or COM3")
    return Port(url, _robot(values.get("robot", usual)), _baud(values.get("baud", str(BAUD))))


def _robot(word: str) -> Robot:
    robot = robot_by_word(word)
    if robot is None:
        raise UsageError(f"no robot '{word}' in the catalogue", _guess(word.casefold(), tuple(ROBOTS)))
    return robot


def _baud(text: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 10 and _SLOWEST <= int(text) <= _FASTEST):
        raise UsageError(
            f"baud={text} is no rate", f"write bits per second from {_SLOWEST} to {_FASTEST}, like {BAUD}"
        )
    return int(text)


def _guess(word: str, known: tuple[str, ...]) -> str:
    close = get_close_matches(word, known, n=1)
    return f"did you mean '{close[0]}'?" if close else f"known: {', '.join(known)}"


def _explain(error: Exception, url: str) -> SpheroProbeError:
    """Return the error to show for what opening a port raised."""
    from serialx import SerialException

    if not isinstance(error, OSError) and error.args and isinstance(error.args[0], int):
        error = OSError(*error.args)  # that of termios is none by itself
    if isinstance(error, OSError) and error.errno in _ERRORS:
        kind, said, hint = _ERRORS[error.errno]
        return kind(said.format(url), hint)
    if isinstance(error, TimeoutError):
        return ConnectionFailedError(f"open: {url} does not answer in time", _PLUGGED_IN)
    if isinstance(error, OSError):
        return ConnectionFailedError(f"open: {url}: {error.strerror or error}", _PLUGGED_IN)
    if isinstance(error, RuntimeError) or type(error) is SerialException:
        return ConnectionFailedError(f"open: {url}: {error}", _PLUGGED_IN)
    return UsageError(
        f"serial port {url}: {error}", "write a port like /dev/ttyUSB0, COM3 or socket://HOST:PORT"
    )


def _known() -> tuple[type[Exception], ...]:
    """What opening a port is known to raise; termios exists on POSIX only."""
    from serialx import SerialException

    known: tuple[type[Exception], ...] = (OSError, ValueError, RuntimeError, SerialException)
    try:
        from termios import error as termios_error
    except ImportError:  # pragma: no cover - Windows
        return known
    return (*known, termios_error)


async def _connect(port: Port, options: OpenOptions) -> SerialTransport:
    """Open the port.

    Raises:
        SpheroProbeError: it cannot be opened; the message says why.
    """
    try:
        from serialx import create_serial_connection
    except ImportError as error:
        raise UnavailableError(
            "serial ports need the library serialx, which is not installed", f"install it: {INSTALL}"
        ) from error
    transport = SerialTransport()
    options.on_step("open")
    loop = asyncio.get_running_loop()
    try:
        async with asyncio.timeout(options.timeout):
            await create_serial_connection(loop, lambda: transport, port.url, port.baud)
    except _known() as error:
        raise _explain(error, port.url) from error
    return transport


@asynccontextmanager
async def open_connection(
    rest: str, options: OpenOptions, *, scheme: str = "serial"
) -> AsyncIterator[Connection]:
    """Open ``URL?robot=KEY&baud=115200``: an RVR at a UART, unless another robot is named.

    Args:
        rest: the address without its scheme.
        options: the time for opening, and who is told of it.
        scheme: a key of ``USUAL``.

    Raises:
        UsageError: the address makes no sense, or what it names is no serial port.
        RobotNotFoundError: no such port.
        ConnectionFailedError: the port is busy, or could not be opened for another reason.
        UnavailableError: serialx is not installed, or this user may not use the port.
    """
    port = parse_port(rest, USUAL[scheme])
    transport = await _connect(port, options)
    try:
        yield Connection(transport, port.robot.generation, port.robot, port.url, f"{scheme}:{rest}", PORT)
    finally:
        await transport.close()


def open_rfcomm(rest: str, options: OpenOptions) -> AbstractAsyncContextManager[Connection]:
    """Open a port that Bluetooth Classic is bound to: a classic Sphero, unless another robot is named."""
    return open_connection(rest, options, scheme="rfcomm")
