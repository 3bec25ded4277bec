"""How far a run says that it is, on the virtual clock: against the time that it then really takes."""

import asyncio
from collections.abc import Sequence
from typing import NamedTuple

import pytest

from sphero_probe.link.link import Link
from sphero_probe.link.policy import Consent, Policy
from sphero_probe.probing.engine import Engine
from sphero_probe.probing.plan import Plan, Probe, Stage, sweep
from sphero_probe.probing.plans.discovery import discovery
from sphero_probe.probing.progress import CALIBRATING, VERIFYING, WAITING, Progress
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation
from sphero_probe.simulator import FakeRobot, parse_settings
from sphero_probe.transports.fake import FakeTransport
from tests.support.virtual_clock import run

SLOW = "bolt?interval=30ms&per_event=4"
SWEEP = Plan("sweep", "", [list(sweep(range(0x10, 0x18), range(256)))])
EVERY = 0.1
"""Seconds between two looks."""


class Look(NamedTuple):
    """How far the run was, and how long it then still took."""

    progress: Progress
    left: float


def looks(settings: str, plan: Plan) -> list[Look]:
    robot = FakeRobot(parse_settings(settings))
    codec = CODECS[robot.model.generation]
    seen: list[tuple[float, Progress]] = []

    async def work() -> None:
        now = asyncio.get_running_loop().time
        policy = Policy(codec.generation, robot.model, Consent(), (robot.name,))
        async with Link(FakeTransport(robot), codec, policy) as link:
            engine = Engine(plan, link, robot.name, 0x11)

            async def watch() -> None:
                while True:
                    seen.append((now(), engine.progress()))
                    await asyncio.sleep(EVERY)

            watching = asyncio.create_task(watch())
            async for _ in engine.records():
                pass
            seen.append((now(), engine.progress()))
            watching.cancel()
            await asyncio.wait([watching])

    run(work())
    end = seen[-1][0]
    return [Look(progress, end - at) for at, progress in seen]


@pytest.fixture(scope="module")
def discovered() -> list[Look]:
    return looks(SLOW, discovery(Generation.V2, 0x11, dids=range(0x10, 0x1C)))


@pytest.fixture(scope="module")
def swept() -> list[Look]:
    return looks(f"{SLOW}&hidden=3&silent=0x15:0x50", SWEEP)


@pytest.fixture(params=["discovered", "swept"])
def run_seen(request: pytest.FixtureRequest) -> list[Look]:
    seen: list[Look] = request.getfixturevalue(request.param)
    return seen


def test_it_never_goes_back_and_ends_at_the_total(run_seen: list[Look]) -> None:
    done = [look.progress.done for look in run_seen]
    assert done == sorted(done)
    assert all(look.progress.done <= look.progress.total for look in run_seen)
    last = run_seen[-1].progress
    assert last.done == last.total > 2000
    assert last.seconds_left == 0.0
    assert done[0] == 0


def test_the_total_is_known_long_before_the_end(discovered: list[Look]) -> None:
    whole = discovered[0].left
    unknown = [look.left for look in discovered if not look.progress.is_total_known]
    assert min(unknown) > 0.5 * whole
    later = [look.progress.total for look in discovered if look.left < 0.5 * whole]
    assert max(later) - min(later) < 0.02 * later[-1]


@pytest.mark.parametrize(
    ("seen", "share"),
    [
        pytest.param("discovered", 0.6, id="discovery"),
        pytest.param("swept", 0.3, id="sweep"),  # before, the silent command was not sent yet
    ],
)
def test_the_time_left_is_near_the_truth(seen: str, share: float, request: pytest.FixtureRequest) -> None:
    run_seen: list[Look] = request.getfixturevalue(seen)
    whole = run_seen[0].left
    for progress, left in run_seen:
        if left < share * whole:
            assert progress.seconds_left is not None
            assert abs(progress.seconds_left - left) < 0.12 * whole, (progress, left)


def test_stages_are_named_in_order(discovered: list[Look]) -> None:
    named = [(look.progress.number, look.progress.stage) for look in discovered]
    order = [name for name in dict.fromkeys(named) if name[1] != CALIBRATING]
    expected = ["identity", "own list", "nodes", "devices", "commands", VERIFYING, WAITING]
    places = [expected.index(name) for _, name in order]
    assert places == sorted(places)
    assert {"devices", "commands", VERIFYING} <= {name for _, name in order}
    assert {number for number, name in order if name in (VERIFYING, WAITING)} == {6}
    assert all(look.progress.stages == 6 for look in discovered)
    assert named[0] == (1, CALIBRATING)


def test_verifying_counts(discovered: list[Look]) -> None:
    verifying = [look for look in discovered if look.progress.stage == VERIFYING]
    assert verifying[0].left > 0.2 * discovered[0].left  # long enough to be missed if it did not count
    before = next(look for look in reversed(discovered) if look.progress.stage == "commands")
    assert before.progress.total - before.progress.done > 100


def test_it_counts_what_exists_and_what_is_new(swept: list[Look]) -> None:
    robot = FakeRobot(parse_settings(f"{SLOW}&hidden=3&silent=0x15:0x50"))
    facts = {
        (fact.did, fact.cid): fact for fact in robot.truth() if fact.node == 1 and 0x10 <= fact.did < 0x18
    }
    hidden = sum(fact.hidden for fact in facts.values())
    last = swept[-1].progress
    assert hidden > 0
    assert last.new == hidden
    assert hidden < last.exist < len(facts)  # others are blocked


def test_waiting_for_late_answers_is_announced(swept: list[Look]) -> None:
    waiting = [look for look in swept if look.progress.stage == WAITING]
    assert waiting[0].left > 1.0
    for progress, left in waiting:
        assert progress.seconds_left == pytest.approx(left, abs=0.3)
    assert swept[-1].progress.stages == 1


def ask_more(_: Sequence[object]) -> list[Probe]:
    return [Probe(Command(0x13, 0x10))]


@pytest.mark.parametrize(
    ("stages", "names", "expected"),
    [
        pytest.param([[], []], (), ["mine", "mine"], id="plan"),
        pytest.param([[], ask_more], (), ["mine", "ask more"], id="function"),
        pytest.param([ask_more, ask_more], ("first",), ["first", "ask more"], id="some"),
        pytest.param([lambda _: [], []], (), ["mine", "mine"], id="lambda"),
    ],
)
def test_a_stage_without_a_name_gets_one(
    stages: list[Stage], names: tuple[str, ...], expected: list[str]
) -> None:
    plan = Plan("mine", "", stages, stage_names=names)
    assert [plan.stage_name(index) for index in range(len(stages))] == expected
