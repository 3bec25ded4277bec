"""Checks how a robot is reached, and how well it answers."""

import re
from collections.abc import Callable, Collection
from time import monotonic
from typing import Final

from sphero_probe.catalogue.gatt_services import list_services
from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.errors import SpheroProbeError
from sphero_probe.link.link import Link
from sphero_probe.link.pacing import FIRST_TIMEOUT
from sphero_probe.link.policy import Consent, Policy
from sphero_probe.probing.facts import BATTERY as BATTERY_READS
from sphero_probe.probing.facts import Fact, ask_facts
from sphero_probe.probing.latency import RoundTrips, measure_round_trips
from sphero_probe.protocol import CODECS
from sphero_probe.reports.checks import Look, State, Tell
from sphero_probe.reports.phrases import measured
from sphero_probe.session.addressing import address_of, usual_target
from sphero_probe.session.identify import wake
from sphero_probe.transports.base import Connection, OpenOptions
from sphero_probe.transports.registry import open_transport

_ATT_HEADER: Final = 3
"""Bytes of the MTU that a write does not carry [Bluetooth Core 5.2, Vol 3 Part F, 3.4.5.3]."""
_WORD: Final = re.compile(r"[,:]")
"""Ends the name of a step: ``connect, attempt 2``."""
_UNTOLD: Final = "not reported by the robot"
_WEAK: Final = ("low", "critical")

CONNECTION, SERVICES, WRITES = "connection", "services", "write size"
ROUND_TRIPS, FIRMWARE, BATTERY = "round trips", "firmware", "battery"
_ALL: Final = (CONNECTION, SERVICES, WRITES, ROUND_TRIPS, FIRMWARE, BATTERY)


class Steps:
    """Measures the time of each step of connecting."""

    def __init__(self, on_step: Callable[[str], None]) -> None:
        self._on_step = on_step
        self._began = monotonic()
        self._steps: list[tuple[str, float]] = []

    def begin(self, name: str) -> None:
        """Note that a step begins."""
        self._on_step(name)
        self._steps.append((name, monotonic()))

    def told(self) -> str:
        """Return the total time, and that of each step; repeated attempts are added up."""
        now = monotonic()
        ended = [*(begun for _, begun in self._steps), now][1:]
        spent: dict[str, float] = {}
        for (step, begun), end in zip(self._steps, ended, strict=True):
            name = _WORD.split(step, maxsplit=1)[0]
            spent[name] = spent.get(name, 0.0) + end - begun
        whole = f"{now - self._began:.2f} s"
        each = ", ".join(f"{name} {seconds:.2f} s" for name, seconds in spent.items())
        return f"{whole}: {each}" if each else whole


def skip_robot(tell: Tell, reason: str) -> None:
    """Report every check of a robot as skipped."""
    for name in _ALL:
        tell(name, Look(State.SKIPPED, reason))


async def check_robot(
    tell: Tell, device: str, options: OpenOptions, timeout: float, tolerate: Collection[str] = ()
) -> None:
    """Connect to a robot and measure the link; problems are reported to ``tell``, not raised.

    Args:
        tell: takes each result.
        device: its address.
        options: how to connect.
        timeout: seconds until an echo counts as lost.
        tolerate: in what an answer may differ and still count.
    """
    steps = Steps(options.on_step)
    options = options._replace(on_step=steps.begin)
    waiting = list(_ALL)

    def told(name: str, look: Look) -> None:
        waiting.remove(name)
        tell(name, look)

    try:
        async with open_transport(address_of(device), options) as connection:
            told(CONNECTION, _connection(connection, steps.told()))
            told(SERVICES, _services(connection))
            told(WRITES, _writes(connection))
            await _converse(told, connection, min(timeout, FIRST_TIMEOUT), tolerate)
    except SpheroProbeError as error:
        if not waiting:
            return  # lost after the last check
        if waiting[0] == CONNECTION:
            reason = "not connected"
            fix = error.hint or "for addresses, see: sphero-probe doctor --help"
            look = Look(State.FAIL, f"{error}; gave up after {steps.told()}", fix)
        else:
            reason = "the link was lost"
            look = Look(
                State.FAIL, str(error), error.hint or "move the robot closer, and check that it is charged"
            )
        told(waiting[0], look)
        for name in waiting:
            tell(name, Look(State.SKIPPED, reason))


async def _converse(tell: Tell, connection: Connection, timeout: float, tolerate: Collection[str]) -> None:
    """Run the checks that need an open link.

    Raises:
        LinkLostError: the robot is gone.
    """
    robot = connection.robot
    policy = Policy(connection.generation, robot, Consent(), (connection.name,))
    target = usual_target(robot, connection.port)
    codec = CODECS[connection.generation]
    async with Link(connection.transport, codec, policy, timeout=timeout, tolerate=tolerate) as link:
        await wake(link, target)
        trips = await measure_round_trips(link, target)
        tell(ROUND_TRIPS, _round_trips(trips, timeout))
        if not trips.times:
            for name in (FIRMWARE, BATTERY):
                tell(name, Look(State.SKIPPED, "the robot does not answer"))
            return
        version = row_for(connection.generation, WellKnown.VERSION)
        names = (version.name,) if version else ()
        tell(FIRMWARE, _firmware(await ask_facts(link, robot, connection.port, names)))
        tell(BATTERY, _battery(await ask_facts(link, robot, connection.port, BATTERY_READS)))


def _connection(connection: Connection, taken: str) -> Look:
    model = connection.robot.name if connection.robot else "unknown model"
    return Look(State.OK, f"{connection.name}, {model}, {connection.generation.value}, connected in {taken}")


def _services(connection: Connection) -> Look:
    if not connection.services:
        return Look(State.SKIPPED, "this kind of link has none")
    return Look(State.OK, list_services(connection.services))


def _writes(connection: Connection) -> Look:
    size = connection.write_size
    if size is None:
        return Look(State.OK, "no limit on this kind of link")
    return Look(State.OK, f"{size} bytes (MTU {size + _ATT_HEADER})")


def _round_trips(trips: RoundTrips, timeout: float) -> Look:
    if not trips.sent:
        return Look(State.SKIPPED, "no echo is known for this robot")
    if not trips.times:
        seen = f"none of {trips.sent} echoes came back within {timeout:g} s"
        return Look(State.FAIL, seen, "wake the robot (shake it, or take it off the charger) and try again")
    seen = (
        f"median {trips.median * 1000:.1f} ms, p95 {trips.p95 * 1000:.1f} ms, "
        f"{len(trips.times)} of {trips.sent} echoes came back"
    )
    if trips.lost:
        return Look(State.WARN, seen, "move the robot closer; other 2.4 GHz radios interfere")
    if trips.p95 > timeout / 2:
        return Look(
            State.WARN, seen, "slow: move the robot closer, and close other programs that use Bluetooth"
        )
    return Look(State.OK, seen)


def _firmware(facts: list[Fact]) -> Look:
    """Report the first fact of each node, its version; ``info`` has the others."""
    versions: dict[object, object] = {}
    for fact in facts:
        versions.setdefault(fact.node, fact.value)
    if not versions:
        return Look(State.SKIPPED, _UNTOLD)
    return Look(State.OK, ", ".join(f"{node or ''} {value}".strip() for node, value in versions.items()))


def _battery(facts: list[Fact]) -> Look:
    said = {
        fact.name.rpartition(" ")[2]: measured({"value": fact.value, "unit": fact.unit}) for fact in facts
    }
    said = {name: value for name, value in said.items() if "battery" in name or "state" in name}
    if not said:
        return Look(State.SKIPPED, _UNTOLD)
    weak = any(value in _WEAK for value in said.values())
    fix = "charge it: a weak battery drops the link" if weak else ""
    seen = ", ".join(f"{name.replace('_', ' ')} {value}" for name, value in said.items())
    return Look(State.WARN if weak else State.OK, seen, fix)
