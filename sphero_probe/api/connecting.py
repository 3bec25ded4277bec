"""Finds robots and connects to them: ``connect``, ``scan`` and ``discover``."""

from collections.abc import AsyncIterator, Iterable
from contextlib import asynccontextmanager, suppress

from sphero_probe.api.notifications import Dispatcher
from sphero_probe.api.result import Run
from sphero_probe.api.robot import ConnectedRobot
from sphero_probe.api.running import OpenRuns
from sphero_probe.catalogue.naming import choose
from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import LinkLostError
from sphero_probe.link.policy import Consent
from sphero_probe.link.tracker import TOLERANCES
from sphero_probe.probing.oneshot import stop_motors
from sphero_probe.session.session import Session, open_session
from sphero_probe.transports.base import OpenOptions, Seen
from sphero_probe.transports.registry import scan as scan_nearby


@asynccontextmanager
async def connect(
    device: str = "",
    *,
    consent: Consent | Iterable[str] = (),
    timeout: float | None = None,
    connect_timeout: float = 10.0,
    adapter: str = "",
    tolerate: Iterable[str] = (),
) -> AsyncIterator[ConnectedRobot]:
    """Connect to a robot; leaving the block stops its motors, where they were allowed, and disconnects.

    Args:
        device: ``"BP-1234"``, a MAC address, ``"serial:/dev/ttyS0"``, ``"fake:bolt-plus"``,
            ``"replay:run.jsonl"``, as in ``--device`` on the command line; empty for the only robot nearby.
        consent: what may be sent beyond documented reads and harmless probes: risk classes by name,
            ``["write", "motion"]``; or a ``Consent``, which ``brick`` needs with the robot's name.
        timeout: seconds until a command counts as silent; None measures a suitable value.
        connect_timeout: seconds for scanning, and again for each step of connecting.
        adapter: the Bluetooth adapter, ``"hci1"``; empty for the system's choice.
        tolerate: in what an answer may differ and still count: ``"source"`` (it names another node),
            ``"seq"`` (another sequence number), ``"flags"`` (it lacks the response flag).

    Raises:
        UsageError: the address or a risk class makes no sense.
        RobotNotFoundError: no such robot is near, or several are.
        ConnectionFailedError: it could not be connected.
        UnavailableError: no Bluetooth or serial port can be used here.
    """
    options = OpenOptions(connect_timeout, adapter)
    async with (
        open_session(
            device, consent_of(consent), options, timeout=timeout, tolerate=tolerances_of(tolerate)
        ) as session,
        connected(session) as robot,
    ):
        yield robot


@asynccontextmanager
async def connected(session: Session) -> AsyncIterator[ConnectedRobot]:
    """Yield a connected robot for an open session."""
    async with Dispatcher(session) as dispatcher:
        runs = OpenRuns(session, dispatcher)
        try:
            yield ConnectedRobot(session, dispatcher, runs)
        finally:
            await runs.close()
            with suppress(LinkLostError):
                await stop_motors(session.link, session.target)


def consent_of(allowed: Consent | Iterable[str]) -> Consent:
    """Return the default consent, plus the named risk classes.

    Raises:
        UsageError: there is no risk class of that name.
    """
    if isinstance(allowed, Consent):
        return allowed
    words = [allowed] if isinstance(allowed, str) else list(allowed)
    return Consent.of(choose(word, (risk.word for risk in Risk), "risk class") for word in words)


def tolerances_of(words: Iterable[str]) -> tuple[str, ...]:
    """Return the tolerances that were named.

    Raises:
        UsageError: there is none of that name.
    """
    named = [words] if isinstance(words, str) else words
    return tuple(choose(word, TOLERANCES, "tolerance") for word in named)


async def scan(timeout: float = 5.0, *, adapter: str = "", everything: bool = False) -> list[Seen]:
    """Return the robots nearby, the strongest signal first, then those that this machine is connected to.

    Args:
        timeout: seconds.
        adapter: the Bluetooth adapter, ``"hci1"``; empty for the system's choice.
        everything: also devices that are not Sphero robots.

    Raises:
        UnavailableError: no Bluetooth here.
    """
    return await scan_nearby(OpenOptions(timeout, adapter), everything=everything)


async def discover(device: str = "", *, consent: Consent | Iterable[str] = ()) -> Run:
    """Connect, map the whole robot, disconnect; ``ConnectedRobot.discover`` has more choices.

    Args:
        device: the robot's address, as ``connect`` takes it.
        consent: what may be sent, likewise.

    Raises:
        SpheroProbeError: as connecting and running a plan do.
    """
    async with connect(device, consent=consent) as robot:
        return await robot.discover().collect()
