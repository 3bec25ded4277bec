"""How much work one probe costs, in calls: it is prepared once and judged once."""

import asyncio
from collections import Counter
from typing import TYPE_CHECKING, Any

import pytest

from sphero_probe.catalogue import commands
from sphero_probe.link import policy as policy_module
from sphero_probe.link.link import Link
from sphero_probe.link.policy import Consent, Policy
from sphero_probe.probing import prober as prober_module
from sphero_probe.probing import results as results_module
from sphero_probe.probing.engine import Engine
from sphero_probe.probing.finding import Finding, Record
from sphero_probe.probing.plan import Plan, sweep
from sphero_probe.protocol import CODECS
from sphero_probe.simulator import FakeRobot, parse_settings
from sphero_probe.transports.fake import FakeTransport
from tests.support.virtual_clock import run as run_on_virtual_clock

if TYPE_CHECKING:
    from collections.abc import Callable

PROBES = 256


class Recorded:
    """A recorder that counts what it is given."""

    def __init__(self) -> None:
        self.findings: Counter[int] = Counter()

    def intend(self, _: object) -> None:
        pass

    def record(self, record: Record) -> None:
        if isinstance(record, Finding):
            self.findings[record.number] += 1


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """Count the calls of what a probe might do more often than needed."""
    counted: Counter[str] = Counter()

    def count(home: Any, name: str, word: str) -> None:
        inner: Callable[..., Any] = getattr(home, name)

        def counting(*arguments: Any, **named: Any) -> Any:
            counted[word] += 1
            return inner(*arguments, **named)

        monkeypatch.setattr(home, name, counting)

    count(prober_module, "lookup", "lookups")
    count(Policy, "_evaluate", "assessments")
    count(commands, "rows_of", "row scans")
    count(policy_module, "rows_of", "row scans")
    count(results_module, "finding_of", "judgements")
    return counted


def test_a_probe_is_prepared_and_judged_once(calls: Counter[str]) -> None:
    robot = FakeRobot(parse_settings("bolt"))
    codec = CODECS[robot.model.generation]
    recorder = Recorded()
    tasks = 0
    before: Counter[str] = Counter()

    async def work() -> None:
        nonlocal tasks

        def factory(loop: asyncio.AbstractEventLoop, coroutine: Any, **named: Any) -> "asyncio.Task[Any]":
            nonlocal tasks
            tasks += 1
            return asyncio.Task(coroutine, loop=loop, **named)

        policy = Policy(codec.generation, robot.model, Consent(), (robot.name,))
        async with Link(FakeTransport(robot), codec, policy) as link:
            plan = Plan("test", "", [list(sweep([0x13], range(PROBES)))])
            engine = Engine(plan, link, robot.name, 0x11, recorder=recorder)
            async for record in engine.records():
                if not before and isinstance(record, Finding):
                    before.update(calls)
                if not tasks:
                    asyncio.get_running_loop().set_task_factory(factory)

    run_on_virtual_clock(work())
    assert recorder.findings == Counter(range(1, PROBES + 1))
    assert calls["lookups"] == PROBES
    assert calls["judgements"] == PROBES
    assert calls["assessments"] - before["assessments"] <= PROBES
    assert calls["row scans"] - before["row scans"] <= 2 * PROBES
    assert 0 < tasks <= 1.2 * PROBES
