"""Collects evidence from a built-in robot on the virtual clock."""

from asyncio import Event
from functools import cache

from sphero_probe.link.policy import Consent
from sphero_probe.probing.collecting import Collecting, CollectingOptions
from sphero_probe.probing.evidence import Evidence
from sphero_probe.probing.open_questions import settlements
from sphero_probe.probing.settling.settlement import Settlement
from sphero_probe.session.session import open_session
from tests.support.virtual_clock import run


@cache
def collect(address: str, *, idle: float = 0.0) -> Evidence:
    """Run evidence on ``fake:`` and the address."""

    async def work() -> Evidence:
        async with open_session(f"fake:{address}", Consent()) as session:
            return await Collecting(session, Event(), CollectingOptions("fake", idle)).run()

    return run(work())


def settled(evidence: Evidence) -> dict[str, Settlement]:
    """Return what some evidence says, by the key of the question."""
    return {question.key: said for question, said in settlements(evidence)}
