"""The state of a command in words, against the meaning of the codes in the documents."""

import pytest

from sphero_probe.probing.finding import Outcome
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Generation
from sphero_probe.reports.states import STATES, state, state_and_answer


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        pytest.param(0x00, "exists", id="success"),
        pytest.param(0x03, "exists, not implemented", id="not-yet-implemented"),
        pytest.param(0x04, "exists, not in this state", id="restricted"),
        pytest.param(0x05, "exists, wrong length", id="bad-data-length"),
        pytest.param(0x06, "exists, failed", id="failed"),
        pytest.param(0x07, "exists, wrong value", id="bad-parameter-value"),
    ],
)
def test_the_codes_of_the_official_document(code: int, expected: str) -> None:
    data = {"outcome": "exists", "code": code, "code_name": CODECS[Generation.V2].code_name(code)}
    assert state(data) == expected
    assert expected in STATES


def test_a_name_of_a_code_says_the_same_in_both_generations() -> None:
    said: dict[str, set[object]] = {}
    for codec in CODECS.values():
        for code in range(0x100):
            said.setdefault(codec.code_name(code), set()).add(codec.verdict(code))
    assert {name: verdicts for name, verdicts in said.items() if len(verdicts) > 1} == {}


@pytest.mark.parametrize("outcome", Outcome)
def test_every_outcome_has_a_state(outcome: Outcome) -> None:
    word = state({"outcome": outcome.value, "code_name": None})
    assert word in STATES
    assert word == ("blocked" if outcome is Outcome.SKIPPED else outcome.value)


def test_a_wrong_length_is_never_the_whole_word_for_a_command_that_is_there() -> None:
    data = {"outcome": "exists", "code": 5, "code_name": "bad data length", "payload": ""}
    assert state_and_answer(data) == "exists, wrong length"
    assert state_and_answer(data | {"outcome": "inconclusive"}) == "bad data length"
