"""Tell how well a robot works: awake, firmware, battery, round trips, dead nodes."""

from collections.abc import AsyncGenerator
from typing import Final, NamedTuple

from sphero_probe.catalogue.well_known import WellKnown
from sphero_probe.errors import IncompleteError
from sphero_probe.fleet.action import Visit
from sphero_probe.fleet.records import Battery, FleetRecord, Health
from sphero_probe.link.exchange import Answered, Unsolicited
from sphero_probe.link.unsolicited import describe_unsolicited
from sphero_probe.probing.facts import BATTERY, ask_facts
from sphero_probe.probing.introduction import introduce
from sphero_probe.probing.latency import measure_round_trips
from sphero_probe.protocol.address import Address
from sphero_probe.session.identify import ask_well_known
from sphero_probe.session.reconnect import Reconnector
from sphero_probe.session.session import Session

_ECHOES: Final = 10
_AWAKE_ATTEMPTS: Final = 2
"""How often an echo is sent before the robot counts as asleep."""


class HealthAction(NamedTuple):
    """Checks each robot with documented reads and echoes; it keeps no journal.

    Attributes:
        command: empty, as there is no journal.
    """

    command: str = ""

    async def run(self, visit: Visit) -> AsyncGenerator[FleetRecord, None]:
        """Yield the health and the battery of one robot.

        Raises:
            IncompleteError: a node that the model has answers nothing.
            NoAnswerError: the robot answers nothing.
            LinkLostError: the link was lost, also after reconnecting.
        """
        session = visit.session
        line = Reconnector(session.link, session.target, visit.stop, session.reconnect)
        found: list[Health | Battery] = []

        async def check() -> None:
            found[:] = [await _health(session, line), await read_battery(session)]

        await line.with_reconnect(check)
        if line.lost:
            raise line.lost
        if not found:
            raise IncompleteError("stopped before everything was asked")
        for record in found:
            yield record
        dead = [node for record in found if isinstance(record, Health) for node in record.dead]
        if dead:
            raise IncompleteError(f"no answer from the node {', '.join(dead)}")


async def _health(session: Session, line: Reconnector) -> Health:
    link, target = line.link, session.target
    echo = await ask_well_known(link, WellKnown.ECHO, target, _AWAKE_ATTEMPTS)
    unsolicited: list[Unsolicited] = []
    with describe_unsolicited(link, lambda packet, _: unsolicited.append(packet)):
        firmware = await introduce(line, target, session.on_step, unsolicited)
    session.on_step("echoes")
    trips = await measure_round_trips(link, target, _ECHOES)
    dead = await _dead_nodes(session, firmware)
    return Health(isinstance(echo, Answered), firmware, dead, trips)


async def _dead_nodes(session: Session, firmware: dict[str, str]) -> tuple[str, ...]:
    """Return the names of the nodes that the model has and that answer neither for a version nor an echo."""
    robot, target = session.connection.robot, session.target
    if robot is None or target is None:
        return ()
    dead = []
    for number, name in robot.nodes.items():
        if name not in firmware:
            node = Address.from_byte(target).with_node(number).byte
            if not isinstance(await ask_well_known(session.link, WellKnown.ECHO, node, 1), Answered):
                dead.append(name)
    return tuple(dead)


async def read_battery(session: Session) -> Battery:
    """Ask a robot for the level of its battery, with documented reads.

    Raises:
        LinkLostError: the link was lost.
    """
    connection = session.connection
    return Battery(tuple(await ask_facts(session.link, connection.robot, connection.port, BATTERY)))
