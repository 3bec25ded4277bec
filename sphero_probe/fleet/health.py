"""Tell how well a robot works: awake, firmware, battery, round trips, dead nodes."""

from sphero_probe.fleet.records import Battery
from sphero_probe.probing.facts import BATTERY, ask_facts
from sphero_probe.session.session import Session


async def read_battery(session: Session) -> Battery:
    """Ask a robot for the level of its battery, with documented reads.

    Raises:
        LinkLostError: the link was lost.
    """
    connection = session.connection
    return Battery(tuple(await ask_facts(session.link, connection.robot, connection.port, BATTERY)))
