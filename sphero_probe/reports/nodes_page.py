"""Write the nodes of a robot on a page: how it sees its client, a table of its addresses, the wildcard."""

from collections.abc import Sequence
from itertools import groupby
from typing import Final

from sphero_probe.protocol.address import Address
from sphero_probe.reports.phrases import Data, hex_id, shown
from sphero_probe.reports.terminal import Shape, TerminalWriter

_SHAPES: Final = (
    Shape("Address", whole=True),
    Shape("Node", whole=True),
    Shape("State"),
    Shape("Firmware", whole=True),
    Shape("Serves"),
)
LINE: Final = 400
"""Characters of a line that are shown at most."""
_BYTE: Final = 0xFF


def write_nodes(writer: TerminalWriter, system: Data, nodes: Sequence[Data]) -> None:
    """Write how a robot sees its client, a table of its addresses, and what the wildcard serves.

    Args:
        writer: of the page.
        system: the data of a system's row, perhaps from a stranger's journal.
        nodes: the data of the rows of its addresses.
    """
    for text in _about(system):
        writer.say(text, limit=LINE)
    if not nodes:
        return
    writer.skip()
    cells = [_cells(list(held)) for _, held in groupby(nodes, key=_alike)]
    writer.grid(_SHAPES, cells, writer.widths(_SHAPES, cells))
    for node in nodes:
        held = node.get("serves")
        if isinstance(held, list) and held:
            writer.skip()
            writer.say(f"Served by the wildcard {hex_id(node.get('address'))}")
            writer.items([_server(one) for one in held if isinstance(one, dict)], indent=2)


def _about(system: Data) -> list[str]:
    if note := shown(system.get("note")):
        return [note]
    client = system.get("client")
    seen = f"{hex_id(client)}: {shown(system.get('client_means'))}" if client is not None else "not told"
    return [
        f"The robot sees this client as {seen}",
        f"Addresses in its answers: {shown(system.get('addressing')) or 'not told'}",
    ]


def _alike(node: Data) -> str:
    """Group consecutive addresses without a node into one line; give every other address its own."""
    if node.get("state") in ("absent", "silent"):
        return f"{node.get('state')} {_port(node)} {_said_by(node)}"
    return f"at {node.get('address')}"


def _port(node: Data) -> int:
    address = _address(node.get("address"))
    return address.port if address else -1


def _address(byte: object) -> Address | None:
    return Address.from_byte(byte) if isinstance(byte, int) and 0 <= byte <= _BYTE else None


def _said_by(node: Data) -> str:
    """Return what was said to an echo, and by which node where it is not the one that was asked."""
    by, asked = _address(node.get("answered_by")), node.get("node")
    if node.get("code") is None:
        return "no answer"
    told = f"{hex_id(node.get('code'))} {shown(node.get('code_name'))}"
    answering = by.node if by else None
    if node.get("state") == "answers":
        told = "" if node.get("code") == 0 else told
        return told if asked == answering or answering is None else f"{told} by node {answering}".strip()
    if asked == answering:
        return f"{told}, in its own name"
    return f"{told}, says node {answering}" if answering is not None else f"{told}, no node named"


def _cells(held: list[Data]) -> tuple[str, ...]:
    first, last = held[0], held[-1]
    address = hex_id(first.get("address")) or "none"
    if len(held) > 1:
        address = f"{address}-{hex_id(last.get('address'))}"
    name = shown(first.get("name")) if len(held) == 1 else f"{len(held)} nodes"
    said = _said_by(first)
    state = shown(first.get("state"))
    devices = shown(first.get("devices"))
    if devices and first.get("devices_from") != "the node":
        devices = f"{devices} (by the catalogue)"
    return (address, name, f"{state}: {said}" if said else state, shown(first.get("firmware")), devices)


def _server(one: Data) -> str:
    node = one.get("node")
    who = "a node that does not name itself" if node is None else f"node {shown(node)}"
    return f"{hex_id(one.get('did'))}:{hex_id(one.get('cid'))} {shown(one.get('name'))} by {who}"
