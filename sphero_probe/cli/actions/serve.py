"""``serve``: put a built-in or recorded robot behind a pseudo-terminal or TCP port until it is to stop."""

import asyncio
import os
from contextlib import AbstractAsyncContextManager
from ipaddress import ip_address
from shlex import quote
from typing import Final, NamedTuple

import click

from sphero_probe.cli.messages import say
from sphero_probe.cli.replay_address import with_path
from sphero_probe.cli.signals import Interrupts, run_interruptible
from sphero_probe.errors import UsageError
from sphero_probe.transports.fake_address import on_a_wire
from sphero_probe.transports.registry import DeviceAddress, parse_address
from sphero_probe.transports.server import Server, serve_pty, serve_tcp

_LOOK: Final = 0.5
"""Seconds between two looks whether the calling program still runs."""
_LIKE: Final = "write it like 127.0.0.1:0"


class Endpoint(NamedTuple):
    """Where to listen.

    Attributes:
        host: name or number of an interface.
        port: 0 for any that is free.
    """

    host: str
    port: int


def serve(
    address: str, tcp: str | None, seconds: float | None, *, pty: bool, allow_remote: bool, once: bool
) -> None:
    """Serve a robot.

    Args:
        address: as ``--device`` takes it.
        tcp: the host and port to listen at, None for a pseudo-terminal.
        seconds: to stop after, None for any time.
        pty: a pseudo-terminal was asked for.
        allow_remote: other machines may connect.
        once: stop when the first client has left.

    Raises:
        UsageError: an address that makes no sense, is of a real robot, or that other machines can reach.
        SpheroProbeError: the robot cannot be opened, or the port not be had.
    """
    if pty and tcp is not None:
        raise UsageError("--pty and --tcp exclude each other")
    if allow_remote and tcp is None:
        raise UsageError("--allow-remote is for --tcp")
    robot = _robot(address)
    endpoint = None if tcp is None else parse_endpoint(tcp, allow_remote=allow_remote)
    interrupts = Interrupts()
    stop = asyncio.Event()

    async def work() -> None:
        interrupts.stop_politely(stop)
        async with _serving(robot, endpoint) as server:
            click.echo(server.where)
            say(f"serving {robot}; to try it: sphero-probe info --device {quote(server.device)}")
            await _until_the_end(server, stop, seconds, once=once)

    run_interruptible(interrupts, work())


def parse_endpoint(text: str, *, allow_remote: bool) -> Endpoint:
    """Read ``HOST:PORT``.

    Args:
        text: an IPv6 address stands in brackets.
        allow_remote: take also what other machines can reach.

    Raises:
        UsageError: it is none, or other machines could connect.
    """
    host, colon, number = text.rpartition(":")
    if not (colon and host and number.isascii() and number.isdecimal() and int(number[:6]) <= 0xFFFF):
        raise UsageError(f"--tcp {text}: no host and port", _LIKE)
    host = host.removeprefix("[").removesuffix("]")
    if not (allow_remote or _is_loopback(host)):
        raise UsageError(
            f"--tcp {text}: other machines could connect to that", f"{_LIKE}, or add --allow-remote"
        )
    return Endpoint(host, int(number[:6]))


def _is_loopback(host: str) -> bool:
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _robot(text: str) -> DeviceAddress:
    address = parse_address(with_path(text))
    if address.scheme == "replay":
        return address
    if address.scheme != "fake":
        raise UsageError(f"{text} is no built-in or recorded robot", "serve one: sphero-probe serve fake:rvr")
    return address._replace(rest=on_a_wire(address.rest))


def _serving(robot: DeviceAddress, endpoint: Endpoint | None) -> AbstractAsyncContextManager[Server]:
    return serve_pty(robot, say) if endpoint is None else serve_tcp(robot, *endpoint, say)


async def _until_the_end(server: Server, stop: asyncio.Event, seconds: float | None, *, once: bool) -> None:
    """Wait for the end: the time is up, Ctrl-C, the caller gone, or with ``once`` the client gone."""
    reasons = [asyncio.create_task(stop.wait()), asyncio.create_task(_caller_gone())]
    if once:
        reasons.append(asyncio.create_task(_gone(server)))
    try:
        await asyncio.wait(reasons, timeout=seconds, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for reason in reasons:
            reason.cancel()
        await asyncio.gather(*reasons, return_exceptions=True)


async def _gone(server: Server) -> bool:
    return await server.served.wait()


async def _caller_gone() -> bool:
    """Wait until the program that called this one has ended: its children then get another parent."""
    caller = os.getppid()
    while os.getppid() == caller:  # noqa: ASYNC110 - no event tells
        await asyncio.sleep(_LOOK)
    return True
