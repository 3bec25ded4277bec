"""Open a pipe to a robot behind a serial port or URL; the only module that imports serialx."""

import asyncio
import errno
import re
from collections.abc import AsyncIterator
from contextlib import AbstractAsyncContextManager, asynccontextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple, cast

from sphero_probe.errors import (
    ConnectionFailedError,
    LinkLostError,
    RobotNotFoundError,
    SpheroProbeError,
    UnavailableError,
    UsageError,
)
from sphero_probe.transports.base import Connection, OpenOptions
from sphero_probe.transports.serial_address import LIKE, PORT, USUAL, Port, parse_port

if TYPE_CHECKING:
    from serialx import BaseSerialTransport, SerialPortInfo

INSTALL: Final = "pip install 'sphero-probe[serial]'"
"""What brings the library that this transport needs."""
ALLOW: Final = "add your user to the group dialout (Arch: uucp) and log in again"
"""What to do where a port may not be used."""

DEV: Final = Path("/dev")
"""Where bound ports are."""

_DIGITS: Final = re.compile(r"([0-9]+)")
_WRITE_TIMEOUT: Final = 5.0
_CLOSE_TIMEOUT: Final = 5.0
_PLUGGED_IN: Final = "is it still plugged in and switched on?"

_ERRORS: Final[dict[int, tuple[type[SpheroProbeError], str, str]]] = {
    **dict.fromkeys(
        (errno.ENOENT, errno.ENXIO, errno.ENODEV, errno.EIO),
        (
            RobotNotFoundError,
            "there is no serial port {}",
            "is it plugged in (an rfcomm port: bound)? to list them: sphero-probe doctor",
        ),
    ),
    **dict.fromkeys(
        (errno.EACCES, errno.EPERM),
        (
            UnavailableError,
            "not allowed to use {}",
            f"{ALLOW} (Windows: close what else uses the port)",
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
        (UsageError, "{} is no serial port", LIKE),
    ),
    errno.ECONNREFUSED: (
        ConnectionFailedError,
        "nothing listens at {}",
        "is the serial server running there?",
    ),
}
"""What opening a port may fail with -> the error, its message with the port, and what to do."""


class ListedPort(NamedTuple):
    """A serial port of this machine.

    Attributes:
        path: what to open, ``/dev/ttyUSB0`` or ``COM3``.
        description: its own text, empty where it has none; not to be trusted.
    """

    path: str
    description: str


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
            self._heard.put_nowait(data)  # the next read ends, too
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
        """Keep the open port, and have it report every byte that it holds back."""
        self._line = cast("BaseSerialTransport", transport)
        self._line.set_write_buffer_limits(high=0)

    def data_received(self, data: bytes) -> None:
        """Queue bytes of the robot."""
        self._heard.put_nowait(bytes(data))

    def pause_writing(self) -> None:
        """Make writers wait: the system holds bytes back."""
        self._drained.clear()

    def resume_writing(self) -> None:
        """Let writers go on: all bytes have left."""
        self._drained.set()

    def connection_lost(self, _: Exception | None) -> None:
        """End the pipe: the port was unplugged, switched off or closed."""
        self._heard.put_nowait(b"")
        self._drained.set()

    def _open_line(self) -> "BaseSerialTransport":
        """Return the port; once it is closing it would swallow bytes without a word."""
        if self._line is None or self._line.is_closing():
            raise LinkLostError("the serial port is closed", _PLUGGED_IN)
        return self._line


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
    return UsageError(f"serial port {url}: {error}", f"{LIKE}, or socket://HOST:PORT")


def _known() -> tuple[type[Exception], ...]:
    """What opening a port is known to raise; termios exists on POSIX only."""
    from serialx import SerialException

    known: tuple[type[Exception], ...] = (OSError, ValueError, RuntimeError, SerialException)
    try:
        from termios import error as termios_error
    except ImportError:  # pragma: no cover - Windows
        return known
    return (*known, termios_error)


def _not_installed() -> UnavailableError:
    return UnavailableError(
        "serial ports need the library serialx, which is not installed", f"install it: {INSTALL}"
    )


def ports() -> list[ListedPort]:
    """List the serial ports of this machine, those that Bluetooth Classic is bound to as well, by path.

    Returns:
        The ports, none where the machine has none.

    Raises:
        UnavailableError: serialx is not installed, or cannot list ports here.
    """
    try:
        from serialx import list_serial_ports
    except ImportError as error:
        raise _not_installed() from error
    try:
        listed = {port.resolved_device: _described(port) for port in list_serial_ports()}
    except _known() as error:
        raise UnavailableError(
            f"the serial ports cannot be listed: {error}", "name one: --device serial:/dev/ttyUSB0"
        ) from error
    bound = {str(path): "Bluetooth Classic" for path in DEV.glob("rfcomm[0-9]*")}
    return [ListedPort(*port) for port in sorted({**bound, **listed}.items(), key=_by_number)]


def _described(port: "SerialPortInfo") -> str:
    """Return the maker, product and interface of a port, each once; not to be trusted."""
    told = (port.manufacturer, port.product, port.interface_description)
    return " ".join(dict.fromkeys(filter(None, told)))


def _by_number(port: tuple[str, str]) -> list[tuple[bool, int | str]]:
    """Order ``ttyUSB2`` before ``ttyUSB10``."""
    return [(part.isdecimal(), int(part) if part.isdecimal() else part) for part in _DIGITS.split(port[0])]


async def _connect(port: Port, options: OpenOptions) -> SerialTransport:
    """Open the port.

    Raises:
        SpheroProbeError: it cannot be opened; the message says why.
    """
    try:
        from serialx import create_serial_connection
    except ImportError as error:
        raise _not_installed() from error
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
        options: the time for opening, and what to call at each step.
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
