"""Opens a session with the connect options."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, nullcontext
from time import monotonic

from sphero_probe.cli.capture_out import capturing
from sphero_probe.cli.messages import say
from sphero_probe.cli.shared_connection import SharedConnection
from sphero_probe.cli.values import ConnectOptions
from sphero_probe.errors import LinkLostError, RefusedByPolicyError
from sphero_probe.link.events import Events
from sphero_probe.link.policy import Consent
from sphero_probe.link.unsolicited import follow_streams
from sphero_probe.session.session import Session, open_session
from sphero_probe.transports.base import OpenOptions


@asynccontextmanager
async def connect(
    options: ConnectOptions, consent: Consent, *, timeout: float | None = None
) -> AsyncIterator[Session]:
    """Open a session; ``verbose`` prints each step with its time.

    Args:
        options: which robot, and how to connect.
        consent: what may be sent.
        timeout: seconds until a command counts as silent, None to measure it.

    Raises:
        RefusedByPolicyError: the consent names another robot than this one.
        SpheroProbeError: the robot cannot be reached.
    """
    began = monotonic()

    def on_step(step: str) -> None:
        if options.verbose:
            say(f"{monotonic() - began:7.3f} s  {step}")

    opening = OpenOptions(options.connect_timeout, options.adapter, on_step)
    events = Events()
    shared = SharedConnection.current()
    shared = shared if shared and shared.device == options.device else None
    with capturing(options.capture, options.device, events):
        connection = await shared.connection(opening) if shared else None
        async with open_session(
            options.device,
            consent,
            opening,
            timeout=timeout,
            events=events,
            tolerate=options.tolerate,
            streams=shared.streams if shared else None,
            opened=nullcontext(connection) if connection else None,
        ) as session:
            _check_confirmation(session, consent)
            async with _dropped_if_lost(shared, session):
                # a later command may hear what this one tells the robot to stream
                with follow_streams(session.link) if shared else nullcontext():
                    yield session


@asynccontextmanager
async def _dropped_if_lost(shared: SharedConnection | None, session: Session) -> AsyncIterator[None]:
    """Close a shared connection that was lost or replaced meanwhile; the next command opens another."""
    link, lost = session.link, False
    try:
        yield
    except LinkLostError:
        lost = True
        raise
    finally:
        if shared and (lost or session.link is not link):
            await shared.close()


def _check_confirmation(session: Session, consent: Consent) -> None:
    """Check that the consent names this robot, if it must name one.

    Raises:
        RefusedByPolicyError: it names another robot.
    """
    if session.link.policy.confirmation_fails:
        name = session.connection.name
        raise RefusedByPolicyError(
            f"--confirm {consent.confirmed} names another robot than this one, {name}",
            f"to allow the class brick on this robot, write --confirm {name}",
        )
