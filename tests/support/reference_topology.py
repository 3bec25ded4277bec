"""A second model of nodes and addresses, written from the document alone: bytes and distances, no tables.

It shares no code with ``sphero_probe.simulator.topology`` (nor with ``protocol.address``): an address is a
byte, a system is a set of numbers, and what is near is found by relaxing distances.
"""

from typing import NamedTuple

End = tuple[str, int]
"""A system and one of its ports, or one of its nodes."""


class Net(NamedTuple):
    nodes: dict[str, tuple[int, ...]]
    owners: dict[End, int]
    """(system, port) -> the node that has the port."""
    joined: frozenset[tuple[str, int, int]]
    """(system, node, node), each pair both ways."""
    lines: tuple[tuple[End, End], ...]


class Expected(NamedTuple):
    ending: str
    """"delivered", "bad target" or "target unavailable"."""
    at: End
    """The system and node where the packet ends."""
    steps: int
    """How many times it is passed on."""
    bytes_in: dict[str, tuple[int, int]]
    """System -> the source and target bytes of the packet while it is there."""


def steps_between(net: Net, system: str, one: int, other: int) -> int:
    """How many channels lie between two nodes of a system."""
    nodes = net.nodes[system]
    far = {(a, b): 0 if a == b else 1 if (system, a, b) in net.joined else 99 for a in nodes for b in nodes}
    for via in nodes:
        for a in nodes:
            for b in nodes:
                far[a, b] = min(far[a, b], far[a, via] + far[via, b])
    return far[one, other]


def neighbour(net: Net, end: End) -> End | None:
    """The port at the other end of a line."""
    for one, other in net.lines:
        if end in (one, other):
            return other if end == one else one
    return None


def expected(net: Net, sender: End, target: int) -> Expected:
    """What becomes of a packet that a node sends to the address of one node, if all nodes work."""
    system, node = sender
    port, wanted = target >> 4, target & 0x0F
    here = {system: (node, target)}
    if port == 0:
        if wanted in net.nodes[system]:
            return Expected("delivered", (system, wanted), steps_between(net, system, node, wanted), here)
        return Expected("bad target", sender, 0, here)
    if (system, port) not in net.owners:
        return Expected("bad target", sender, 0, here)
    leaves = net.owners[system, port]
    way = steps_between(net, system, node, leaves)
    there = neighbour(net, (system, port))
    if there is None:
        return Expected("target unavailable", (system, leaves), way, here)
    enters = net.owners[there]
    # "the source is translated from 0a to 2a", "the target is translated from 1c to 0c"
    both = {**here, there[0]: (there[1] << 4 | node, wanted)}
    if wanted in net.nodes[there[0]]:
        inside = steps_between(net, there[0], enters, wanted)
        return Expected("delivered", (there[0], wanted), way + 1 + inside, both)
    return Expected("bad target", (there[0], enters), way + 1, both)


def way(net: Net, sender: End, target: int) -> list[End]:
    """The nodes that handle such a packet, in order, where channels are joined in no circle."""
    system, node = sender
    last = expected(net, sender, target).at
    there = neighbour(net, (system, target >> 4))
    if there is None or not target >> 4:
        return _between(net, system, node, last[1])
    inside = _between(net, there[0], net.owners[there], last[1])
    return _between(net, system, node, net.owners[system, target >> 4]) + inside


def _between(net: Net, system: str, one: int, other: int) -> list[End]:
    whole = steps_between(net, system, one, other)
    parts = {
        node: (steps_between(net, system, one, node), steps_between(net, system, node, other))
        for node in net.nodes[system]
    }
    return [
        (system, node) for node in sorted(parts, key=lambda node: parts[node]) if sum(parts[node]) == whole
    ]
