"""Select which probes are sent again at the end of a run, and compare their findings."""

from typing import Final

from sphero_probe.probing.finding import Finding, Outcome

ABSENT_SHARE: Final = 20
"""One in so many absent commands is verified."""


def is_verified(finding: Finding) -> bool:
    """Whether a verifying run sends this probe again: what exists or was silent, and some of the absent."""
    if finding.outcome is Outcome.ABSENT:
        return finding.number % ABSENT_SHARE == 0
    return finding.outcome in (Outcome.EXISTS, Outcome.SILENT)


def contradiction(old: Finding, new: Finding) -> Finding | None:
    """Return the inconclusive finding that replaces the old one, None if both agree.

    The values in an answer may change; its code may not.
    """
    if (old.outcome, old.code_name) == (new.outcome, new.code_name):
        return None
    said = f"answered {_word(old)} first, then {_word(new)}"
    return old._replace(outcome=Outcome.INCONCLUSIVE, note=said)


def _word(finding: Finding) -> str:
    return finding.code_name or finding.outcome.value
