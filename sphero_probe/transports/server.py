"""Serve a robot's bytes to another program, through a TCP port or a pseudo-terminal.

``serve_tcp`` and ``serve_pty`` open the robot and give a ``Server``. Its clients come one after another, as a
serial line has one other end. Each client gets a new connection to the same robot.
"""

import asyncio
import os
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager, suppress
from typing import Final

from sphero_probe.catalogue.model import Robot
from sphero_probe.errors import LinkLostError, UnavailableError
from sphero_probe.transports.base import Connection, OpenOptions, Transport
from sphero_probe.transports.registry import DeviceAddress, open_transport
from sphero_probe.transports.serial_address import USUAL

_CHUNK: Final = 4096
_LOOK: Final = 0.02
"""Seconds between two looks whether a program has opened the pseudo-terminal."""

Connect = Callable[[], AbstractAsyncContextManager[Connection]]
"""Opens a new connection to the robot that is served."""


class Server:
    """A robot that other programs can connect to.

    Attributes:
        where: what a program opens, ``/dev/pts/3``, or connects to, ``127.0.0.1:4242``.
        url: the same as serialx takes it.
        served: set once a client has come and gone.
    """

    def __init__(self, connect: Connect, robot: Robot | None, on_step: Callable[[str], None]) -> None:
        self._connect = connect
        self._robot = robot
        self._on_step = on_step
        self._occupied = False
        self.where = self.url = ""
        self.served = asyncio.Event()

    @property
    def device(self) -> str:
        """The address as ``--device`` takes it."""
        robot = self._robot.key if self._robot else USUAL["serial"]
        return f"serial:{self.url}" + (f"?robot={robot}" if robot != USUAL["serial"] else "")

    async def accept(
        self,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        clear: Callable[[], None] = lambda: None,
    ) -> None:
        """Connect a client to the robot until one of the two is gone; send a second one away.

        Args:
            reader: what the client sends.
            writer: to the client.
            clear: throws away what the client did not read, once it is gone.
        """
        if self._occupied:
            self._on_step("sent a second client away: the line is in use")
            writer.close()
            return
        self._occupied = True
        self._on_step("a client has connected")
        try:
            async with self._connect() as connection:
                await _carry(reader, writer, connection.transport)
        finally:
            self._occupied = False
            writer.close()
            clear()
            self._on_step("the client has disconnected")
            self.served.set()


async def _carry(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, robot: Transport) -> None:
    """Carry bytes both ways until one side is gone."""

    async def up() -> None:
        with suppress(OSError, LinkLostError):  # the client or the robot is gone
            while data := await reader.read(_CHUNK):
                await robot.write(data)

    async def down() -> None:
        with suppress(OSError):
            while data := await robot.read():
                writer.write(data)
                await writer.drain()

    ways = [asyncio.create_task(up()), asyncio.create_task(down())]
    try:
        await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for way in ways:
            way.cancel()
        await asyncio.gather(*ways, return_exceptions=True)


@asynccontextmanager
async def serve_tcp(
    address: DeviceAddress, host: str, port: int, on_step: Callable[[str], None] = lambda _: None
) -> AsyncIterator[Server]:
    """Serve a robot at a TCP port.

    Args:
        address: of the robot.
        host: the name or number of the interface to listen on.
        port: 0 for any that is free.
        on_step: told when a client comes and goes.

    Raises:
        UnavailableError: the port is in use, or is not to be had here.
        SpheroProbeError: the robot cannot be opened.
    """
    async with _opened(address, on_step) as server:
        clients: set[asyncio.Task[None]] = set()

        def accept(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            client = asyncio.create_task(server.accept(reader, writer))
            clients.add(client)
            client.add_done_callback(clients.discard)

        try:
            listener = await asyncio.start_server(accept, host, port)
        except OSError as error:
            raise UnavailableError(
                f"cannot listen at {host}:{port}: {os.strerror(error.errno) if error.errno else error}",
                "port 0 takes one that is free",
            ) from error
        name, number = listener.sockets[0].getsockname()[:2]
        server.where = f"[{name}]:{number}" if ":" in name else f"{name}:{number}"
        server.url = f"socket://{server.where}"
        try:
            yield server
        finally:
            listener.close()
            await _end(clients)


@asynccontextmanager
async def serve_pty(
    address: DeviceAddress, on_step: Callable[[str], None] = lambda _: None
) -> AsyncIterator[Server]:
    """Serve a robot behind a pseudo-terminal, which programs open as a serial port.

    Args:
        address: of the robot.
        on_step: told when a client comes and goes.

    Raises:
        UnavailableError: there are no pseudo-terminals here.
        SpheroProbeError: the robot cannot be opened.
    """
    try:
        import pty
        import tty
    except ImportError as error:  # pragma: no cover - Windows
        raise UnavailableError(
            "this system has no pseudo-terminals", "serve with --tcp 127.0.0.1:0"
        ) from error
    async with _opened(address, on_step) as server:
        ours, theirs = pty.openpty()
        tty.setraw(theirs)
        server.where = os.ttyname(theirs)
        server.url = server.where
        os.close(theirs)  # from now on its users are clients, and the system tells when the last one has left
        clients = {asyncio.create_task(_watch_pty(server, ours))}
        try:
            yield server
        finally:
            await _end(clients)
            os.close(ours)


@asynccontextmanager
async def _opened(address: DeviceAddress, on_step: Callable[[str], None]) -> AsyncIterator[Server]:
    """Keep the robot open, so that each client gets the same one."""
    async with open_transport(address, OpenOptions()) as connection:
        again = connection.again
        yield Server(again or (lambda: open_transport(address, OpenOptions())), connection.robot, on_step)


async def _watch_pty(server: Server, ours: int) -> None:
    import termios

    while True:
        while not _is_open(ours):  # noqa: ASYNC110 - no event tells
            await asyncio.sleep(_LOOK)
        async with _streams(ours) as (reader, writer):
            await server.accept(reader, writer, lambda: termios.tcflush(ours, termios.TCIOFLUSH))


def _is_open(ours: int) -> bool:
    """Whether a program has the other end open, or has left bytes there."""
    import select

    poll = select.poll()
    poll.register(ours, select.POLLIN)
    events = dict(poll.poll(0)).get(ours, 0)
    return bool(events & select.POLLIN) or not events & select.POLLHUP


@asynccontextmanager
async def _streams(ours: int) -> AsyncIterator[tuple[asyncio.StreamReader, asyncio.StreamWriter]]:
    """Read and write a pseudo-terminal as streams, which end with an error once its client is gone."""
    loop = asyncio.get_running_loop()
    reader = asyncio.StreamReader()
    source, _ = await loop.connect_read_pipe(
        lambda: asyncio.StreamReaderProtocol(reader), os.fdopen(os.dup(ours), "rb", buffering=0)
    )
    sink, protocol = await loop.connect_write_pipe(
        lambda: asyncio.StreamReaderProtocol(asyncio.StreamReader()),
        os.fdopen(os.dup(ours), "wb", buffering=0),
    )
    writer = asyncio.StreamWriter(sink, protocol, None, loop)
    try:
        yield reader, writer
    finally:
        source.close()
        if sink.get_write_buffer_size() or not sink.is_closing():
            sink.abort()  # what the client did not read would keep it open
        await asyncio.sleep(0)  # both close in the next turn of the loop


async def _end(clients: set["asyncio.Task[None]"]) -> None:
    for client in list(clients):
        client.cancel()
    await asyncio.gather(*clients, return_exceptions=True)
