"""Read facts about a robot, such as its battery level: commands to send, and the facts in their answers."""

from collections.abc import Collection, Iterable, Iterator
from typing import Final, NamedTuple

from sphero_probe.catalogue import row_by_name
from sphero_probe.catalogue.addresses import client_means
from sphero_probe.catalogue.meaning import answer_meaning
from sphero_probe.catalogue.model import Robot
from sphero_probe.catalogue.well_known import FACTS, VERSION_FIELDS
from sphero_probe.link.exchange import Answered
from sphero_probe.link.link import Link
from sphero_probe.probing.finding import Finding, Heading
from sphero_probe.probing.notes import node_name
from sphero_probe.probing.oneshot import send_once
from sphero_probe.probing.plan import Probe
from sphero_probe.protocol.address import Address
from sphero_probe.protocol.packets import Command, Generation

BATTERY: Final = ("power.get_battery_percentage", "power.get_battery_voltage_state", "core.get_power_state")
"""The commands that tell how full the battery is."""


class Fact(NamedTuple):
    """One fact that a robot reports about itself.

    Attributes:
        name: what it is, ``battery_percentage``.
        value: as decoded.
        unit: of the value, empty for none.
        node: the node that reported it, empty if the robot has only one.
    """

    name: str
    value: object
    unit: str = ""
    node: str = ""


def probes_of(
    names: Iterable[str], generation: Generation, robot: Robot | None, port: int
) -> Iterator[Probe]:
    """Yield a read per fact, on each node that serves it.

    Args:
        names: the commands that ask for the facts.
        generation: the protocol of the catalogue.
        robot: the model, None if it is not known.
        port: the port nibble of this kind of connection.
    """
    for name in names:
        row = row_by_name(generation, name)
        if row is None:
            continue
        nodes = row.nodes.get(robot.key, ()) if robot else ()
        if robot and not robot.addressed:
            nodes = ()
        for node in nodes or (None,):
            yield Probe(Command(row.did, row.cid, b"", None if node is None else Address(port, node).byte))


def facts_of_line(heading: Heading) -> Iterator[Fact]:
    """Yield how a robot is reached, and how it sees its client, if its answers tell."""
    if heading.line:
        yield Fact("reached_over", heading.line)
    if heading.client is not None:
        yield Fact("sees_client_as", f"0x{heading.client:02x}: {client_means(heading.client, heading.robot)}")


def facts_of(finding: Finding, robot: Robot | None) -> Iterator[Fact]:
    """Yield the facts in one answer; none if it has no data.

    Args:
        finding: of a probe of ``probes_of``.
        robot: the model, None if it is not known.
    """
    row, exchange = finding.knowledge, finding.exchange
    if (
        row is None
        or row.response is None
        or not isinstance(exchange, Answered)
        or not exchange.response.payload
    ):
        return
    decoded = answer_meaning(exchange.response, row)
    name = row.name.partition(".")[2].removeprefix("get_")
    node = node_name(finding.command.target, robot) if robot and len(robot.nodes) > 1 else ""
    fields = dict(decoded.fields)
    parts = VERSION_FIELDS[row.generation]
    if all(part in fields for part in parts):
        yield Fact(name, ".".join(str(fields.pop(part)) for part in parts), "", node)
    alone = len(decoded.fields) == 1
    for field, value in fields.items():
        yield Fact(name if alone else f"{name} {field}", value, decoded.units.get(field, ""), node)


async def ask_facts(link: Link, robot: Robot | None, port: int, names: Collection[str]) -> list[Fact]:
    """Ask for some of the facts of ``info``, one after the other.

    Args:
        link: to a robot that is awake.
        robot: the model, None if it is not known.
        port: the port nibble of this kind of connection.
        names: the commands that ask for the facts.

    Raises:
        LinkLostError: the robot is gone.
    """
    generation = link.codec.generation
    known = [name for name in FACTS[generation] if name in names]
    told: list[Fact] = []
    for number, probe in enumerate(probes_of(known, generation, robot, port), 1):
        finding = await send_once(link, probe.command, number)
        told.extend(facts_of(finding, robot))
    return told
