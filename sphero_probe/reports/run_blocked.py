"""Writes what a run blocked: folded to a line for each class, or each reason with its commands."""

import re
from collections import Counter
from collections.abc import Iterable
from typing import Final

from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.policy import flag_for
from sphero_probe.probing.finding import Outcome
from sphero_probe.reports.finding_line import FindingLine, ids
from sphero_probe.reports.ids import spans

NAMED_AT_MOST: Final = 6
"""Blocked commands of one reason that are shown with their names; of more, only the ids are shown."""
_DOTTED_NAME: Final = re.compile(r"\b[a-z]\w*\.[a-z]\w*\b", re.ASCII)
_NOT_ASKED: Final = re.compile(
    rf"(?<=: ){_DOTTED_NAME.pattern}(?:: documented, not (?:asked|sent)(?: at a wrong length)?)?(?= \()",
    re.ASCII,
)
"""A reason that is only a name, or a name and that it was not asked."""


def blocked_by_class(lines: Iterable[FindingLine], times: str, *, apart: bool) -> list[str]:
    """Return a line for each class, mildest first: how many commands of which devices were blocked.

    For example ``512 x brick (--allow brick --confirm NAME-OF-ROBOT): 0x1b 0x1e: 256 each``.

    Args:
        lines: of the run.
        times: the sign between a number and what it counts.
        apart: name the nodes.
    """
    classes: dict[Risk, dict[str, Counter[int]]] = {}
    for line in lines:
        if line.outcome == Outcome.SKIPPED.value:
            nodes = classes.setdefault(_risk(line), {})
            nodes.setdefault(line.node if apart else "", Counter())[line.did] += 1
    told: list[str] = []
    for risk, nodes in sorted(classes.items()):
        total = sum(held.total() for held in nodes.values())
        devices = "; ".join(f"{node} {_devices(held)}".lstrip() for node, held in nodes.items())
        told.append(f"{total} {times} {risk.word} ({flag_for(risk)}): {devices}")
    return told


def _devices(counted: Counter[int]) -> str:
    """Return ``0x13: 4, 0x1b 0x1e: 256 each``: devices with the same count go together."""
    alike: dict[int, list[int]] = {}
    for did, count in sorted(counted.items()):
        alike.setdefault(count, []).append(did)
    return ", ".join(
        f"{' '.join(spans(dids))}: {count}{' each' if len(dids) > 1 else ''}" for count, dids in alike.items()
    )


def _risk(line: FindingLine) -> Risk:
    """Return the class of a command; of a row that names none, the most dangerous one."""
    return next((risk for risk in Risk if risk.word == line.risk), Risk.BRICK)


def without_command(reason: str) -> str:
    """Return why a command was blocked, without its name: the same for commands with the same reason."""
    return _DOTTED_NAME.sub("a documented command", _NOT_ASKED.sub("documented, not asked", reason))


def blocked_by_reason(
    lines: Iterable[FindingLine], times: str, *, apart: bool
) -> list[tuple[str, list[str]]]:
    """Return what was blocked: ``3 x persist: … (--allow persist)`` and the ids, with names if they are few.

    Reasons that differ only in the command they name are merged.
    """
    reasons: dict[str, list[FindingLine]] = {}
    for line in lines:
        if line.outcome == Outcome.SKIPPED.value:
            reasons.setdefault(without_command(line.note), []).append(line)
    told: list[tuple[str, list[str]]] = []
    for reason, held in sorted(reasons.items()):
        if len(held) <= NAMED_AT_MOST and all(line.name for line in held):
            items = [
                f"{line.node} {line.pair} {line.name}" if apart else f"{line.pair} {line.name}"
                for line in held
            ]
        else:
            items = ids(held, apart=apart)
        told.append((f"{len(held)} {times} {reason}", items))
    return told
