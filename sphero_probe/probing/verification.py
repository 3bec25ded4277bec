"""Which findings are sent again at the end of a run, and whether they say the same."""

from typing import Final

from sphero_probe.probing.finding import Finding, Outcome

ABSENT_SHARE: Final = 20
"""One in so many absent commands is verified."""


def is_verified(finding: Finding) -> bool:
    """Whether a verifying run sends this one again: what exists or was silent, and a part of the absent."""
    if finding.outcome is Outcome.ABSENT:
        return finding.number % ABSENT_SHARE == 0
    return finding.outcome in (Outcome.EXISTS, Outcome.SILENT)


def contradiction(old: Finding, new: Finding) -> Finding | None:
    """Return the inconclusive finding that replaces the old one, None where both say the same.

    A value may have changed meanwhile; its code may not.
    """
    if (old.outcome, old.code_name) == (new.outcome, new.code_name):
        return None
    said = f"answered {_word(old)} first, then {_word(new)}"
    return old._replace(outcome=Outcome.INCONCLUSIVE, note=said)


def _word(finding: Finding) -> str:
    return finding.code_name or finding.outcome.value
