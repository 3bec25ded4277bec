"""How often a silent probe is sent again, and what its silence proves in the end."""

from collections.abc import Sequence
from math import ceil, log

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.exchange import Answered, Silent
from sphero_probe.probing.attempt import PreparedProbe, ProbeResult
from sphero_probe.probing.retries import (
    _DOUBT,
    FALSE_SILENCES,
    LEAST_ATTEMPTS,
    LOSSY,
    MOST_ATTEMPTS,
    NOT_ITSELF,
    ONCE,
    STOPPED,
    LossEstimate,
    SettledProbe,
    SilentProbe,
    no_result,
    silence,
)
from sphero_probe.protocol.packets import Command, Response

COMMAND = Command(0x13, 0x10)
SILENT = Silent(COMMAND, 7, b"sent", 1.0)
ANSWERED = Answered(COMMAND, 7, b"sent", Response(7, 0x00, b"", 0x13, 0x10), b"received", 2.0)


def prepared(risk: Risk = Risk.PROBE) -> PreparedProbe:
    return PreparedProbe(1, COMMAND, risk, None, "")


def loss(learned: Sequence[int] = (), probes: int = 0) -> LossEstimate:
    made = LossEstimate()
    made.probes = probes
    for attempts in learned:
        made.learn(attempts)
    return made


ATTEMPTS = st.lists(st.integers(1, 12), max_size=60)
PROBES = st.integers(0, 100_000)


def test_before_anything_is_known() -> None:
    assert LEAST_ATTEMPTS <= loss().attempts_wanted <= MOST_ATTEMPTS
    assert loss(probes=1000).attempts_wanted == ceil(log(FALSE_SILENCES / 1000, 1 / _DOUBT))


def test_a_link_that_loses_nothing() -> None:
    assert loss([1] * 10_000, probes=1).attempts_wanted == LEAST_ATTEMPTS


def test_a_link_that_loses_half() -> None:
    """Half are lost: each attempt halves the doubt, and 1000 probes need a millionth."""
    lossy = loss([2] * 1_000_000, probes=1000)
    assert lossy.attempts_wanted == ceil(log(FALSE_SILENCES / 1000, 0.5))


def test_a_short_run_that_lost_few_may_have_been_lucky() -> None:
    """Three of 240 lost may be one in eighty, but as well the double: then three silences are no proof."""
    lucky = loss([1] * 234 + [2] * 3, probes=256)
    assert lucky.attempts_wanted == ceil(log(FALSE_SILENCES / 256, 1 / 40)) == 4
    assert loss([1] * 240, probes=256).attempts_wanted == 3


def test_a_link_that_loses_nearly_everything_wants_too_many_attempts() -> None:
    assert loss([12] * 1000, probes=1000).attempts_wanted > MOST_ATTEMPTS


@given(ATTEMPTS, PROBES)
def test_attempts_wanted_have_bounds(learned: list[int], probes: int) -> None:
    wanted = loss(learned, probes).attempts_wanted
    assert isinstance(wanted, int)
    assert LEAST_ATTEMPTS <= wanted < 10_000


@given(ATTEMPTS.filter(bool), st.integers(0, 59), PROBES)
def test_the_more_is_lost_the_more_attempts_are_wanted(learned: list[int], place: int, probes: int) -> None:
    worse = [attempts + (number == place % len(learned)) for number, attempts in enumerate(learned)]
    assert loss(worse, probes).attempts_wanted >= loss(learned, probes).attempts_wanted


@given(ATTEMPTS, st.integers(1, 50), PROBES)
def test_answers_at_the_first_attempt_want_no_more_attempts(
    learned: list[int], count: int, probes: int
) -> None:
    better = [*learned, *[1] * count]
    assert loss(better, probes).attempts_wanted <= loss(learned, probes).attempts_wanted


@given(ATTEMPTS, PROBES, PROBES)
def test_the_more_probes_the_more_attempts_are_wanted(learned: list[int], some: int, others: int) -> None:
    few, many = sorted((some, others))
    assert loss(learned, few).attempts_wanted <= loss(learned, many).attempts_wanted


@given(st.integers(0, 90), st.integers(1, 20_000))
def test_as_many_attempts_as_make_false_silences_rare(percent_lost: int, probes: int) -> None:
    """Of commands that are answered, hardly one is silent that often in a whole run."""
    answered, lost = 10_000, round(10_000 * percent_lost / (100 - percent_lost))
    each, over = divmod(lost, answered)
    wanted = loss([each + 1] * (answered - over) + [each + 2] * over, probes).attempts_wanted
    rate = lost / (answered + lost)
    assert probes * rate**wanted <= FALSE_SILENCES * 1.05
    if wanted > LEAST_ATTEMPTS:  # and no more than needed, but for the doubt
        assert probes * (rate + 0.002) ** (wanted - 1) > FALSE_SILENCES * 0.5


@given(ATTEMPTS, PROBES, st.integers(0, 20), st.integers(1, 20))
def test_when_sending_again_proves_nothing_new(
    learned: list[int], probes: int, confirmed: int, attempts: int
) -> None:
    known = loss(learned, probes)
    unanswered = SilentProbe(prepared(), SILENT, attempts, confirmed)
    enough = confirmed >= known.attempts_wanted
    assert unanswered.is_final(known) == (enough or attempts >= MOST_ATTEMPTS)
    word = unanswered.settle(known, "")
    assert word == SettledProbe(prepared(), ProbeResult(SILENT, attempts), "" if enough else LOSSY)


SURE, UNSURE = 1000, 0
"""Confirmed silences: more than any link needs, and fewer."""


@pytest.mark.parametrize(
    ("confirmed", "risk", "doubt", "interrupted", "word"),
    [
        pytest.param(SURE, Risk.PROBE, "", "", "", id="silent"),
        pytest.param(SURE, Risk.PROBE, "", STOPPED, "", id="silent, then stopped"),
        pytest.param(SURE, Risk.MOTION, "", "", "", id="silent, whatever its class"),
        pytest.param(UNSURE, Risk.READ, "", "", LOSSY, id="sent too seldom"),
        pytest.param(UNSURE, Risk.WRITE, "", "", LOSSY, id="sent too seldom, may be repeated"),
        pytest.param(UNSURE, Risk.MOTION, "", "", ONCE, id="must not be repeated"),
        pytest.param(UNSURE, Risk.MOTION, "", STOPPED, STOPPED, id="stopped, must not be repeated"),
        pytest.param(UNSURE, Risk.READ, "", STOPPED, STOPPED, id="stopped"),
        pytest.param(UNSURE, Risk.READ, NOT_ITSELF, STOPPED, NOT_ITSELF, id="given up, then stopped"),
        pytest.param(SURE, Risk.READ, NOT_ITSELF, "", NOT_ITSELF, id="given up"),
    ],
)
def test_how_a_silent_probe_ends(confirmed: int, risk: Risk, doubt: str, interrupted: str, word: str) -> None:
    unanswered = SilentProbe(prepared(risk), SILENT, 3, confirmed, None, doubt)
    assert unanswered.settle(loss(), interrupted) == SettledProbe(
        prepared(risk), ProbeResult(SILENT, 3), word
    )


@pytest.mark.parametrize("confirmed", [SURE, UNSURE])
@pytest.mark.parametrize("doubt", ["", NOT_ITSELF])
@pytest.mark.parametrize("interrupted", ["", STOPPED])
def test_a_late_answer_settles_the_probe(confirmed: int, doubt: str, interrupted: str) -> None:
    unanswered = SilentProbe(prepared(), SILENT, 3, confirmed, ANSWERED, doubt)
    assert unanswered.settle(loss(), interrupted) == SettledProbe(prepared(), ProbeResult(ANSWERED, 3))


def test_a_probe_of_which_nothing_is_known() -> None:
    probe = prepared()
    assert silence(probe) == Silent(COMMAND, 0, b"", 0.0)
    assert no_result(probe, 2) == ProbeResult(silence(probe), 2)
