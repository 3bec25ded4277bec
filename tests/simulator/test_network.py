"""The nodes of a fake robot as its client sees them: which one answers, and from which address."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue import ROBOTS
from sphero_probe.errors import BadInputFileError, UsageError
from sphero_probe.protocol.packets import Command, Response
from sphero_probe.protocol.v2 import V2, V2Codec
from sphero_probe.simulator import Executed, FakeRobot, Settings, parse_settings, parse_topology
from sphero_probe.simulator.firmware import SHARED_DEVICES
from tests.support.fake_robot import Said, ask, code_of, fake, said_by, tell
from tests.support.narrowing import every
from tests.support.reference_topology import Net, expected

ECHO = (0x10, 0x00)
DRIVE_READ = (0x16, 0x06)
"""Only node 2 of an RVR has it."""
BATTERY = (0x13, 0x10)
"""Only node 1 has it."""


def _answers(robot: FakeRobot, target: int | None, now: float = 0.0) -> list[tuple[int, int | None]]:
    """Code and source of what a robot answers to an echo."""
    said = tell(robot, Command(*ECHO, b"", target), now=now)
    return [(packet.code, packet.source) for packet in said if isinstance(packet, Response)]


@pytest.mark.parametrize(
    ("settings", "target", "answers"),
    [
        pytest.param("rvr", 0x11, [(0x00, 1)], id="node 1"),
        pytest.param("rvr", 0x12, [(0x00, 2)], id="node 2"),
        pytest.param("rvr", 0x15, [(0x09, 1)], id="no node 5: the node at the port says so"),
        pytest.param("rvr?bad_target_from=1", 0x15, [(0x09, 1)], id="no node 5: node 1 says so"),
        pytest.param("rvr?bad_target_from=2", 0x15, [(0x09, 2)], id="no node 5: node 2 says so"),
        pytest.param("rvr?line=uart&bad_target_from=2", 0x05, [(0x09, 2)], id="over the UART, too"),
        pytest.param("rvr?unavailable=2", 0x12, [(0x0A, 1)], id="node 2 unavailable: node 1 says so"),
        pytest.param("rvr?unavailable=2", 0x11, [(0x00, 1)], id="node 1 beside it"),
        pytest.param("rvr?unavailable=2", 0x15, [(0x09, 1)], id="no node 5 beside it"),
        pytest.param(
            "rvr?unavailable=2&bad_target_from=2", 0x15, [(0x0A, 1)], id="the one that would say so"
        ),
        pytest.param("rvr?die=2@0s", 0x12, [], id="node 2 hangs"),
        pytest.param("rvr?die=2@0s", 0x11, [(0x00, 1)], id="node 1 beside it"),
        pytest.param("rvr?die=1@0s", 0x12, [], id="node 2 behind a node that hangs"),
        pytest.param("bolt-plus", 0x12, [(0x09, 1)], id="BOLT+ has one node"),
        pytest.param("bolt?unavailable=2", 0x12, [(0x0A, 1)], id="BOLT"),
    ],
)
def test_who_answers(settings: str, target: int, answers: list[tuple[int, int]]) -> None:
    assert _answers(fake(settings), target) == answers


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        pytest.param("rvr?unavailable=1", "no other node could answer for it", id="the node at the port"),
        pytest.param("rvr?unavailable=2,3", "no node 3; there are 1, 2", id="unavailable"),
        pytest.param("rvr?bad_target_from=4", "no node 4", id="bad_target_from"),
        pytest.param("rvr?die=3@1s", "no node 3", id="die"),
        pytest.param("bolt-plus?line=uart", "bolt-plus has no UART", id="line"),
        pytest.param("bb8?line=uart", "bb8 has no UART", id="line of a V1 robot"),
    ],
)
def test_a_node_or_a_line_that_the_robot_does_not_have(settings: str, words: str) -> None:
    with pytest.raises(UsageError, match=words):
        fake(settings)


def test_an_unavailable_node_holds_up_the_wildcard_and_sends_nothing() -> None:
    robot = fake("rvr?unavailable=2")
    assert code_of(robot, *DRIVE_READ, node=0) == 0x0A
    assert code_of(robot, *BATTERY, node=0) == 0x00
    stream = Command(0x18, 0x3C, b"\x00\x96", 0x12)
    assert [packet.code for packet in every(Response, tell(robot, stream))] == [0x0A]
    assert said_by(robot, 5.0) == []


def test_a_node_hangs_while_the_other_answers() -> None:
    robot = fake("rvr?die=2@30s")
    stream = [Command(0x18, 0x39, bytes.fromhex("01 0006 02"), 0x12), Command(0x18, 0x3A, b"\x01\xf4", 0x12)]
    assert [said.code for one in stream for said in every(Response, tell(robot, one, now=100.0))] == [0, 0]
    assert _answers(robot, 0x12, 101.0) == [(0, 2)]
    assert len(said_by(robot, 129.9)) > 50
    assert said_by(robot, 200.0)[1:] == []
    assert (_answers(robot, 0x12, 200.0), _answers(robot, 0x11, 200.0)) == ([], [(0, 1)])


def test_what_a_hung_node_was_told_is_not_executed() -> None:
    ran: list[object] = []
    robot = fake("rvr?die=2@0s", ran.append)
    tell(robot, Command(0x16, 0x06, b"", 0x12))
    assert ran == []


@pytest.mark.parametrize(
    ("line", "split", "longest"),
    [("ble", "", 20), ("uart", "", 53), ("uart", "&split=4", 4)],
    ids=["BLE notifications", "a UART sends frames whole", "unless it is told to split"],
)
def test_pieces_of_a_line(line: str, split: str, longest: int) -> None:
    robot = fake(f"rvr?line={line}{split}")
    robot.hear(V2.encode_command(Command(0x1A, 0x44, b"", 0x11), 7), now=0.0)
    robot.hear(V2.encode_command(Command(0x10, 0x00, bytes(16), 0x11), 8), now=0.0)
    chunks = robot.speak(now=1.0)
    assert max(map(len, chunks)) <= longest
    assert (len(chunks) == 2) == (line == "uart" and not split)


def test_the_truth_tells_the_nodes_as_without_trouble() -> None:
    assert fake("rvr?unavailable=2&line=uart&die=2@1s").truth() == fake("rvr").truth()


ROBOT = {"nodes": [1, 2, 7], "ports": {"3": 2}, "channels": [[1, 2], [2, 7]]}
SYSTEMS = {"robot": ROBOT, "pi": {"nodes": [10], "ports": {"1": 10}}}
FILE = {
    "systems": SYSTEMS,
    "lines": [["pi:1", "robot:3"]],
    "client": "pi:1",
}


def _wired(document: object, settings: Settings | None = None) -> FakeRobot:
    wiring = parse_topology(json.dumps(document), "net.json")
    return FakeRobot(settings or parse_settings("rvr"), wiring=wiring)


def test_a_file_says_which_nodes_there_are() -> None:
    robot = _wired(FILE)
    assert [_answers(robot, target) for target in (0x11, 0x12, 0x17, 0x13)] == [
        [(0, 1)],
        [(0, 2)],
        [(0, 7)],
        [(9, 2)],
    ]
    assert _answers(robot, None) == [(0, None)]
    plain = {(fact.node, fact.did, fact.cid) for fact in fake("rvr").truth()}
    added = {(fact.node, fact.did, fact.cid) for fact in robot.truth()} - plain
    both = {(did, cid) for node, did, cid in plain if node == 1 and (2, did, cid) in plain}
    assert added == {(7, did, cid) for did, cid in both if did in SHARED_DEVICES}


def test_a_node_that_the_file_leaves_out_is_not_there() -> None:
    systems = {**SYSTEMS, "robot": {"nodes": [2], "ports": {"3": 2}}}
    robot = _wired({**FILE, "systems": systems})
    assert {fact.node for fact in robot.truth()} == {2}
    assert (_answers(robot, 0x11), _answers(robot, 0x12)) == ([(9, 2)], [(0, 2)])
    assert ask(robot, *DRIVE_READ, node=0).code == 0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        pytest.param({"systems": []}, '"systems" is an object', id="systems as a list"),
        pytest.param({"system": {}}, "no 'system'; there are client, lines, systems", id="a misspelt key"),
        pytest.param({"client": None}, 'such as "robot:1"', id="no client"),
        pytest.param({"client": "robot:9"}, "no line is plugged in", id="a client that is not plugged in"),
        pytest.param({"lines": [["pi:1"]]}, "list of pairs", id="a line with one end"),
        pytest.param({"lines": [["pi:1", "robot:x"]]}, "a whole number is wanted", id="a port in letters"),
        pytest.param({"systems": {"a": {"nodes": [True]}}}, "not True", id="a node that is a truth value"),
        pytest.param({"systems": {"a": {"nodes": 1}}}, '"nodes" is a list', id="nodes as a number"),
        pytest.param({"systems": {"a": {"nodes": [1, 2]}}}, "channels do not join", id="nodes apart"),
    ],
)
def test_a_file_that_is_no_topology(change: dict[str, object], words: str) -> None:
    with pytest.raises(BadInputFileError, match=words):
        parse_topology(json.dumps({**FILE, **change}), "net.json")


@given(
    st.text(max_size=60),
    st.recursive(st.none() | st.integers() | st.text(max_size=4), st.lists, max_leaves=8),
)
def test_any_text_is_a_topology_or_a_bad_file(text: str, value: object) -> None:
    for document in (text, json.dumps(value), json.dumps({**FILE, "systems": value})):
        with pytest.raises(BadInputFileError):
            parse_topology(document, "net.json")


@st.composite
def _stars(draw: Callable[..., Any]) -> Net:
    """A robot of up to 4 nodes, joined as a tree; the client at a port, another system at another."""
    nodes = draw(st.lists(st.integers(1, 15), min_size=1, max_size=4, unique=True))
    pairs = {(draw(st.sampled_from(nodes[:at])), nodes[at]) for at in range(1, len(nodes))}
    port, other = draw(st.lists(st.integers(1, 15), min_size=2, max_size=2, unique=True))
    client = draw(st.integers(1, 15))
    owners = {("robot", port): draw(st.sampled_from(nodes)), ("robot", other): draw(st.sampled_from(nodes))}
    return Net(
        {"robot": tuple(nodes), "client": (client,), "other": (1,)},
        {**owners, ("client", 1): client, ("other", 1): 1},
        frozenset(("robot", *pair) for a, b in pairs for pair in ((a, b), (b, a))),
        ((("client", 1), ("robot", port)), (("robot", other), ("other", 1))),
    )


def _document(net: Net) -> dict[str, object]:
    return {
        "systems": {
            name: {
                "nodes": list(own),
                "ports": {str(port): node for (system, port), node in net.owners.items() if system == name},
                "channels": [[a, b] for system, a, b in sorted(net.joined) if system == name and a < b],
            }
            for name, own in net.nodes.items()
        },
        "lines": [[f"{system}:{port}" for system, port in line] for line in net.lines],
        "client": "client:1",
    }


@given(_stars())
def test_the_bytes_on_the_line_are_those_of_a_second_model(net: Net) -> None:
    """Each side writes the addresses as it sees them; neither translates for the other."""
    robot = _wired(_document(net))
    (client,) = net.nodes["client"]
    ((_, (_, port)), _) = net.lines
    for node in range(1, 16):
        wanted = expected(net, ("client", client), 0x10 | node)
        robot.hear(V2Codec().encode_command(Command(*ECHO, b"", 0x10 | node), 7, source=client), now=0.0)
        said: list[Said] = said_by(robot, 0.0)
        code = {"delivered": 0x00, "bad target": 0x09}[wanted.ending]
        assert [(packet.target, packet.source) for packet in said] == [(port << 4 | client, wanted.at[1])]
        assert [packet.code for packet in every(Response, said)] == [code]


def test_a_topology_file_in_an_address(tmp_path: Path) -> None:
    path = tmp_path / "net.json"
    path.write_text(json.dumps(FILE), encoding="utf-8")
    assert parse_settings(f"rvr?topology={path}") == Settings(ROBOTS["rvr"], topology=str(path))


@pytest.mark.parametrize("node", [1, 2])
def test_a_long_command_is_forwarded_whole(node: int) -> None:
    """The maker lets nodes in between limit forwarded data, and names no limit: none is made up here."""
    ran: list[Executed] = []
    payload = bytes(range(256)) * 2
    ask(fake("rvr?strict=none", ran.append), *ECHO, payload, node=node)
    assert [(one.node, one.payload) for one in ran] == [(node, payload)]
