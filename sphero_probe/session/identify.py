"""Wake a robot and read its firmware version, with documented commands that every model has."""

from sphero_probe.catalogue.meaning import answer_meaning
from sphero_probe.catalogue.well_known import VERSION_FIELDS, WellKnown, row_for
from sphero_probe.link.concurrent import ask_together
from sphero_probe.link.exchange import Answered, Exchange, Silent
from sphero_probe.link.link import Link
from sphero_probe.link.pacing import MAX_ATTEMPTS
from sphero_probe.protocol.address import Address
from sphero_probe.protocol.packets import Command


async def ask_well_known(
    link: Link, what: WellKnown, target: int | None, attempts: int = MAX_ATTEMPTS
) -> Exchange | None:
    """Send a well-known documented command; return None if the generation has none.

    Args:
        link: to the robot.
        what: the command's role.
        target: the address byte of the node.
        attempts: how often it is sent while no answer arrives.

    Raises:
        LinkLostError: the link was lost.
    """
    row = row_for(link.codec.generation, what)
    if row is None:
        return None
    command = Command(row.did, row.cid, b"", target)
    exchange = await link.ask(command, expected=True)
    for _ in range(attempts - 1):
        if not isinstance(exchange, Silent):
            break
        exchange = await link.ask(command, alone=True)
    return exchange


async def wake(link: Link, target: int | None, attempts: int = MAX_ATTEMPTS) -> None:
    """Send the wake command, to the node that serves it if the catalogue knows which.

    Args:
        link: to the robot.
        target: the address byte of a node. Its port is used, and its node if no other is known.
        attempts: how often it is sent while no answer arrives.

    Raises:
        LinkLostError: the link was lost.
    """
    row, robot = row_for(link.codec.generation, WellKnown.WAKE), link.policy.robot
    nodes = row.nodes.get(robot.key, ()) if row and robot else ()
    address = None if target is None else Address.from_byte(target)
    if address and nodes and address.node not in nodes:
        target = address.with_node(nodes[0]).byte
    await ask_well_known(link, WellKnown.WAKE, target, attempts)


async def read_firmware(link: Link, target: int | None) -> dict[str, str]:
    """Return node name -> firmware version; a robot that has not answered anything yet is asked once.

    Args:
        link: to the robot.
        target: the address byte of its usual node.

    Raises:
        LinkLostError: the link was lost.
    """
    robot = link.policy.robot
    nodes = robot.nodes if robot and target is not None else {0: "robot"}
    versions: dict[str, str] = {}
    row = row_for(link.codec.generation, WellKnown.VERSION)
    targets = [None if target is None else Address.from_byte(target).with_node(node).byte for node in nodes]
    exchanges = await ask_together(_ask_version(link, at) for at in targets)
    for name, exchange in zip(nodes.values(), exchanges, strict=True):
        fields = answer_meaning(exchange.response, row).fields if isinstance(exchange, Answered) else {}
        if row and fields:
            parts = (fields.get(part) for part in VERSION_FIELDS[row.generation])
            versions[name] = ".".join(str(part) for part in parts if part is not None)
    return versions


async def _ask_version(link: Link, target: int | None) -> Exchange | None:
    """Ask once, and again where something was answered meanwhile."""
    exchange = await ask_well_known(link, WellKnown.VERSION, target, attempts=1)
    if isinstance(exchange, Silent) and link.answers:
        exchange = await ask_well_known(link, WellKnown.VERSION, target, MAX_ATTEMPTS - 1)
    return exchange
