"""A run that forgets most of its findings says at its end what it would say with all of them."""

from collections.abc import Sequence
from typing import Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue import lookup
from sphero_probe.catalogue.risk import Risk
from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.link.exchange import Answered, Blocked, Exchange, Silent
from sphero_probe.probing.comparison import comparisons
from sphero_probe.probing.finding import Confidence, Finding, Outcome
from sphero_probe.probing.kept_findings import KeptFindings
from sphero_probe.probing.notes import unavailable_notes
from sphero_probe.probing.plan import Plan, Probe
from sphero_probe.probing.readings import EXPECTED
from sphero_probe.probing.verification import ABSENT_SHARE, is_verified
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation, Response, Verdict

CODEC: Final = CODECS[Generation.V2]
CODES: Final = {CODEC.verdict(code): code for code in range(15, -1, -1)}
OUTCOMES: Final = {
    Verdict.OK: Outcome.EXISTS,
    Verdict.BAD_LENGTH: Outcome.EXISTS,
    Verdict.NO_DEVICE: Outcome.ABSENT,
    Verdict.NO_COMMAND: Outcome.ABSENT,
    Verdict.TARGET_UNAVAILABLE: Outcome.INCONCLUSIVE,
}
PAIRS: Final = [
    (row.did, row.cid)
    for row in (
        row_for(CODEC.generation, what)
        for what in (WellKnown.CLAIMED_DEVICES, WellKnown.CLAIMED_COMMANDS, WellKnown.ECHO)
    )
    if row
]
DIDS: Final = (0x13, 0x20)


def finding(number: int, command: Command, said: Verdict | Outcome, payload: bytes = b"") -> Finding:
    exchange: Exchange
    if isinstance(said, Verdict):
        outcome = OUTCOMES[said]
        response = Response(1, CODES[said], payload, command.did, command.cid, command.target)
        exchange = Answered(command, 1, b"", response, b"", 0.1)
    elif said is Outcome.SKIPPED:
        outcome, exchange = said, Blocked(command, Risk.WRITE, "")
    else:
        outcome, exchange = said, Silent(command, 1, b"", 0.1)
    known = lookup(CODEC.generation, command.did, command.cid, None)
    attempts = 0 if isinstance(exchange, Blocked) else 1
    return Finding(
        number, command, outcome, Confidence.CERTAIN, Risk.PROBE, exchange, known, attempts=attempts
    )


def commands(pairs: st.SearchStrategy[tuple[int, int]]) -> st.SearchStrategy[Command]:
    payloads = st.sampled_from([b"", *(bytes([did]) for did in DIDS)])
    return st.builds(
        lambda pair, payload, target: Command(pair[0], pair[1], payload, target),
        pairs,
        payloads,
        st.sampled_from([0x11, 0x12]),
    )


SAID: Final[st.SearchStrategy[Verdict | Outcome]] = st.sampled_from(
    [*OUTCOMES, Outcome.SILENT, Outcome.SKIPPED]
)
LISTS: Final = st.lists(st.sampled_from([*DIDS, *range(3)]), min_size=1, max_size=4).map(bytes)
CLAIMS: Final = st.tuples(commands(st.sampled_from(PAIRS)), st.just(Verdict.OK), LISTS)
ASKED: Final = st.tuples(commands(st.tuples(st.sampled_from(DIDS), st.integers(0, 2))), SAID, LISTS)
RUNS: Final = st.lists(CLAIMS | ASKED, min_size=20, max_size=80).map(
    lambda probes: [finding(number, *one) for number, one in enumerate(probes, 1)]
)


@pytest.mark.parametrize("verify", [False, True])
@given(found=RUNS, begin=st.integers(0, 80), changed=st.sets(st.integers(1, 80)))
def test_the_end_of_a_run_is_the_same(
    found: Sequence[Finding], begin: int, changed: set[int], *, verify: bool
) -> None:
    plan = Plan("test", "", [[]], verify=verify)
    whole, kept = KeptFindings(plan, CODEC), KeptFindings(plan, CODEC)
    for at, one in enumerate(found):
        if at == begin:
            kept.begin(0)
        whole.add(one)
        kept.add(one)
    kept.begin(0)
    if verify:
        assert list(filter(is_verified, kept)) == list(filter(is_verified, whole))
    for one in found:  # as the end of a run does: silent probes are answered late, others contradicted
        if one.number in changed and (one.outcome is Outcome.SILENT or (verify and is_verified(one))):
            new = one._replace(outcome=Outcome.INCONCLUSIVE)
            assert kept.get(one.number) == whole.get(one.number) == one
            whole.replace(one, new)
            kept.replace(one, new)
    assert +kept.counts == +whole.counts
    assert kept.sent == whole.sent
    assert unavailable_notes(kept, CODEC, None) == unavailable_notes(whole, CODEC, None)
    assert list(comparisons(plan, kept, kept.absent(), CODEC)) == list(
        comparisons(plan, whole, whole.absent(), CODEC)
    )


@pytest.mark.parametrize(
    ("said", "note", "verify", "is_kept"),
    [
        pytest.param(Verdict.NO_COMMAND, "", False, False, id="absent"),
        pytest.param(Verdict.NO_COMMAND, "", True, False, id="absent and not verified"),
        pytest.param(Verdict.OK, "", False, False, id="exists"),
        pytest.param(Verdict.OK, "", True, True, id="exists and is verified"),
        pytest.param(Verdict.OK, EXPECTED, False, True, id="a notification may tell more"),
        pytest.param(Outcome.SKIPPED, "", True, False, id="skipped"),
        pytest.param(Outcome.SILENT, "", False, True, id="may be answered late"),
        pytest.param(Outcome.INCONCLUSIVE, "", False, True, id="so may this"),
        pytest.param(Verdict.TARGET_UNAVAILABLE, "", False, True, id="becomes a note"),
    ],
)
def test_which_findings_are_kept(said: Verdict | Outcome, note: str, *, verify: bool, is_kept: bool) -> None:
    one = finding(ABSENT_SHARE + 1, Command(0x13, 0x70), said)._replace(note=note)
    kept = KeptFindings(Plan("test", "", [[]], verify=verify), CODEC)
    kept.add(one)
    kept.begin(0)
    assert list(kept) == [one] * is_kept
    assert (kept.counts[one.outcome], kept.sent) == (1, one.attempts)


def test_all_are_kept_for_a_stage_that_is_made_from_them() -> None:
    plan = Plan("test", "", [[], lambda found: [Probe(one.command) for one in found], []])
    kept = KeptFindings(plan, CODEC)
    kept.begin(0)
    several = [finding(number, Command(0x13, number), Verdict.NO_COMMAND) for number in (2, 1)]
    for one in several:
        kept.add(one)
    assert (kept.for_stage(0), kept.for_stage(1)) == ((), several[::-1])
    kept.begin(1)
    assert list(kept) == []
    assert (kept.for_stage(2), kept.counts) == ((), {Outcome.ABSENT: 2})


def test_all_are_kept_where_the_end_names_the_absent() -> None:
    plan = Plan("test", "", [[]], claimed_by="a source")
    kept = KeptFindings(plan, CODEC)
    kept.begin(0)
    for number in (1, 2):
        kept.add(finding(number, Command(0x13, number), Verdict.NO_COMMAND))
    (note,) = comparisons(plan, kept, kept.absent(), CODEC)
    assert note.text.endswith("0x13:0x01, 0x13:0x02")
