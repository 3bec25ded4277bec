"""Open a session: connect to a device address, identify the model, and start a link that can reconnect."""

from collections.abc import AsyncIterator, Awaitable, Callable, Collection
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager
from dataclasses import dataclass

from sphero_probe.catalogue.gatt_services import list_services
from sphero_probe.catalogue.streams import StreamDecoder
from sphero_probe.errors import LinkLostError, NoAnswerError
from sphero_probe.link.events import Events
from sphero_probe.link.link import Link
from sphero_probe.link.policy import Consent, Policy
from sphero_probe.protocol import CODECS
from sphero_probe.session.addressing import address_of, usual_target
from sphero_probe.session.identity import Identity, difference
from sphero_probe.transports.base import Connection, OpenOptions
from sphero_probe.transports.registry import open_transport, parse_address


@dataclass(slots=True)
class Session:
    """A connected robot and the open link to it.

    Attributes:
        connection: what is known about the robot.
        link: the open link; ``reconnect`` replaces it.
        reconnect: closes a dropped link and opens a new one to the same robot.
        on_step: called with the name of each step as it begins.
    """

    connection: Connection
    link: Link
    reconnect: Callable[[], Awaitable[Link]]
    on_step: Callable[[str], None]

    @property
    def target(self) -> int | None:
        """The address byte of the robot's usual node, None if it takes no addresses."""
        return usual_target(self.connection.robot, self.connection.port)


@asynccontextmanager
async def open_session(
    device: str,
    consent: Consent,
    options: OpenOptions | None = None,
    *,
    timeout: float | None = None,
    tolerate: Collection[str] = (),
    events: Events | None = None,
    streams: StreamDecoder | None = None,
    opened: AbstractAsyncContextManager[Connection] | None = None,
) -> AsyncIterator[Session]:
    """Connect and start listening; leaving the context closes everything.

    Args:
        device: the robot's address; empty for the only robot nearby.
        consent: what may be sent.
        options: how to connect.
        timeout: seconds until a command counts as silent; None measures it.
        tolerate: the fields in which an answer may differ and still count, of ``link.tracker.TOLERANCES``.
        events: where the link tells what happens, for those who listen from its start.
        streams: what the robot was told to stream before; None for a robot that streams nothing yet.
        opened: gives the connection to use; None opens the address.

    Raises:
        SpheroProbeError: the robot cannot be reached.
    """
    options = options or OpenOptions()
    async with AsyncExitStack() as origin, AsyncExitStack() as line:
        connection = await origin.enter_async_context(opened or open_transport(address_of(device), options))
        options.on_step(f"connected to {connection.name}")
        events = events or Events()
        streams = streams or StreamDecoder(connection.generation, connection.robot)
        policy = Policy(connection.generation, connection.robot, consent, (connection.name,))

        async def start_link(at: Connection) -> Link:
            codec = CODECS[at.generation]
            return await line.enter_async_context(
                Link(
                    *(at.transport, codec, policy),
                    timeout=timeout,
                    events=events,
                    tolerate=tolerate,
                    streams=streams,
                )
            )

        async def reconnect() -> Link:
            options.on_step("connect again")
            await line.aclose()
            if connection.again:
                at = await line.enter_async_context(connection.again())
            else:
                await origin.aclose()
                again = open_transport(parse_address(connection.address), options)
                at = await origin.enter_async_context(again)
            if changed := difference(Identity.of(connection), Identity.of(at)):
                raise LinkLostError(f"another robot answers there: {changed}")
            session.link = await start_link(at)
            return session.link

        session = Session(connection, await start_link(connection), reconnect, options.on_step)
        try:
            yield session
        except NoAnswerError as error:
            if not connection.services:
                raise
            has = list_services(connection.services)
            raise NoAnswerError(f"{error}; it has: {has}", error.hint) from error
