"""Packets between nodes, against the document's examples and against a second model.

The document is Sphero's description of its API, "Packet Addressing and Routing".
"""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.protocol.address import Address
from sphero_probe.simulator.topology import (
    Addresses,
    Ending,
    Faults,
    Place,
    Plug,
    Route,
    System,
    Topology,
    translate,
)
from tests.support.reference_topology import End, Net, expected, way

A, B, C, PHONE = 0xA, 0xB, 0xC, 0x1
"""The nodes of the document's figures: a in the Raspberry Pi, b and c in the RVR; and a phone beside them."""
SYSTEMS = {
    "pi": System((A,), {1: A}),
    "rvr": System((B, C), {2: B, 3: B}, ((B, C),)),
    "phone": System((PHONE,), {1: PHONE}),
}
LINES = [(Plug("pi", 1), Plug("rvr", 2)), (Plug("phone", 1), Plug("rvr", 3))]
DOCUMENT = Topology(SYSTEMS, LINES)
"""A chain of three systems: Pi, RVR, phone."""


def _addresses(source: int, target: int) -> Addresses:
    return Addresses(Address.from_byte(source), Address.from_byte(target))


def _bytes(seen: Addresses) -> tuple[int | None, ...]:
    return tuple(None if address is None else address.byte for address in seen)


def _hops(route: Route) -> list[tuple[str, int, tuple[int | None, ...]]]:
    return [(hop.place.system, hop.place.node, _bytes(hop.seen)) for hop in route.hops]


@pytest.mark.parametrize(
    ("start", "source", "target", "hops"),
    [
        pytest.param(
            ("pi", A),
            0x0A,
            0x1C,
            [("pi", A, (0x0A, 0x1C)), ("rvr", B, (0x2A, 0x0C)), ("rvr", C, (0x2A, 0x0C))],
            id="Behind the Scenes: the source is translated from 0a to 2a, the target from 1c to 0c",
        ),
        pytest.param(
            ("rvr", C),
            0x0C,
            0x2A,
            [("rvr", C, (0x0C, 0x2A)), ("rvr", B, (0x0C, 0x2A)), ("pi", A, (0x1C, 0x0A))],
            id="Behind the Scenes: the response's source from 0c to 1c, its target from 2a to 0a",
        ),
        pytest.param(
            ("rvr", B),
            0x0B,
            0x0C,
            [("rvr", B, (0x0B, 0x0C)), ("rvr", C, (0x0B, 0x0C))],
            id="Sending Information: a port of 0 stays within the system",
        ),
        pytest.param(("pi", A), 0x0A, 0x0A, [("pi", A, (0x0A, 0x0A))], id="Sending Information: itself"),
        pytest.param(
            ("phone", PHONE),
            0x01,
            0x1B,
            [("phone", PHONE, (0x01, 0x1B)), ("rvr", B, (0x31, 0x0B))],
            id="Connections: the phone reaches the RVR by a port of its own",
        ),
    ],
)
def test_the_examples_of_the_document(
    start: End, source: int, target: int, hops: list[tuple[str, int, tuple[int, int]]]
) -> None:
    route = DOCUMENT.route(Place(*start), _addresses(source, target))
    assert (_hops(route), route.ending) == (hops, Ending.DELIVERED)


def test_first_step_of_the_table_map() -> None:
    """Nodes only know the first step: "if node c wants to send through port 2, it must go through node b"."""
    assert DOCUMENT.tables[Place("rvr", C)] == {
        Address(0, C): C,
        Address(0, B): B,
        Address(2, 0): B,
        Address(3, 0): B,
    }
    assert DOCUMENT.tables[Place("rvr", B)][Address(2, 0)] == B


def test_phone_and_pi_cannot_talk_through_the_robot() -> None:
    """Connections Between Key Elements: "not through the RVR"."""
    for target in range(0x100):
        route = DOCUMENT.route(Place("pi", A), _addresses(0x0A, target))
        assert "phone" not in {hop.place.system for hop in route.hops}


@pytest.mark.parametrize(
    ("target", "faults", "ending", "place"),
    [
        pytest.param(0x15, (), Ending.BAD_TARGET, ("rvr", B), id="no such node"),
        pytest.param(0x05, (), Ending.BAD_TARGET, ("pi", A), id="no such node in the sender's system"),
        pytest.param(0x7C, (), Ending.BAD_TARGET, ("pi", A), id="no such port"),
        pytest.param(0x1C, [("rvr", C)], Ending.UNAVAILABLE, ("rvr", B), id="disconnected, behind another"),
        pytest.param(0x1B, [("rvr", B)], Ending.UNAVAILABLE, ("pi", A), id="disconnected at the line"),
        pytest.param(0x1C, [("rvr", B)], Ending.UNAVAILABLE, ("pi", A), id="the node in between"),
    ],
)
def test_some_node_of_the_system_answers(target: int, faults: list[End], ending: Ending, place: End) -> None:
    """Packet Routing: "the sending node must receive Bad Target ID or Target Unavailable from some node"."""
    down = Faults(frozenset(Place(*end) for end in faults))
    route = DOCUMENT.route(Place("pi", A), _addresses(0x0A, target), down)
    assert (route.ending, route.place) == (ending, Place(*place))
    back = DOCUMENT.route(route.place, route.seen.answer_from(route.place.node), down)
    assert (back.ending, back.place) == (Ending.DELIVERED, Place("pi", A))


def test_a_port_without_a_line_is_unavailable() -> None:
    route = Topology(SYSTEMS, LINES[:1]).route(Place("rvr", C), _addresses(0x0C, 0x31))
    assert (route.ending, route.place) == (Ending.UNAVAILABLE, Place("rvr", B))


def test_another_node_may_be_the_one_that_answers() -> None:
    topology = DOCUMENT.with_system("rvr", SYSTEMS["rvr"]._replace(bad_target_from=C))
    route = topology.route(Place("pi", A), _addresses(0x0A, 0x15))
    assert (route.ending, route.place) == (Ending.BAD_TARGET, Place("rvr", C))
    back = topology.route(route.place, route.seen.answer_from(C))
    assert _hops(back)[-1] == ("pi", A, (0x1C, 0x0A))


def test_a_node_that_hangs_takes_a_packet_and_says_nothing() -> None:
    faults = Faults(hung=frozenset({Place("rvr", C)}))
    route = DOCUMENT.route(Place("pi", A), _addresses(0x0A, 0x1C), faults)
    assert (route.ending, route.place) == (Ending.LOST, Place("rvr", C))
    assert DOCUMENT.route(Place("pi", A), _addresses(0x0A, 0x1B), faults).ending is Ending.DELIVERED


@pytest.mark.parametrize(
    ("able", "passed"),
    [
        pytest.param({B, C}, [B], id="if it can handle it, it does"),
        pytest.param({C}, [B, C], id="otherwise, it passes the packet down the line"),
        pytest.param(set(), [B, C, B], id="no node can: the first one answers"),
    ],
)
def test_the_wildcard(able: set[int], passed: list[int]) -> None:
    """Sending Information via Channels, on node 0."""
    route = DOCUMENT.route(Place("pi", A), _addresses(0x0A, 0x10), serves=lambda place: place.node in able)
    assert [hop.place.node for hop in route.hops] == [A, *passed]
    assert route.ending is Ending.DELIVERED


def test_a_wildcard_is_held_up_by_a_node_that_is_unavailable() -> None:
    down = Faults(frozenset({Place("rvr", C)}))
    route = DOCUMENT.route(Place("pi", A), _addresses(0x0A, 0x10), down, lambda place: place.node == C)
    assert (route.ending, route.place) == (Ending.UNAVAILABLE, Place("rvr", B))


def test_without_a_target_a_packet_is_for_the_node_that_receives_it() -> None:
    route = DOCUMENT.route(Place("rvr", B), translate(Addresses(Address(0, A), None), 2))
    assert _hops(route) == [("rvr", B, (0x2A, None))]
    assert translate(Addresses(None, None), 2) == Addresses(None, None)


@pytest.mark.parametrize(
    ("systems", "lines", "why"),
    [
        pytest.param({"a": System(())}, [], "at least one", id="no node"),
        pytest.param({"a": System((1, 1))}, [], "different", id="a node twice"),
        pytest.param({"a": System((0,))}, [], "1 to 15", id="the wildcard as a node"),
        pytest.param({"a": System((1,), {16: 1})}, [], "1 to 15", id="a port above 15"),
        pytest.param({"a": System((1,), {1: 2})}, [], "no node 2", id="a port of no node"),
        pytest.param({"a": System((1,), {}, ((1, 3),))}, [], "no node 3", id="a channel to no node"),
        pytest.param({"a": System((1,), bad_target_from=4)}, [], "no node 4", id="answers come from no node"),
        pytest.param({"a": System((1, 2))}, [], "do not join", id="two nodes apart"),
        pytest.param(
            {"a": System((1,))}, [(Plug("a", 1), Plug("a", 2))], "no port 1", id="a line to no port"
        ),
        pytest.param(
            {"a": System((1,), {1: 1})}, [(Plug("a", 1), Plug("a", 1))], "two lines", id="a line to itself"
        ),
        pytest.param(
            {"a": System((1,), {1: 1}), "b": System((1,), {1: 1, 2: 1})},
            [(Plug("a", 1), Plug("b", 1)), (Plug("a", 1), Plug("b", 2))],
            "two lines",
            id="two lines at a port",
        ),
    ],
)
def test_a_network_that_is_none(systems: dict[str, System], lines: list[tuple[Plug, Plug]], why: str) -> None:
    with pytest.raises(ValueError, match=why):
        Topology(systems, lines)


@st.composite
def nets(draw: Callable[..., Any], *, trees: bool = False) -> Net:
    """Up to 4 systems with 6 nodes in all, joined by channels; lines between systems, and loose ports."""
    sizes = draw(st.lists(st.integers(1, 3), min_size=1, max_size=4).filter(lambda sizes: sum(sizes) <= 6))
    nodes: dict[str, tuple[int, ...]] = {}
    joined: set[tuple[str, int, int]] = set()
    for number, size in enumerate(sizes):
        name = f"system {number}"
        own = draw(st.lists(st.integers(1, 15), min_size=size, max_size=size, unique=True))
        nodes[name] = tuple(own)
        pairs = {(own[draw(st.integers(0, at - 1))], own[at]) for at in range(1, size)}
        if not trees and size > 2 and draw(st.booleans()):
            pairs.add((own[0], own[2]) if (own[0], own[2]) not in pairs else (own[1], own[2]))
        joined |= {(name, *pair) for a, b in pairs for pair in ((a, b), (b, a))}
    owners: dict[End, int] = {}

    def port(name: str) -> End:
        free = [number for number in range(1, 16) if (name, number) not in owners]
        end = (name, draw(st.sampled_from(free)))
        owners[end] = draw(st.sampled_from(nodes[name]))
        return end

    names = list(nodes)
    wanted = [pair for pair in pairwise(names) if draw(st.booleans())]
    wanted += draw(st.lists(st.tuples(st.sampled_from(names), st.sampled_from(names)), max_size=3))
    lines = tuple((port(one), port(other)) for one, other in wanted if one != other)
    for name in draw(st.lists(st.sampled_from(names), max_size=2)):
        port(name)
    return Net(nodes, owners, frozenset(joined), lines)


def _topology(net: Net) -> Topology:
    systems = {
        name: System(
            own,
            {port: node for (system, port), node in net.owners.items() if system == name},
            tuple((a, b) for system, a, b in sorted(net.joined) if system == name and a < b),
        )
        for name, own in net.nodes.items()
    }
    return Topology(systems, [(Plug(*one), Plug(*other)) for one, other in net.lines])


def _senders(net: Net) -> list[End]:
    return [(name, node) for name, own in net.nodes.items() for node in own]


def _are_joined(net: Net, one: Place, other: Place) -> bool:
    if one.system == other.system:
        return (one.system, one.node, other.node) in net.joined
    return any(
        net.owners[a] == one.node and net.owners[b] == other.node
        for line in net.lines
        for a, b in (line, line[::-1])
        if (a[0], b[0]) == (one.system, other.system)
    )


@given(nets())
def test_every_packet_goes_where_a_second_model_says(net: Net) -> None:
    topology = _topology(net)
    for sender in _senders(net):
        for target in (port << 4 | node for port in range(16) for node in range(1, 16)):
            route = topology.route(Place(*sender), _addresses(sender[1], target))
            wanted = expected(net, sender, target)
            assert (route.ending.value, route.place) == (wanted.ending, Place(*wanted.at))
            assert len(route.hops) - 1 == wanted.steps
            assert all(_bytes(hop.seen) == wanted.bytes_in[hop.place.system] for hop in route.hops)
            assert all(_are_joined(net, a.place, b.place) for a, b in pairwise(route.hops))
            back = topology.route(route.place, route.seen.answer_from(route.place.node))
            assert (back.ending, back.place) == (Ending.DELIVERED, Place(*sender))
            assert _bytes(back.seen)[1] == sender[1]


@given(nets(trees=True), st.data())
def test_with_nodes_down_the_sender_still_hears_from_a_node(net: Net, data: st.DataObject) -> None:
    topology, senders = _topology(net), _senders(net)
    sender = data.draw(st.sampled_from(senders))
    others = [end for end in senders if end != sender]
    down = data.draw(st.sets(st.sampled_from(others))) if others else set()
    faults = Faults(frozenset(Place(*end) for end in down))
    for target in (port << 4 | node for port in range(16) for node in range(1, 16)):
        route = topology.route(Place(*sender), _addresses(sender[1], target), faults)
        passed = way(net, sender, target)
        broken = next((at for at, end in enumerate(passed) if end in down), None)
        reached = passed if broken is None else passed[:broken]
        assert [hop.place for hop in route.hops] == [Place(*end) for end in reached]
        ending = expected(net, sender, target).ending if broken is None else "target unavailable"
        assert route.ending.value == ending
        back = topology.route(route.place, route.seen.answer_from(route.place.node), faults)
        assert (back.ending, back.place) == (Ending.DELIVERED, Place(*sender))
