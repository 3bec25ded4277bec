"""The documented way of a command between two systems: nodes and ports in, each hop with its addresses out.

From "Behind the Scenes" in Sphero's description of its API [vendor]: on the channel between two systems, the
port of each address is translated to one that the receiving system understands; within a system, each node
passes a packet on by its table. Only what a client sends and what reaches it can be seen on a wire.
"""

from typing import NamedTuple

from sphero_probe.protocol.address import Address


class Route(NamedTuple):
    """The two ends of a command and what lies between them.

    Attributes:
        client: node number of the client.
        out: port of the client's system that leads to the robot; 0 where the line is addressed without one.
        into: port of the robot's system that leads to the client.
        gateway: the robot's node that holds that port.
        node: the robot's node that serves the command.
    """

    client: int
    out: int
    into: int
    gateway: int
    node: int


class Hop(NamedTuple):
    """One step of a packet.

    Attributes:
        packet: ``command`` or ``answer``.
        step: what happens, in words.
        before: target and source when it begins.
        after: target and source when it ends.
        visible: the addresses behind the step can be seen on the client's wire.
    """

    packet: str
    step: str
    before: tuple[Address, Address]
    after: tuple[Address, Address]
    visible: bool = False


def documented_hops(route: Route) -> list[Hop]:
    """Return the hops of a command and its answer, as documented."""
    client, out, into, gateway, node = route
    sent = Address(out, node), Address(0, client)
    heard = Address(0, node), Address(into, client)
    hops = [
        Hop("command", f"the client sends it through its port {out}", sent, sent, visible=True),
        Hop(
            "command", f"the channel leads into the robot's port {into}, held by node {gateway}", sent, heard
        ),
    ]
    if gateway != node:
        hops.append(Hop("command", f"node {gateway} passes it to node {node} by its table", heard, heard))
    answered = Address(into, client), Address(0, node)
    hops.append(
        Hop("answer", f"node {node} answers: target and source change places", (heard[0], heard[1]), answered)
    )
    if gateway != node:
        step = f"node {node} passes it towards port {into}, to node {gateway}"
        hops.append(Hop("answer", step, answered, answered))
    arrived = Address(0, client), Address(out, node)
    hops.append(Hop("answer", "the channel leads to the client", answered, arrived, visible=True))
    return hops
