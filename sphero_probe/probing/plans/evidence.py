"""The evidence run as a plan: a robot in, the commands out that settle open questions about its firmware.

All commands are documented reads or commands that cannot exist. Calibration, the echoes that are sent at once
and the waiting are done by ``probing.collecting``.
"""

from collections.abc import Iterator, Mapping
from typing import Final

from sphero_probe.catalogue import BRICK_DEVICES, PERSIST_DEVICES, all_rows, commands_of, lookup, rows_of
from sphero_probe.catalogue.model import CommandRow, Kind, Robot
from sphero_probe.catalogue.provenance import SIGHTINGS
from sphero_probe.catalogue.risk import Risk
from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.link.wrong_lengths import IMPOSSIBLE_CIDS, IMPOSSIBLE_DIDS, WRONG_LENGTH, WRONG_PAYLOAD
from sphero_probe.probing.evidence import ECHO_SIZES, WINDOWS, Topic
from sphero_probe.probing.plan import Plan, Probe
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.address import PRIMARY, Address
from sphero_probe.protocol.packets import Command, Generation, SendOptions

ERROR_CODES: Final = (7, 1, 2, 3, 4, 5, 6, 8, 9, 10)
"""The codes to ask for; the first one is no answer of a robot that lacks the command."""
ON_ERROR_ONLY: Final = SendOptions(only_errors=True, without_source=True)
"""With a target these are the flags 1E, which are reported as unreliable [sphero-sdk-raspberrypi-python]."""
_SECOND: Final = 2
_FOREIGN: Final = 2
"""Reads of other models that a robot is asked, because it probably lacks them."""


def evidence_targets(robot: Robot | None, target: int | None) -> tuple[int | None, ...]:
    """Return the address bytes of the nodes to measure.

    Args:
        robot: the model, None if it is not known.
        target: the address byte of its usual node.
    """
    if target is None or robot is None:
        return (target,)
    usual = Address.from_byte(target)
    return tuple(usual.with_node(node).byte for node in robot.nodes)


def evidence_probes(
    generation: Generation, robot: Robot | None, target: int | None, port: int
) -> Mapping[Topic, list[Probe]]:
    """Return the commands of each part of an evidence run, in order.

    Args:
        generation: the protocol.
        robot: the model, None if it is not known.
        target: the address byte of its usual node, None to leave addresses out.
        port: the port nibble of this kind of connection.
    """
    targets = evidence_targets(robot, target)
    return {
        topic: [Probe(command, exact=True) for command in commands]
        for topic, commands in (
            (Topic.ORDER, _order(generation, robot, target)),
            (Topic.LISTS, (one for node in targets for one in _lists(generation, node))),
            (Topic.CODES, _codes(generation, targets)),
            (Topic.NODES, _nodes(generation, port)),
            (Topic.SIZES, echoes_of_sizes(generation, target)),
            (Topic.BURSTS, (one for count in WINDOWS for one in burst_of(generation, target, count))),
        )
    }


def evidence_plan(generation: Generation, robot: Robot | None, target: int | None, port: int) -> Plan:
    """Return the same as a plan, for a dry run; the arguments are those of ``evidence_probes``."""
    stages = tuple(evidence_probes(generation, robot, target, port).values())
    return Plan("evidence", "what settles open questions", stages)


def _order(generation: Generation, robot: Robot | None, target: int | None) -> Iterator[Command]:
    """Yield absent commands, and a read with arguments, at lengths that show what is checked first."""
    echo = row_for(generation, WellKnown.ECHO)
    if echo is None:
        return
    for did, cid in ((IMPOSSIBLE_DIDS[0], 0), (echo.did, IMPOSSIBLE_CIDS[0])):
        for length in (WRONG_LENGTH, 0):
            yield Command(did, cid, bytes(length), target)
    for row, node in absent_rows(generation, robot):
        at = target if target is None or node is None else Address.from_byte(target).with_node(node).byte
        for payload in _payloads(row):
            yield Command(row.did, row.cid, payload, at)
    if read := read_with_arguments(generation, robot):
        for payload in _payloads(read):
            yield Command(read.did, read.cid, payload, target)


def _payloads(row: CommandRow) -> list[bytes]:
    """Return an empty payload, the right one, and a wrong length, each once."""
    right = row.sample if row.sample is not None else row.request.zeros() if row.request else b""
    return list(dict.fromkeys((b"", right, WRONG_PAYLOAD)))


def absent_rows(generation: Generation, robot: Robot | None) -> list[tuple[CommandRow, int | None]]:
    """Return commands that a robot lacks, by public reports or because only other models have them.

    With each comes the number of the node that was reported, None for the usual one. Of other models, only
    reads are returned: if the robot has one after all, it is read.
    """
    if robot is None:
        return []
    found: list[tuple[CommandRow, int | None]] = [
        (row, sighting.node)
        for sighting in SIGHTINGS
        if sighting.robot == robot.key and not sighting.exists
        if (row := lookup(generation, sighting.did, sighting.cid, robot)) and row.risk is Risk.READ
    ]
    known = {row.did for row in commands_of(robot)}
    shut = BRICK_DEVICES[generation] | PERSIST_DEVICES[generation]
    foreign = [
        row
        for row in all_rows(generation)
        if row.kind is Kind.COMMAND
        and row.risk is Risk.READ
        and row.nodes
        and row.did in known - shut
        and row.request is not None
        and row.request.fixed_length is not None
        and _is_impersonal(row)
        and not any(robot.key in other.nodes for other in rows_of(generation, row.did, row.cid))
    ]
    foreign.sort(key=lambda row: not row.request or not row.request.fixed_length)
    return [*found, *((row, None) for row in foreign[:_FOREIGN])]


def _is_impersonal(row: CommandRow) -> bool:
    """Whether the answer has a known layout of a few bytes, none of which identifies a robot."""
    jobs = (WellKnown.CLAIMED_COMMANDS, WellKnown.ERROR_ON_DEMAND)
    if row in [row_for(row.generation, job) for job in jobs]:
        return True
    length = row.response.fixed_length if row.response else None
    return bool(row.response and length and not row.response.identifying_spans(bytes(length)))


def read_with_arguments(generation: Generation, robot: Robot | None) -> CommandRow | None:
    """Return a documented read of a robot that takes arguments of one length, None if it has none."""
    for row in commands_of(robot) if robot else all_rows(generation):
        harmless = row.kind is Kind.COMMAND and row.risk is Risk.READ
        if harmless and row.request and row.request.fixed_length and _is_plain(row, robot):
            return row
    return None


def _is_plain(row: CommandRow, robot: Robot | None) -> bool:
    """Whether the usual node of a robot serves a command, and its answer is nothing special."""
    errors = row_for(row.generation, WellKnown.ERROR_ON_DEMAND)
    nodes = row.nodes.get(robot.key, ()) if robot else ()
    return row is not errors and (not nodes or PRIMARY in nodes)


def _lists(generation: Generation, target: int | None) -> Iterator[Command]:
    """Yield what asks a node for its own lists, also for a device that cannot exist."""
    devices = row_for(generation, WellKnown.CLAIMED_DEVICES)
    commands = row_for(generation, WellKnown.CLAIMED_COMMANDS)
    if devices is None or commands is None:
        return
    yield Command(devices.did, devices.cid, b"", target)
    absent = bytes(IMPOSSIBLE_DIDS[:1])
    for payload in (bytes([devices.did]), absent, absent + b"\0"):
        yield Command(commands.did, commands.cid, payload, target)


def _codes(generation: Generation, targets: tuple[int | None, ...]) -> Iterator[Command]:
    """Yield the requests for each error code: as usual, on error only without a source, without addresses."""
    row = row_for(generation, WellKnown.ERROR_ON_DEMAND)
    if row is None:
        return
    forms = [Command(row.did, row.cid, b"", target) for target in targets]
    forms += [form._replace(options=ON_ERROR_ONLY) for form in forms]
    forms.append(Command(row.did, row.cid))
    for form in dict.fromkeys(forms):
        for code in ERROR_CODES:
            yield form._replace(payload=bytes([code]))


def _nodes(generation: Generation, port: int) -> Iterator[Command]:
    """Yield an echo to both nodes of the client's port, and one without addresses."""
    echo = row_for(generation, WellKnown.ECHO)
    if echo and CODECS[generation].has_addresses:
        for number, target in enumerate((Address(port, PRIMARY).byte, Address(port, _SECOND).byte, None)):
            yield Command(echo.did, echo.cid, bytes([number]), target)


def echoes_of_sizes(generation: Generation, target: int | None) -> Iterator[Command]:
    """Yield echoes that grow, where the protocol's echo takes data."""
    echo = row_for(generation, WellKnown.ECHO)
    if echo and echo.request and echo.request.text:
        for size in ECHO_SIZES:
            yield Command(echo.did, echo.cid, bytes(range(size)), target)


def burst_of(generation: Generation, target: int | None, count: int) -> Iterator[Command]:
    """Yield echoes that are sent at once; where an echo takes data, each differs from the others."""
    echo = row_for(generation, WellKnown.ECHO)
    if echo and echo.request:
        takes_data = bool(echo.request.text)
        for number in range(count):
            yield Command(echo.did, echo.cid, bytes((count, number)) if takes_data else b"", target)
