"""Print the nodes of a robot as a page: first the system, then a table of its nodes."""

from itertools import groupby
from typing import Final, TextIO

from sphero_probe.protocol.address import Address
from sphero_probe.reports.phrases import Data, hex_id, shown
from sphero_probe.reports.registry import Style
from sphero_probe.reports.rows import Row
from sphero_probe.reports.terminal import Shape, TerminalWriter

_SHAPES: Final = (
    Shape("Address", whole=True),
    Shape("Node", whole=True),
    Shape("State"),
    Shape("Firmware", whole=True),
    Shape("Serves"),
)
_LINE: Final = 400
"""Characters of a line that are shown at most."""


class NodesTable:
    """Collects the rows of a survey and writes the page at the end."""

    def __init__(self, out: TextIO, style: Style, nothing: str) -> None:
        self._writer = TerminalWriter(out, style)
        self._nothing = nothing
        self._system: Data | None = None
        self._nodes: list[Data] = []

    def add(self, row: Row) -> None:
        """Keep a row of a system or of an address."""
        if row.type == "system":
            self._system = row.data
        elif row.type == "node":
            self._nodes.append(row.data)

    def close(self) -> None:
        """Write the page."""
        for text in _heading(self._system) if self._system else [self._nothing]:
            self._writer.say(text, limit=_LINE)
        if self._nodes:
            self._writer.skip()
            grouped = groupby(self._nodes, key=_alike)
            cells = [_cells(key, list(held)) for key, held in grouped]
            self._writer.grid(_SHAPES, cells, self._writer.widths(_SHAPES, cells))
            self._served()
        self._writer.flush()

    def _served(self) -> None:
        for node in self._nodes:
            held = node.get("serves")
            if isinstance(held, list) and held:
                self._writer.skip()
                self._writer.say(f"Served by the wildcard {hex_id(node.get('address'))}")
                told = [_server(one) for one in held if isinstance(one, dict)]
                self._writer.items(told, indent=2)


def _heading(system: Data) -> list[str]:
    who = " ".join(filter(None, (shown(system.get("model")), shown(system.get("name")))))
    lines = [f"{who}, over {shown(system.get('line'))}"]
    if note := shown(system.get("note")):
        return [*lines, note]
    client = system.get("client")
    seen = f"{hex_id(client)}: {shown(system.get('client_means'))}" if client is not None else "not told"
    lines.append(f"The robot sees this client as {seen}")
    lines.append(f"Addresses in its answers: {shown(system.get('addressing')) or 'not told'}")
    return lines


def _alike(node: Data) -> str:
    """Group consecutive addresses without a node into one line; give every other address its own."""
    if node.get("state") in ("absent", "silent"):
        return f"{node.get('state')} {_port(node)} {_said_by(node)}"
    return f"at {node.get('address')}"


def _port(node: Data) -> int:
    address = node.get("address")
    return Address.from_byte(address).port if isinstance(address, int) else -1


def _said_by(node: Data) -> str:
    """Return what was said to an echo, and by which node where it is not the one that was asked."""
    by, asked = node.get("answered_by"), node.get("node")
    if node.get("code") is None:
        return "no answer"
    told = f"{hex_id(node.get('code'))} {shown(node.get('code_name'))}"
    answering = Address.from_byte(by).node if isinstance(by, int) else None
    if node.get("state") == "answers":
        told = "" if node.get("code") == 0 else told
        return told if asked == answering or answering is None else f"{told} by node {answering}".strip()
    if asked == answering:
        return f"{told}, in its own name"
    return f"{told}, says node {answering}" if answering is not None else f"{told}, no node named"


def _cells(_key: str, held: list[Data]) -> tuple[str, ...]:
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
