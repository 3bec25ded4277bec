"""The oracle: on random robots with every kind of trouble, each finding is true or says it does not know."""

import random
from collections import Counter

import pytest

from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.link import Link
from sphero_probe.link.policy import Consent, Policy
from sphero_probe.probing.engine import Engine
from sphero_probe.probing.finding import Finding, Note, Outcome, Record, Summary
from sphero_probe.probing.notes import EXECUTED
from sphero_probe.probing.plan import Plan, sweep
from sphero_probe.probing.plans.discovery import discovery
from sphero_probe.protocol import CODECS
from sphero_probe.simulator import Executed, FakeRobot, parse_settings
from sphero_probe.simulator.firmware import Firmware
from sphero_probe.transports.fake import FakeTransport
from tests.support.virtual_clock import run as run_on_virtual_clock

ROBOTS = 304
"""Random robots in all, in groups that the test runner can share out."""
GROUPS = 16
MODELS = ("bolt", "bolt-plus", "mini", "rvr", "r2d2", "bb9e", "bb8", "ollie")
FIRST = ("bb8", "ollie")
CIDS = range(0x30)


def random_robot(chance: random.Random) -> str:
    """An address of a robot with some of the trouble that there is."""
    keys = {"seed": str(chance.randrange(10_000)), "hidden": str(chance.randrange(12))}
    keys["strict"] = chance.choices(("exact", "minimum", "none"), (8, 1, 1))[0]
    keys["mask"] = chance.choice(("0", "0", "0", "1", "0x13", "0x19,0x02"))
    keys["claims"] = chance.choice(("true", "partial", "lying", "none"))
    trouble = {
        "loss": f"{chance.uniform(0, 0.05):.3f}",
        "duplicate": f"{chance.uniform(0, 0.2):.3f}",
        "reorder": f"{chance.uniform(0, 0.3):.3f}",
        "busy": f"{chance.uniform(0, 0.1):.3f}",
        "latency": f"{chance.choice((5, 40, 300, 1200))}ms",
        "sleep_after": f"{chance.choice((1, 3, 20))}s",
        "disconnect_after": str(chance.choice((60, 150, 400))),
        "reboot_on": f"0x{chance.choice((0x13, 0x02)):02x}:0x{chance.randrange(0x30):02x}",
        "queue": chance.choice(("2", "2&overflow=busy")),
    }
    if trouble["reboot_on"] == "0x13:0x0d":
        del trouble["reboot_on"]  # it would reboot each time it is woken, and answer nothing
    keys |= {key: trouble[key] for key in chance.sample(sorted(trouble), chance.randrange(4))}
    return f"{chance.choice(MODELS)}?" + "&".join(f"{key}={value}" for key, value in keys.items())


def is_stop(command: Executed) -> bool:
    """Whether this stopped the motors, as a run does after a command accepted a wrong length."""
    pair = command.did, command.cid
    return pair in ((0x02, 0x30), (0x16, 0x01)) and not any(command.payload)


def ask(
    settings: str, *, timeout: float | None = None, whole: bool = False
) -> tuple[FakeRobot, list[Record], list[Executed]]:
    """Sweep two devices of a robot, or discover them by all stages, on the virtual clock."""
    executed: list[Executed] = []
    robot = FakeRobot(parse_settings(settings), on_execute=executed.append)
    codec = CODECS[robot.model.generation]
    policy = Policy(codec.generation, robot.model, Consent(), (robot.name,))
    records: list[Record] = []
    dids = (0x00, 0x02) if settings.startswith(FIRST) else (0x13, 0x19)

    async def work() -> None:
        import asyncio
        from contextlib import AsyncExitStack

        async with AsyncExitStack() as line:
            link = await line.enter_async_context(Link(FakeTransport(robot), codec, policy, timeout=timeout))

            async def reconnect() -> Link:
                await line.aclose()
                robot.connect(now=asyncio.get_running_loop().time())
                return await line.enter_async_context(
                    Link(FakeTransport(robot), codec, policy, timeout=timeout)
                )

            target = 0x11 if robot.model.addressed else None
            plan = Plan("oracle", "", [list(sweep(dids, CIDS))], verify=True)
            if whole:
                plan = discovery(codec.generation, target, dids=dids)
            run = Engine(plan, link, robot.name, target, reconnect=reconnect)
            records.extend([record async for record in run.records()])

    run_on_virtual_clock(work())
    return robot, records, executed


SLOW = pytest.mark.slow
"""The first few go through all the code there is; measuring the others costs time."""


@pytest.mark.parametrize(
    "group", [*range(2), *(pytest.param(group, marks=SLOW) for group in range(2, GROUPS))]
)
def test_every_finding_is_true_or_says_inconclusive(group: int) -> None:
    for index in range(group, ROBOTS, GROUPS):
        settings = random_robot(random.Random(index))
        robot, records, executed = ask(settings, timeout=1.0 if index % 8 == 0 else None)
        truth = {(fact.did, fact.cid) for fact in robot.truth() if fact.node == 1}
        last: dict[int, Finding] = {}
        for record in records:
            if isinstance(record, Finding):
                last[record.number] = record
        summary = next(record for record in records if isinstance(record, Summary))
        surprised = [record for record in records if isinstance(record, Note) and record.kind == EXECUTED]
        given_up = [record for record in records if isinstance(record, Note) and "state" in record.data]
        assert summary.complete is not bool(surprised or given_up), settings
        assert not given_up or "latency=1200ms" in settings, settings  # answers to echoes are late, too
        assert len(last) == 2 * len(CIDS), settings
        for finding in last.values():
            exists = finding.command[:2] in truth
            if finding.outcome is Outcome.EXISTS:
                assert exists or finding.confidence.value == "maybe", (settings, finding)
            elif finding.outcome is Outcome.ABSENT:
                assert not exists, (settings, finding)
            else:
                assert finding.outcome in (Outcome.SKIPPED, Outcome.INCONCLUSIVE), (settings, finding)
        assert {command.risk for command in executed if not is_stop(command)} <= {Risk.READ}, settings
        assert surprised or not any(map(is_stop, executed)), settings
        counts = Counter(finding.outcome for finding in last.values())
        asked = sum(counts.values()) - counts[Outcome.SKIPPED]
        if "strict=exact" in settings and "mask=0&" in f"{settings}&" and asked > 20:
            assert counts[Outcome.INCONCLUSIVE] <= max(1, 0.01 * asked), (settings, counts)


DISCOVERIES = 36


@pytest.mark.parametrize(
    "index",
    [
        *range(1000, 1004),
        *(pytest.param(index, marks=SLOW) for index in range(1004, 1000 + DISCOVERIES)),
    ],
)
def test_a_full_discovery_is_true_too(index: int) -> None:
    settings = random_robot(random.Random(index))
    robot, records, executed = ask(settings, whole=True)
    truth = {(fact.node, fact.did, fact.cid) for fact in robot.truth()}
    last = {record.number: record for record in records if isinstance(record, Finding)}
    assert len(last) >= 2 * 256, settings
    for finding in last.values():
        triple = triple_of(finding)
        if finding.outcome is Outcome.EXISTS:
            assert triple in truth, (settings, finding)
        elif finding.outcome is Outcome.ABSENT:
            assert triple not in truth, (settings, finding)
    assert {command.risk for command in executed if not is_stop(command)} <= {Risk.READ}, settings
    check_differences(settings, robot, list(last.values()), records)


def triple_of(finding: Finding) -> tuple[int, int, int]:
    target = finding.command.target
    return 1 if target is None else target & 0x0F, finding.command.did, finding.command.cid


def check_differences(
    settings: str, robot: FakeRobot, findings: list[Finding], records: list[Record]
) -> None:
    """Compare hidden, ghost and unknown with what the robot has and what it claims."""
    notes = [record for record in records if isinstance(record, Note) and record.kind == "comparison"]
    said: dict[str, set[tuple[int, int, int]]] = {"hidden": set(), "ghost": set(), "unknown": set()}
    for note in notes:
        for word, triples in said.items():
            listed = note.data[word]
            assert isinstance(listed, list)
            triples |= {((pair["target"] or 1) & 0x0F, pair["did"], pair["cid"]) for pair in listed}
    exists = {triple_of(finding): finding for finding in findings if finding.outcome is Outcome.EXISTS}
    absent = {triple_of(finding) for finding in findings if finding.outcome is Outcome.ABSENT}
    assert said["unknown"] == {triple for triple, found in exists.items() if found.knowledge is None}, (
        settings
    )
    claims: dict[int, set[tuple[int, int]]] = {}
    unlisted: dict[int, set[int]] = {}
    firmware = Firmware(parse_settings(settings))
    for node in {node for node, _, _ in exists}:
        dids = firmware.claimed_devices(node)
        if (node, 0x10, 0x05) in exists and robot.model.generation.value == "v2":
            asked = {
                finding.command.payload[0]
                for finding in findings
                if triple_of(finding) == (node, 0x10, 0x06)
                and finding.command.payload
                and finding.code_name == "success"
            }
            claims[node] = {(did, cid) for did in asked for cid in firmware.claimed_commands(node, did)}
            unlisted[node] = set(dids) - asked
    hidden = {
        (node, did, cid)
        for node, did, cid in exists
        if node in claims and (did, cid) not in claims[node] and did not in unlisted[node]
    }
    ghosts = {(node, *pair) for node, pairs in claims.items() for pair in pairs if (node, *pair) in absent}
    assert said["hidden"] == hidden, settings
    assert ghosts <= said["ghost"], settings
    truth = {(fact.node, fact.did, fact.cid) for fact in robot.truth()}
    assert not said["ghost"] & truth, settings


def test_the_same_robot_gives_the_same_run() -> None:
    settings = random_robot(random.Random(3))
    first, second = ask(settings)[1], ask(settings)[1]
    words = [(f.number, f.outcome, f.code_name) for f in first if isinstance(f, Finding)]
    assert words == [(f.number, f.outcome, f.code_name) for f in second if isinstance(f, Finding)]
