"""A device address and consent go in, an open link comes out."""

from collections.abc import AsyncIterator, Awaitable, Callable, Iterable
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass
from time import monotonic

from sphero_probe.catalogue import robot_by_prefix
from sphero_probe.catalogue.gatt_services import list_services
from sphero_probe.catalogue.model import Robot
from sphero_probe.catalogue.risk import Risk
from sphero_probe.cli.output import say
from sphero_probe.errors import LinkLostError, NoAnswerError
from sphero_probe.link.guard import Consent, Guard
from sphero_probe.link.link import Link
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Generation
from sphero_probe.transports.base import Connection, OpenOptions
from sphero_probe.transports.registry import DeviceAddress, open_transport, parse_address
from sphero_probe.transports.serial_address import PORT, USUAL, parse_port


@dataclass(slots=True)
class Session:
    """A robot at the other end of an open link.

    Attributes:
        connection: what is known about the other end.
        link: the conversation; another one after ``reopen``.
        reopen: opens a dropped line to the same robot again.
        tell: shows the name of a step as it begins, if that is wanted.
    """

    connection: Connection
    link: Link
    reopen: Callable[[], Awaitable[Link]]
    tell: Callable[[str], None]


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


def model_behind(address: DeviceAddress) -> Robot | None:
    """Return the robot that an address tells of without touching it, None where it does not.

    Raises:
        UsageError: a ``fake:`` address that makes no sense.
    """
    if address.scheme == "fake":
        from sphero_probe.simulator import parse_settings

        return parse_settings(address.rest).model
    if address.scheme in USUAL:
        return parse_port(address.rest, USUAL[address.scheme]).robot
    return robot_by_prefix(address.rest)


def port_behind(address: DeviceAddress) -> int:
    """Return the port nibble of target addresses on the kind of line that an address names."""
    return PORT if address.scheme in USUAL else 1


def generation_behind(address: DeviceAddress) -> Generation:
    """Return the protocol that an address tells of; V2 where it does not, as most robots speak it.

    Raises:
        UsageError: a ``fake:`` address that makes no sense.
    """
    robot = model_behind(address)
    return robot.generation if robot else Generation.V2


@asynccontextmanager
async def open_session(
    device: str,
    consent: Consent,
    *,
    adapter: str = "",
    connect_timeout: float = 10.0,
    verbose: bool = False,
    timeout: float | None = None,
) -> AsyncIterator[Session]:
    """Connect and start listening; everything is closed on leaving.

    Raises:
        SpheroProbeError: the robot cannot be reached.
    """
    began = monotonic()

    def tell(step: str) -> None:
        if verbose:
            say(f"{monotonic() - began:7.3f} s  {step}")

    options = OpenOptions(connect_timeout, adapter, tell)
    async with AsyncExitStack() as origin, AsyncExitStack() as line:
        connection = await origin.enter_async_context(open_transport(address_of(device), options))
        tell(f"connected to {connection.name}")
        guard = Guard(connection.generation, connection.robot, consent, (connection.name,))

        async def start_link(at: Connection) -> Link:
            codec = CODECS[at.generation]
            return await line.enter_async_context(Link(at.transport, codec, guard, timeout=timeout))

        async def reopen() -> Link:
            """Close what is left of the line, and connect to the very same robot."""
            tell("connect again")
            await line.aclose()
            if connection.again:
                at = await line.enter_async_context(connection.again())
            else:
                await origin.aclose()
                again = open_transport(parse_address(connection.address), options)
                at = await origin.enter_async_context(again)
            if at.name != connection.name:
                raise LinkLostError(f"another robot answers there: {at.name}")
            session.link = await start_link(at)
            return session.link

        session = Session(connection, await start_link(connection), reopen, tell)
        try:
            yield session
        except NoAnswerError as error:
            if not connection.services:
                raise
            has = list_services(connection.services)
            raise NoAnswerError(f"{error}; it has: {has}", error.hint) from error
