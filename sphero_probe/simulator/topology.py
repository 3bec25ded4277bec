"""How a packet travels through systems of nodes: its hops, and the addresses at each.

This is the model of "Packet Addressing and Routing" in Sphero's description of its API [vendor]. A system has
nodes and ports. Channels join the nodes of a system; a line joins the ports of two systems. Three rules of
the document decide where a packet goes:

- Each node has a table of its own system: for every node and port, the first node on the way there.
- A packet that comes in through a port is translated: its target is now within this system (port 0), and its
  source is behind that port. So a packet crosses one line at most: systems cannot talk through another one.
- Node 0 is the wildcard: a node that cannot serve the packet passes it on.

A node that cannot forward a packet answers "bad target" or "target unavailable". The document leaves open
which node that is; here it is the one that found out, or ``System.bad_target_from``. It also leaves open in
which order the nodes pass a wildcard on; here that is by rising number, starting at the node where the packet
came in, which answers in the end if no node can serve it. Of packets without addresses the document's rules
are lost. What captures show: a packet without a target is for the node that receives it.
"""

from collections import deque
from collections.abc import Callable, Iterable, Mapping
from enum import Enum
from typing import Final, NamedTuple

from sphero_probe.protocol.address import WILDCARD, Address

INTERNAL: Final = 0
"""The port number that stays within a system."""
NUMBERS: Final = range(1, 16)
"""The numbers of nodes and ports; 0 has another meaning for both."""


class Place(NamedTuple):
    """A node of a system."""

    system: str
    node: int


class Plug(NamedTuple):
    """A port of a system: one end of a line."""

    system: str
    port: int


class Addresses(NamedTuple):
    """The addresses of a packet as one node sees them; None where the packet has none."""

    source: Address | None
    target: Address | None

    def answer_from(self, node: int) -> "Addresses":
        """Return the addresses of the response that a node gives: swapped, seen from that node."""
        return Addresses(Address(INTERNAL, node), self.source)


class System(NamedTuple):
    """A device with one or more processors.

    Attributes:
        nodes: their numbers, 1-15.
        ports: number of a port, 1-15 -> the node that has it.
        channels: pairs of nodes that can pass packets to each other.
        bad_target_from: the node that answers "bad target" for all; None for the one that found out.
    """

    nodes: tuple[int, ...]
    ports: Mapping[int, int] = {}
    channels: tuple[tuple[int, int], ...] = ()
    bad_target_from: int | None = None


class Faults(NamedTuple):
    """The nodes that do not work.

    Attributes:
        unavailable: asleep or disconnected; the node before it answers for it.
        hung: takes packets and does nothing with them.
    """

    unavailable: frozenset[Place] = frozenset()
    hung: frozenset[Place] = frozenset()


class Ending(Enum):
    """What became of a packet."""

    DELIVERED = "delivered"
    BAD_TARGET = "bad target"
    UNAVAILABLE = "target unavailable"
    LOST = "lost in a node that hangs"


class Hop(NamedTuple):
    """A node that handled a packet.

    Attributes:
        place: the node.
        seen: the addresses as this node sees them.
        next: the node to which it passed the packet, None if it did not.
        leaves_by: the port through which the packet left the system, None if it did not.
    """

    place: Place
    seen: Addresses
    next: Place | None = None
    leaves_by: int | None = None


class Route(NamedTuple):
    """The way of one packet.

    Attributes:
        hops: in order, at least one.
        ending: what the last node did with it.
    """

    hops: tuple[Hop, ...]
    ending: Ending

    @property
    def place(self) -> Place:
        """The node where the packet ended."""
        return self.hops[-1].place

    @property
    def seen(self) -> Addresses:
        """The addresses as that node sees them."""
        return self.hops[-1].seen


def translate(addresses: Addresses, port: int) -> Addresses:
    """Return the addresses of a packet that came in through a port, as the system behind it sees them."""
    source, target = addresses
    return Addresses(
        source and Address(port, source.node),
        target and Address(INTERNAL, target.node),
    )


class Topology:
    """Systems, and the lines between their ports.

    Attributes:
        systems: name -> system.
        tables: node -> for every node (port 0) and port (node 0) of its system, the first node on the way;
            its own number where the way ends at this node.
    """

    def __init__(self, systems: Mapping[str, System], lines: Iterable[tuple[Plug, Plug]] = ()) -> None:
        """Check the network and make the tables.

        Raises:
            ValueError: a number out of range, a port or channel of a node that the system does not have,
                nodes that no channel reaches, or two lines at one port.
        """
        self.systems = dict(systems)
        self.tables: dict[Place, dict[Address, int]] = {}
        for name, system in self.systems.items():
            _check(name, system)
            self.tables |= {Place(name, node): _table(system, node) for node in system.nodes}
            if any(len(self.tables[Place(name, node)]) < _entries(system) for node in system.nodes):
                raise ValueError(f"system {name}: channels do not join all nodes")
        self._lines: dict[Plug, Plug] = {}
        for one, other in lines:
            self._join(one, other)

    def with_system(self, name: str, system: System) -> "Topology":
        """Return the same network with one system replaced by another."""
        pairs = {frozenset(pair): pair for pair in self._lines.items()}
        return Topology({**self.systems, name: system}, pairs.values())

    def behind(self, plug: Plug) -> Plug | None:
        """Return the port at the other end of the line, None where no line is plugged in."""
        return self._lines.get(plug)

    def route(
        self,
        start: Place,
        addresses: Addresses,
        faults: Faults = Faults(),  # noqa: B008 - frozen
        serves: Callable[[Place], bool] = lambda _: True,
    ) -> Route:
        """Follow a packet from a node on.

        Args:
            start: the node that sends the packet, or has received it.
            addresses: as that node sees them.
            faults: the nodes that do not work.
            serves: whether a node can serve the packet if it is for the wildcard.
        """
        hops: list[Hop] = []
        place, seen, ring = start, addresses, _Ring(self.systems[start.system], start.node)
        while True:
            ending, hop, after = self._step(place, seen, faults, serves, ring)
            hops.append(hop)
            if ending is not None or hop.next is None:
                return Route(tuple(hops), ending or Ending.LOST)
            if hop.leaves_by is not None:
                ring = _Ring(self.systems[hop.next.system], hop.next.node)
            place, seen = hop.next, after

    def _step(
        self,
        place: Place,
        seen: Addresses,
        faults: Faults,
        serves: Callable[[Place], bool],
        ring: "_Ring",
    ) -> tuple[Ending | None, Hop, Addresses]:
        """Let one node handle a packet: how it ends there, or the hop and the addresses after it."""
        stays, target = Hop(place, seen), seen.target
        if place in faults.hung:
            return Ending.LOST, stays, seen
        if target is None:
            return Ending.DELIVERED, stays, seen
        if target.port == INTERNAL and target.is_wildcard:
            goal = ring.next_after(place.node, serves=serves(place))
            target = Address(INTERNAL, place.node if goal is None else goal)
        table, system = self.tables[place], self.systems[place.system]
        step = table.get(target if target.port == INTERNAL else target.with_node(WILDCARD))
        if step is None:
            answers = system.bad_target_from or place.node
            if answers == place.node:
                return Ending.BAD_TARGET, stays, seen
            step = table[Address(INTERNAL, answers)]
        if step != place.node:
            hop, after = Hop(place, seen, Place(place.system, step)), seen
        elif target.port == INTERNAL:
            return Ending.DELIVERED, stays, seen
        elif (plug := self._lines.get(Plug(place.system, target.port))) is None:
            return Ending.UNAVAILABLE, stays, seen
        else:
            other = Place(plug.system, self.systems[plug.system].ports[plug.port])
            hop, after = Hop(place, seen, other, target.port), translate(seen, plug.port)
        if hop.next in faults.unavailable:
            return Ending.UNAVAILABLE, stays, seen
        return None, hop, after

    def _join(self, one: Plug, other: Plug) -> None:
        for plug in (one, other):
            if plug.system not in self.systems or plug.port not in self.systems[plug.system].ports:
                raise ValueError(f"system {plug.system} has no port {plug.port}")
            if plug in self._lines or one == other:
                raise ValueError(f"two lines at port {plug.port} of system {plug.system}")
        self._lines |= {one: other, other: one}


class _Ring:
    """The nodes of a system in the order in which they pass a wildcard on, and back to the first."""

    def __init__(self, system: System, first: int) -> None:
        others = sorted(node for node in system.nodes if node != first)
        self._left = [first, *others, first]

    def next_after(self, node: int, *, serves: bool) -> int | None:
        """Return the node to pass the packet to, None if this one keeps it."""
        while self._left and self._left[0] == node:
            self._left.pop(0)
            if serves:
                return None
        return self._left[0] if self._left else None


def _check(name: str, system: System) -> None:
    numbers = (*system.nodes, *system.ports)
    if not system.nodes or len(set(system.nodes)) < len(system.nodes):
        raise ValueError(f"system {name}: its nodes are different numbers, at least one")
    if not all(number in NUMBERS for number in numbers):
        raise ValueError(f"system {name}: nodes and ports have numbers from 1 to 15")
    used = {*system.ports.values(), *(node for pair in system.channels for node in pair)}
    if system.bad_target_from is not None:
        used.add(system.bad_target_from)
    if missing := used - set(system.nodes):
        raise ValueError(f"system {name} has no node {min(missing)}")


def _entries(system: System) -> int:
    return len(system.nodes) + len(system.ports)


def _table(system: System, node: int) -> dict[Address, int]:
    """Find the first step from a node to each node and port of its system, the shortest way."""
    first = {node: node}
    todo = deque((node,))
    while todo:
        here = todo.popleft()
        ends = {b if a == here else a for a, b in system.channels if here in (a, b)}
        for there in sorted(ends - first.keys()):
            first[there] = there if here == node else first[here]
            todo.append(there)
    nodes = {Address(INTERNAL, there): step for there, step in first.items()}
    ports = {Address(port, WILDCARD): first[owner] for port, owner in system.ports.items() if owner in first}
    return nodes | ports
