"""Runs that meet trouble, on a virtual clock: their journal replays what the robot did, silences included."""

from pathlib import Path

import pytest

from sphero_probe.link.policy import Consent
from sphero_probe.probing.engine import Engine
from sphero_probe.probing.finding import Finding
from sphero_probe.probing.plan import Plan, sweep
from sphero_probe.runs.resume import RunJournal
from sphero_probe.session.session import open_session
from tests.support.virtual_clock import run as run_on_virtual_clock

PLAN = Plan("test", "", [list(sweep([0x13], range(0x30)))])


def found(device: str, journal: Path | None = None) -> list[tuple[object, ...]]:
    """What the findings of a run say, by number."""
    findings: list[Finding] = []

    async def work() -> None:
        consent = Consent()
        with RunJournal("sweep", file=str(journal) if journal else None, off=journal is None) as kept:
            async with open_session(device, consent) as session:
                kept.begin(session.connection, PLAN, consent, None)
                run = Engine(
                    PLAN,
                    session.link,
                    session.connection.name,
                    session.target,
                    recorder=kept,
                    reconnect=session.reconnect,
                )
                findings.extend([record async for record in run.records() if isinstance(record, Finding)])

    run_on_virtual_clock(work())
    last = {finding.number: finding for finding in findings}
    return [
        (one.command, one.outcome, one.confidence, one.risk, one.name, one.code, one.payload, one.note)
        for _, one in sorted(last.items())
    ]


@pytest.mark.parametrize(
    "settings",
    [
        "bolt-plus?silent=0x13:0x10,0x13:0x30",
        "bolt?latency=80ms",
        "rvr?loss=0.05&seed=2",
        "mini?busy=0.1&seed=4",
        "bolt-plus?interval=30ms&duplicate=0.1&reorder=0.1",
    ],
)
def test_a_replayed_run_finds_the_same(tmp_path: Path, settings: str) -> None:
    journal = tmp_path / "run.jsonl"
    before = found(f"fake:{settings}", journal)
    assert len(before) == 0x30
    assert found(f"replay:{journal}") == before
    assert found(f"replay:{journal}?speed=0") == before
