"""What ``nodes`` finds is the truth of the simulator, and a route is as the vendor's description has it."""

import asyncio
import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from random import Random

import pytest

from sphero_probe.catalogue import ROBOTS
from sphero_probe.catalogue.model import AnswerStyle
from sphero_probe.catalogue.routing import Route, documented_hops
from sphero_probe.link.events import FrameSent, UnsolicitedReceived
from sphero_probe.link.exchange import Silent, Unsolicited
from sphero_probe.link.policy import Consent
from sphero_probe.probing.engine import Engine
from sphero_probe.probing.finding import Finding, Note, Outcome, Record, Summary
from sphero_probe.probing.nodes import survey
from sphero_probe.probing.plan import Plan, Probe
from sphero_probe.probing.plans.discovery import discovery
from sphero_probe.probing.system import NodeState, System
from sphero_probe.protocol.address import Address
from sphero_probe.protocol.packets import Command, Generation, Request, Response, Role
from sphero_probe.protocol.v2 import V2
from sphero_probe.session.session import open_session
from sphero_probe.simulator import FakeRobot, parse_settings
from sphero_probe.transports.fake import FakeTransport
from tests.support.narrowing import only
from tests.support.virtual_clock import run

ADDRESSED = [key for key, robot in ROBOTS.items() if robot.addressed]
STYLES = {AnswerStyle.SWAPPED: "swapped", AnswerStyle.SOURCE_ONLY: "SID only", AnswerStyle.NONE: "none"}


def surveyed(address: str) -> System:
    async def work() -> System:
        async with open_session(f"fake:{address}", Consent()) as session:
            return await survey(session)

    return run(work())


def random_address(random: Random) -> str:
    keys = {
        "seed": random.randrange(1000),
        "loss": random.choice(["0", "0.02", "0.05", "0.1"]),
        "claims": random.choice(["true", "partial", "none"]),
        "split": random.choice([1, 20]),
        "busy": random.choice(["0", "0.05"]),
    }
    model = random.choice(ADDRESSED)
    if len(ROBOTS[model].nodes) > 1 and random.random() < 0.4:
        keys["unavailable"] = 2
    if random.random() < 0.5:
        keys["bad_target_from"] = 1
    if model.startswith("rvr"):
        keys["line"] = random.choice(["ble", "uart"])
    return f"{model}?" + "&".join(f"{key}={value}" for key, value in keys.items())


@pytest.mark.unmeasured
@pytest.mark.parametrize("batch", range(10))
def test_it_names_the_truth_of_random_robots(batch: int) -> None:
    random = Random(batch)
    for _ in range(20):
        address = random_address(random)
        system = surveyed(address)
        robot = FakeRobot(parse_settings(address))
        truth = robot.truth()
        model = robot.model
        assert system.addressing == STYLES[model.answer_style], address
        uart, away = "line=uart" in address, {2} if "unavailable=2" in address else set()
        assert system.line == ("UART" if uart else "BLE")
        swapped = model.answer_style is AnswerStyle.SWAPPED
        assert system.client == ((0x21 if uart else 0x11) if swapped else None), address
        targets = [one.target for one in system.nodes]
        assert len(set(targets)) == len(targets) == (17 if uart else 33)
        assert any(one.served for one in system.nodes), address
        for one in system.nodes:
            node = 0 if one.target is None else Address.from_byte(one.target).node
            there = NodeState.ANSWERS if node == 0 or node in model.nodes else NodeState.ABSENT
            assert one.state is (NodeState.UNAVAILABLE if node in away else there), (address, one)
            if "bad_target_from=1" in address and one.state is NodeState.ABSENT:
                assert one.answered_by in (1, None), (address, one)
            if one.claimed:
                devices = {fact.did for fact in truth if fact.node == node}
                assert set(one.devices) <= devices
                assert set(one.devices) == devices or "claims=partial" in address, (address, one)
            for served in one.served:
                if served.node is not None:
                    pair = (served.row.did, served.row.cid)
                    nodes = {fact.node for fact in truth if (fact.did, fact.cid) == pair} - away
                    assert served.node == min(nodes), (address, served)


@pytest.mark.parametrize("key", [key for key, robot in ROBOTS.items() if not robot.addressed])
def test_a_robot_without_addresses_is_one_line(key: str) -> None:
    system = surveyed(key)
    assert system.nodes == ()
    assert system.note.startswith(f"{ROBOTS[key].name} has no nodes to ask: ")


def without_node_2(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have node 1 answer 0x0A for node 2, until the second wake."""
    write = FakeTransport.write
    woken: list[Request] = []

    async def intercepted(line: FakeTransport, data: bytes) -> None:
        request = only(Request, V2.decoder(Role.ROBOT).feed(data))
        command = request.command
        if command[:2] == (0x13, 0x0D):
            woken.append(request)
        away = command.target is not None and Address.from_byte(command.target).node == 2
        if not away or len(woken) > 1:
            await write(line, data)
            return
        said = Response(request.seq, 0x0A, b"", command.did, command.cid, 0x01, 0x11, 0x08)
        line._ready.append(V2.encode_response(said))
        line._woken.set()

    monkeypatch.setattr(FakeTransport, "write", intercepted)


def test_an_unavailable_node_stays_in_the_map() -> None:
    nodes = {one.target: one for one in surveyed("rvr?unavailable=2").nodes}
    assert nodes[0x12].state is NodeState.UNAVAILABLE
    assert (nodes[0x12].code, nodes[0x12].answered_by) == (0x0A, 0x01)
    assert nodes[0x12].devices == (0x10, 0x11, 0x16, 0x18)  # the RVR's ST, by the catalogue
    assert not nodes[0x12].claimed
    assert nodes[0x11].state is NodeState.ANSWERS


def test_a_node_that_is_woken_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    without_node_2(monkeypatch)
    nodes = {one.target: one for one in surveyed("rvr").nodes}
    assert nodes[0x12].state is NodeState.ANSWERS


@pytest.mark.unmeasured
def test_discover_lists_what_an_unavailable_node_was_not_asked() -> None:
    async def work() -> list[object]:
        async with open_session("fake:rvr?unavailable=2", Consent()) as session:
            plan = discovery(Generation.V2, 0x11, dids=[0x13])
            engine = Engine(plan, session.link, "RV", 0x11, reconnect=session.reconnect)
            return [record async for record in engine.records()]

    records = run(work())
    (ending,) = [record for record in records if isinstance(record, Summary)]
    assert not ending.complete
    (note,) = [record for record in records if isinstance(record, Note) and record.kind == "run"]
    assert note.data == {
        "target": 0x12,
        "state": "unavailable",
        "devices_not_asked": [0x10, 0x11, 0x16, 0x18],
    }
    assert note.text.startswith(
        "secondary (0x12) is there, but unavailable (0x0a): its devices were not asked: "
    )
    found = {finding.command.target: finding for finding in records if isinstance(finding, Finding)}
    asked = {target for target in found if target is not None}
    assert asked == set(range(0x11, 0x20))  # nodes 1 to 15
    assert found[0x12].outcome is Outcome.INCONCLUSIVE
    assert found[0x12].answered_by == 0x01
    assert found[0x13].outcome is Outcome.ABSENT


def test_a_sweep_of_node_2_wakes_node_1_first(tmp_path: Path) -> None:
    """A sleeping robot takes only 0x13:0x0D, which the RVR's node 1 has [spherov2: RVR, processor 1].

    It sleeps after five idle minutes, so it is asleep as one when the sweep of node 2 begins.
    """
    ledger = tmp_path / "ledger"
    heard: list[Unsolicited] = []

    async def work() -> list[Record]:
        async with open_session(f"fake:rvr?sleep_after=300s&ledger={ledger}", Consent()) as session:
            session.link.events.subscribe(lambda event: heard.append(event.unsolicited), UnsolicitedReceived)
            await asyncio.sleep(400)
            assert heard[-1][:2] == (0x13, 0x1A), "it did not say that it fell asleep"
            assert isinstance(await session.link.ask(Command(0x10, 0x00, b"", 0x12)), Silent)
            probes = [Probe(Command(0x16, cid, b"", 0x12)) for cid in range(256)]
            plan = Plan("drive", "", [probes])
            engine = Engine(plan, session.link, "RV", 0x12, reconnect=session.reconnect)
            return [record async for record in engine.records()]

    records = run(work())
    executed = [json.loads(line) for line in ledger.read_text().splitlines()]
    assert [(one["node"], one["did"], one["cid"]) for one in executed[:1]] == [(1, 0x13, 0x0D)]
    truth = {fact.cid for fact in FakeRobot(parse_settings("rvr")).truth() if fact[:2] == (2, 0x16)}
    findings = [record for record in records if isinstance(record, Finding)]
    asked = {finding.command.cid: finding for finding in findings if finding.outcome is not Outcome.SKIPPED}
    assert len(findings) == 256
    exist = {cid for cid, finding in asked.items() if finding.outcome is Outcome.EXISTS}
    assert exist == truth & asked.keys() != set()
    assert {finding.outcome for cid, finding in asked.items() if cid not in exist} == {Outcome.ABSENT}
    assert next(record for record in records if isinstance(record, Summary)).complete


def test_the_example_of_the_vendors_description() -> None:
    """ "Sending Information via Channels" and "Behind the Scenes": 0a -> 1c, and how it is translated."""
    a, b, c = 0xA, 0xB, 0xC
    hops = documented_hops(Route(client=a, out=1, into=2, gateway=b, node=c))
    told = [(hop.packet, " ".join(f"{one.byte:02x}" for one in (*hop.before, *hop.after))) for hop in hops]
    assert told == [
        ("command", "1c 0a 1c 0a"),
        ("command", "1c 0a 0c 2a"),
        ("command", "0c 2a 0c 2a"),
        ("answer", "0c 2a 2a 0c"),
        ("answer", "2a 0c 2a 0c"),
        ("answer", "2a 0c 0a 1c"),
    ]
    assert [hop.visible for hop in hops] == [True, False, False, False, False, True]


def test_a_node_that_holds_the_port_needs_no_table() -> None:
    assert len(documented_hops(Route(1, 1, 1, 1, 1))) == 4


def test_stopping_ends_it() -> None:
    async def work() -> System:
        async with open_session("fake:rvr", Consent()) as session:
            stop = asyncio.Event()
            asyncio.get_running_loop().call_later(0.001, stop.set)
            return await survey(session, stop)

    assert {one.state for one in run(work()).nodes} <= {NodeState.SILENT, NodeState.ANSWERS, NodeState.ABSENT}


def hang(monkeypatch: pytest.MonkeyPatch, node: int, after: int) -> list[Command]:
    """Have a node say nothing more, once it was asked so often; return what the others get."""
    write = FakeTransport.write
    asked: list[Request] = []
    others: list[Command] = []

    async def intercepted(line: FakeTransport, data: bytes) -> None:
        request = only(Request, V2.decoder(Role.ROBOT).feed(data))
        target = request.command.target
        if target is not None and Address.from_byte(target).node == node:
            asked.append(request)
            if len(asked) > after:
                return
        else:
            others.append(request.command)
        await write(line, data)

    monkeypatch.setattr(FakeTransport, "write", intercepted)
    return others


@pytest.mark.parametrize("after", [60, 100, 140])
def test_a_node_that_hangs_leaves_the_verdicts_of_the_other(
    monkeypatch: pytest.MonkeyPatch, after: int
) -> None:
    others = hang(monkeypatch, 2, after)
    probes = [Probe(Command(0x11, cid, b"", target)) for cid in range(0x80) for target in (0x11, 0x12)]

    async def work() -> list[Record]:
        async with open_session("fake:rvr", Consent()) as session:
            plan = Plan("both", "", [probes])
            engine = Engine(plan, session.link, "RV", 0x11, reconnect=session.reconnect)
            return [record async for record in engine.records()]

    records = run(work())
    truth = {(fact.node, fact.cid) for fact in FakeRobot(parse_settings("rvr")).truth() if fact.did == 0x11}
    found = {record.number: record for record in records if isinstance(record, Finding)}
    assert len(found) == len(probes)
    inconclusive = 0
    for finding in found.values():
        node = Address.from_byte(finding.command.target or 0).node
        exists = (node, finding.command.cid) in truth
        if node == 2 and finding.outcome is Outcome.INCONCLUSIVE:
            inconclusive += 1
        elif finding.outcome is not Outcome.SKIPPED:
            assert finding.outcome is (Outcome.EXISTS if exists else Outcome.ABSENT), finding
    assert inconclusive
    unknown = Counter(
        command.cid
        for command in others
        if command.did == 0x11 and len(command.payload) == 11 and command.cid < 0x80
    )
    assert len(unknown) > 50
    assert sum(unknown.values()) <= len(unknown) + 4, "what the other node answered was not asked again"
    (note,) = [record for record in records if isinstance(record, Note) and record.kind == "run"]
    assert (note.data["target"], note.data["state"]) == (0x12, "hung")
    assert note.text.startswith("secondary stopped answering as before after 20")
    assert not next(record for record in records if isinstance(record, Summary)).complete


def test_a_node_that_answers_nothing_is_given_up_soon() -> None:
    async def work() -> tuple[list[Record], float]:
        async with open_session("fake:rvr?die=2@1ms&latency=15ms", Consent()) as session:
            probes = [Probe(Command(0x16, cid, b"", 0x12)) for cid in range(256)]
            probes += [Probe(Command(0x11, cid, b"", 0x11)) for cid in range(8)]
            engine = Engine(
                Plan("drive", "", [probes]), session.link, "RV", 0x11, reconnect=session.reconnect
            )
            clock = asyncio.get_running_loop()
            began = clock.time()
            records = [record async for record in engine.records()]
            return records, clock.time() - began

    records, seconds = run(work())
    assert seconds < 60
    found = {record.number: record for record in records if isinstance(record, Finding)}
    assert len(found) == 264
    assert {found[number].outcome for number in range(1, 257)} == {Outcome.SKIPPED, Outcome.INCONCLUSIVE}
    others = {found[number].outcome for number in range(257, 265)}
    assert others == {Outcome.EXISTS, Outcome.ABSENT, Outcome.SKIPPED}
    (note,) = [record for record in records if isinstance(record, Note) and record.kind == "run"]
    assert note.text == "secondary does not answer: its open probes are inconclusive"
    assert not next(record for record in records if isinstance(record, Summary)).complete


def test_a_node_that_was_given_up_is_asked_nothing_more(monkeypatch: pytest.MonkeyPatch) -> None:
    hang(monkeypatch, 2, 100)
    frames: list[bytes] = []

    def later(findings: Sequence[Finding]) -> list[Probe]:
        assert findings[-1].outcome is Outcome.INCONCLUSIVE
        frames.clear()
        return [Probe(Command(did, cid, b"", 0x12)) for did in (0x16, 0x18) for cid in range(8)]

    async def work() -> list[Record]:
        async with open_session("fake:rvr", Consent()) as session:
            session.link.events.subscribe(lambda event: frames.append(event.frame), FrameSent)
            first = [Probe(Command(0x11, cid, b"", 0x12)) for cid in range(0x80)]
            plan = Plan("two stages", "", [first, later])
            engine = Engine(plan, session.link, "RV", 0x11, reconnect=session.reconnect)
            return [record async for record in engine.records()]

    records = run(work())
    requests = [only(Request, V2.decoder(Role.ROBOT).feed(frame)) for frame in frames]
    assert 0x12 not in {request.command.target for request in requests}
    second = [record for record in records if isinstance(record, Finding) and record.number > 0x80]
    assert len(second) == 16
    assert {finding.outcome for finding in second} <= {Outcome.INCONCLUSIVE, Outcome.SKIPPED}
