"""The system of nodes of a fake robot: which node takes a command, and the addresses of its answer."""

from collections.abc import Callable
from itertools import pairwise
from typing import Final, NamedTuple

from sphero_probe.catalogue.model import Robot
from sphero_probe.errors import UsageError
from sphero_probe.protocol.address import Address
from sphero_probe.protocol.packets import Request
from sphero_probe.simulator.settings import Line, Settings
from sphero_probe.simulator.topology import (
    INTERNAL,
    Addresses,
    Faults,
    Place,
    Plug,
    Route,
    System,
    Topology,
    translate,
)

PORTS: Final = {Line.BLE: 1, Line.UART: 2}
"""Line -> the robot's port at its end [real, RVR: a client on the UART is answered at 0x21]."""

_WITH_UART: Final = ("rvr", "rvr-plus")
_CLIENT: Final = "client"
_FIRST_CLIENT: Final = 1
"""The node of a client that writes no source: it is the neighbour on this line."""


class Wiring(NamedTuple):
    """A network, and where in it the client is.

    Attributes:
        topology: the client's system, the robot's, and maybe more.
        client: the client's end of the line to the robot.
    """

    topology: Topology
    client: Plug


def lines_of(robot: Robot) -> list[Line]:
    """Return the lines by which a client can reach a robot."""
    return [line for line in Line if line is not Line.UART or robot.key in _WITH_UART]


def usual_wiring(robot: Robot, line: Line) -> Wiring:
    """Return the network of a robot as its maker describes it: its ports are at the first node.

    Raises:
        UsageError: the robot has no such line.
    """
    first, *_ = nodes = tuple(robot.nodes)
    lines = lines_of(robot)
    if line not in lines:
        raise UsageError(f"fake robot setting line={line}: {robot.key} has no UART", "try fake:rvr?line=uart")
    systems = {
        robot.key: System(nodes, {PORTS[one]: first for one in lines}, tuple(pairwise(nodes))),
        _CLIENT: System((_FIRST_CLIENT,), {1: _FIRST_CLIENT}),
    }
    client = Plug(_CLIENT, 1)
    return Wiring(Topology(systems, [(client, Plug(robot.key, PORTS[line]))]), client)


class Network:
    """The nodes of one fake robot, and the port through which its client talks to them.

    Attributes:
        nodes: their numbers.
        entry: the node at that port, which takes every command of the client first.
    """

    def __init__(self, settings: Settings, wiring: Wiring | None = None) -> None:
        """Take a network, or the usual one of the model.

        Raises:
            UsageError: the settings name a line or a node that the robot does not have, or make the node
                unavailable that would have to answer for it.
        """
        self._topology, client = wiring or usual_wiring(settings.model, settings.line)
        plug = self._topology.behind(client)
        if plug is None:
            raise UsageError(f"no line is plugged in at port {client.port} of system {client.system}")
        self._plug = plug
        system = self._topology.systems[plug.system]
        self.nodes = system.nodes
        self.entry = system.ports[plug.port]
        self._hang = settings.die
        self._began: float | None = None
        self._unavailable = frozenset(self._place("unavailable", node) for node in settings.unavailable)
        if self._place("unavailable", self.entry) in self._unavailable:
            raise UsageError(
                f"fake robot setting unavailable={self.entry}: node {self.entry} is at the client's port; "
                "no other node could answer for it"
            )
        if self._hang:
            self._place("die", self._hang.node)
        if settings.bad_target_from is not None:
            self._place("bad_target_from", settings.bad_target_from)
            self._topology = self._topology.with_system(
                plug.system, system._replace(bad_target_from=settings.bad_target_from)
            )

    def begin(self, *, now: float) -> None:
        """Start the robot's time, if it has not started; the clock was unknown before."""
        if self._began is None:
            self._began = now

    def receive(self, request: Request, serves: Callable[[int], bool], *, now: float) -> Route:
        """Follow a command from the client's port to the node that takes it.

        Args:
            request: the command, with the addresses that the client wrote.
            serves: whether a node can serve the command if it is for the wildcard.
            now: seconds of the caller's clock.
        """
        target = request.command.target
        source = Address.from_byte(request.source) if request.source is not None else None
        client = source.node if source and not source.is_wildcard else _FIRST_CLIENT
        addresses = Addresses(
            Address(INTERNAL, client), None if target is None else Address.from_byte(target)
        )
        return self._topology.route(
            Place(self._plug.system, self.entry),
            translate(addresses, self._plug.port),
            self._faults(now),
            lambda place: serves(place.node),
        )

    def answer(self, route: Route, *, now: float) -> Addresses | None:
        """Return the addresses of the answer of the node where a command ended, as they leave the robot.

        They are not translated on this side of the line.

        Returns:
            The addresses, None if the answer is lost on the way.
        """
        return self._leave(route.place.node, route.seen.answer_from(route.place.node), now)

    def is_heard(self, node: int, *, now: float) -> bool:
        """Whether what a node sends by itself reaches the client."""
        to_client = Addresses(Address(INTERNAL, node), Address(self._plug.port, _FIRST_CLIENT))
        place = Place(self._plug.system, node)
        return place not in self._unavailable and self._leave(node, to_client, now) is not None

    def _leave(self, node: int, addresses: Addresses, now: float) -> Addresses | None:
        route = self._topology.route(Place(self._plug.system, node), addresses, self._faults(now))
        leaving = (hop.seen for hop in route.hops if hop.leaves_by == self._plug.port)
        return next(leaving, None)

    def _faults(self, now: float) -> Faults:
        hang = self._hang
        if hang is None or self._began is None or now < self._began + hang.after:
            return Faults(self._unavailable)
        return Faults(self._unavailable, frozenset({Place(self._plug.system, hang.node)}))

    def _place(self, key: str, node: int) -> Place:
        if node not in self.nodes:
            there = ", ".join(map(str, self.nodes))
            raise UsageError(f"fake robot setting {key}: there is no node {node}; there are {there}")
        return Place(self._plug.system, node)
