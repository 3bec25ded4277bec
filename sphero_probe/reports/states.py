"""Says in a phrase what is known about a command: its state, as scripts and people read it."""

from typing import Final

from sphero_probe.probing.finding import Outcome
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Verdict
from sphero_probe.reports import phrases
from sphero_probe.reports.phrases import Data, shown

BLOCKED: Final = "blocked"
EXISTS: Final = {
    Verdict.BAD_LENGTH: "exists, wrong length",
    Verdict.BAD_VALUE: "exists, wrong value",
    Verdict.FAILED: "exists, failed",
    Verdict.RESTRICTED: "exists, not in this state",
    Verdict.NOT_IMPLEMENTED: "exists, not implemented",
}
"""What an answer other than success says about a command that exists."""
STATES: Final = (
    Outcome.EXISTS.value,
    *EXISTS.values(),
    Outcome.ABSENT.value,
    Outcome.SILENT.value,
    BLOCKED,
    Outcome.SENT.value,
    Outcome.INCONCLUSIVE.value,
)
"""All states."""
_VERDICTS: Final = {
    codec.code_name(code): codec.verdict(code) for codec in CODECS.values() for code in range(0x100)
}
"""The name of a code -> what it says; no name says one thing in V1 and another in V2 (a test compares)."""


def state(data: Data) -> str:
    """Return the state of a command, one of ``STATES``; an unknown outcome as it is."""
    word = shown(data.get("outcome"))
    if word == Outcome.SKIPPED:
        return BLOCKED
    if word == Outcome.EXISTS:
        verdict = _VERDICTS.get(shown(data.get("code_name")))
        return EXISTS.get(verdict, word) if verdict else word
    return word


def state_and_answer(data: Data) -> str:
    """Return the state of a command with what it answered: ``exists: percentage 87 %``."""
    word = state(data)
    if not word.startswith(Outcome.EXISTS):
        return phrases.outcome(data)
    return ": ".join(filter(None, (word, phrases.content(data))))
