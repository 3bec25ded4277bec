"""Turn the names and numbers that a user types into commands for one robot: nodes, arguments, LEDs.

The command line and the Python API both use it, so that they send the same bytes.
"""

from collections.abc import Mapping

from sphero_probe.catalogue import lookup
from sphero_probe.catalogue.leds import Colour, led_commands
from sphero_probe.catalogue.model import Robot
from sphero_probe.catalogue.naming import NUMBER, byte, choose
from sphero_probe.catalogue.payload.typed import how_to_type
from sphero_probe.errors import UsageError
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.address import PRIMARY, Address
from sphero_probe.protocol.packets import Command, Generation, SendOptions
from sphero_probe.session.addressing import usual_target


def node(text: str | None, robot: Robot | None, port: int) -> int | None:
    """Return the address byte of a node: ``primary``, ``secondary``, ``0x12``; None sends no address.

    Args:
        text: what the user typed; None stands for the robot's usual node, ``none`` for no address.
        robot: the model, None if it is not known.
        port: the port nibble of this kind of connection.

    Raises:
        UsageError: this robot has no node of that name.
    """
    if text is None:
        return usual_target(robot, port)
    if text == "none":
        return None
    names: dict[str, int] = {"primary": PRIMARY, "secondary": 2}
    if robot:
        names |= {name: number for number, name in robot.nodes.items()}
    if text.lower() in names:
        return Address(port, names[text.lower()]).byte
    if not NUMBER.fullmatch(text):
        raise UsageError(f"no node named '{text}'", f"known: {', '.join(names)}, none, or a number like 0x12")
    return byte(text, "node")


def complete_command(
    pair: tuple[int, int],
    payload: bytes | None,
    robot: Robot | None,
    port: int,
    target: str | None,
    *,
    generation: Generation = Generation.V2,
) -> Command:
    """Return the command with its node and arguments.

    Args:
        pair: DID and CID.
        payload: the argument bytes, None if none are given.
        robot: the model, None if it is not known.
        port: the port nibble of this kind of connection.
        target: the node as the user typed it; None for the node that serves this command.
        generation: the protocol, for a robot that is not known.

    Raises:
        UsageError: it takes arguments and none are given, or there is no node of that name.
    """
    did, cid = pair
    row = lookup(robot.generation if robot else generation, did, cid, robot)
    address = node(target, robot, port)
    if target is None and address is not None and robot and row and (nodes := row.nodes.get(robot.key)):
        address = Address(port, nodes[0]).byte
    if payload is None and row and row.request and not row.request.accepts(0):
        raise UsageError(
            f"{row.name} takes arguments: {row.request.text}", how_to_type(row.request, row.name)
        )
    return Command(did, cid, payload or b"", address)


def send_options(
    generation: Generation,
    *,
    answer: bool = True,
    only_errors: bool = False,
    activity: bool = True,
    source: str | None = None,
) -> SendOptions:
    """Return the flags and the source address to send a command with.

    Args:
        generation: the protocol.
        answer: ask for a response.
        only_errors: ask for one on error only.
        activity: reset the robot's sleep timer.
        source: the sender's address as a person wrote it, ``none`` for none, None for the usual one.

    Raises:
        UsageError: this protocol has no such flag or address, or the address is none.
    """
    if not CODECS[generation].has_addresses and (only_errors or source is not None):
        what = "asks for answers on error only" if only_errors else "carries a source address"
        raise UsageError(f"no {generation.value.upper()} command {what}", "leave that option out")
    bare = source is not None and source.lower() == "none"
    address = None if source is None or bare else byte(source, "source")
    return SendOptions(answer, only_errors, activity, address, bare)


def led_commands_for(
    wanted: Mapping[str, Colour], robot: Robot | None, port: int, target: str | None, *, off: bool = False
) -> tuple[Command, ...]:
    """Return the commands that set LEDs, with their node.

    Args:
        wanted: LED name or alias -> colour.
        robot: the model, None if it is not known.
        port: the port nibble of this kind of connection.
        target: the node as the user typed it; None for the one that serves the LEDs.
        off: also switch off every LED that is not named.

    Raises:
        UsageError: the robot has no known LEDs, or none of that name.
    """
    if robot is None or robot.leds is None:
        raise UsageError(f"no LEDs are known of {robot.name if robot else 'an unknown model'}")
    table = robot.leds
    names = [word for group in table.groups for word in (group.name, *group.aliases)]
    for name in wanted:
        choose(name, dict.fromkeys(names), f"LED on {robot.name}:")
    address = node(target, robot, port)
    if target is None and address is not None and table.node is not None:
        address = Address(port, table.node).byte
    return tuple(command._replace(target=address) for command in led_commands(robot, wanted, off=off))
