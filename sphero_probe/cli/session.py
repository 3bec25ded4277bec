"""A device address and consent go in, an open link comes out."""

from collections.abc import AsyncIterator, Iterable
from contextlib import asynccontextmanager
from time import monotonic
from typing import NamedTuple

import click

from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.guard import Consent, Guard
from sphero_probe.link.link import Link
from sphero_probe.protocol import CODECS
from sphero_probe.transports.base import Connection, OpenOptions
from sphero_probe.transports.registry import DeviceAddress, open_transport, parse_address


class Session(NamedTuple):
    """A robot at the other end of an open link."""

    connection: Connection
    link: Link


def consent_of(allow: Iterable[str], confirm: str = "", *also: Risk) -> Consent:
    """Return the consent that options and the command itself give."""
    allowed = {Risk.READ, Risk.PROBE, *also} | {Risk[word.upper()] for word in allow}
    return Consent(frozenset(allowed), confirm)


def address_of(device: str) -> DeviceAddress:
    """Return the address to open; an empty one means the only robot nearby.

    Raises:
        UsageError: the address makes no sense.
    """
    return parse_address(device) if device else DeviceAddress("ble", "")


@asynccontextmanager
async def open_session(
    device: str,
    consent: Consent,
    *,
    adapter: str = "",
    connect_timeout: float = 10.0,
    verbose: bool = False,
    timeout: float = 1.0,
) -> AsyncIterator[Session]:
    """Connect and start listening; everything is closed on leaving.

    Raises:
        SpheroProbeError: the robot cannot be reached.
    """
    began = monotonic()

    def tell(step: str) -> None:
        if verbose:
            click.echo(f"{monotonic() - began:7.3f} s  {step}", err=True)

    options = OpenOptions(connect_timeout, adapter, tell)
    async with open_transport(address_of(device), options) as connection:
        tell(f"connected to {connection.name}")
        guard = Guard(connection.generation, connection.robot, consent, (connection.name,))
        async with Link(connection.transport, CODECS[connection.generation], guard, timeout=timeout) as link:
            yield Session(connection, link)
