"""What a survey of nodes found, as JSON: for the rows of ``nodes``, and for the note of a run."""

from sphero_probe.catalogue import DEVICE_NAMES
from sphero_probe.catalogue.addresses import client_means
from sphero_probe.catalogue.model import Robot
from sphero_probe.probing.finding import Note
from sphero_probe.probing.notes import node_name
from sphero_probe.probing.system import NodeAnswer, NodeState, System
from sphero_probe.protocol.address import Address
from sphero_probe.protocol.codec import Codec

SURVEY = "nodes"
"""Kind of the note of a survey."""


def nodes_note(system: System, codec: Codec) -> Note:
    """Return the note of a survey: ``system`` and ``nodes`` have the keys of the rows of ``nodes``."""
    data: dict[str, object] = {
        "system": system_data(system),
        "nodes": [node_data(one, system.robot, codec) for one in system.nodes],
    }
    states = {
        node_name(one.target, system.robot): one.state.value
        for one in system.nodes
        if one.target is not None and not Address.from_byte(one.target).is_wildcard
        if one.state in (NodeState.ANSWERS, NodeState.UNAVAILABLE)
    }
    told = ", ".join(f"{name} {state}" for name, state in states.items())
    return Note(SURVEY, told or "no node answers an echo", data)


def system_data(system: System) -> dict[str, object]:
    """Return the keys of a system."""
    client, robot = system.client, system.robot
    return {
        "name": system.name,
        "model": robot.name if robot else None,
        "line": system.line or None,
        "port": None if client is None else Address.from_byte(client).port,
        "client": client,
        "client_means": None if client is None else client_means(client, robot.key if robot else ""),
        "addressing": system.addressing or None,
        "note": system.note or None,
    }


def node_data(one: NodeAnswer, robot: Robot | None, codec: Codec) -> dict[str, object]:
    """Return the keys of an address that was asked.

    Args:
        one: the address and what became of its echo.
        robot: the model, None if it is not known.
        codec: whose codes the answers carry.
    """
    node = None if one.target is None else Address.from_byte(one.target).node
    names = DEVICE_NAMES[codec.generation]
    return {
        "address": one.target,
        "node": node,
        "name": _name(one.target, robot),
        "state": one.state.value,
        "code": one.code,
        "code_name": None if one.code is None else codec.code_name(one.code),
        "answered_by": one.answered_by,
        "firmware": one.firmware or None,
        "devices": [names.get(did, f"0x{did:02x}") for did in one.devices],
        "dids": list(one.devices),
        "devices_from": ("the node" if one.claimed else "the catalogue") if one.devices else None,
        "serves": [
            {"did": served.row.did, "cid": served.row.cid, "name": served.row.name, "node": served.node}
            for served in one.served
        ],
    }


def _name(target: int | None, robot: Robot | None) -> str:
    if target is None:
        return "no address"
    return "wildcard" if Address.from_byte(target).is_wildcard else node_name(target, robot)
