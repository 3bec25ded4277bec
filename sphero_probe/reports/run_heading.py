"""Writes the head of a run's table: the robot, the plan, and what calibration measured."""

from collections import Counter
from collections.abc import Sequence

from sphero_probe.catalogue.model import Robot
from sphero_probe.probing.notes import EXECUTED, node_name
from sphero_probe.reports.phrases import Data, shown


def heading_lines(heading: Data, places: Sequence[str], calibration: Sequence[str]) -> list[str]:
    """Return the robot, the plan, the consent, the time, and what calibration measured.

    Args:
        heading: the data of the run's row.
        places: the names of the nodes that were asked.
        calibration: a line for each node that was measured, from the notes of the run.
    """
    firmware, strictness = heading.get("firmware"), heading.get("strictness")
    versions = shown(firmware) if firmware else "unknown"
    measured = list(calibration)
    if not measured and isinstance(strictness, dict):
        measured = [f"{node}: {shown(said)}" for node, said in strictness.items()]
    where = f" on {places[0]}" if len(places) == 1 else ""
    line = f" over {shown(heading['line'])}" if heading.get("line") else ""
    return [
        f"{shown(heading.get('model'))} {shown(heading.get('device'))}{line}, firmware: {versions}",
        f"Plan {shown(heading.get('plan'))}{where}, allowed: {shown(heading.get('consent'))}",
        f"Started {shown(heading.get('started'))}, sphero-probe {shown(heading.get('tool_version'))}",
        *(f"Length check, {text}" for text in measured),
    ]


def calibration_lines(notes: Sequence[Data], robot: Robot | None) -> list[str]:
    """Return what calibration measured: a line for each node, with the last count of its evidence.

    Nodes with the same result share a line. Commands that accepted a wrong length afterwards are counted.

    Args:
        notes: of the run.
        robot: the model, None if it is not known.
    """
    evidence: dict[str, str] = {}
    for note in notes:
        if note.get("kind") == "evidence":
            node, _, text = shown(note.get("text")).partition(": ")
            evidence[node] = text
    targets = (note.get("target") for note in notes if note.get("kind") == EXECUTED)
    executed = Counter(node_name(target if isinstance(target, int) else None, robot) for target in targets)
    nodes: dict[str, list[str]] = {}
    for note in notes:
        if note.get("kind") == "calibration":
            node, _, text = shown(note.get("text")).partition(": ")
            parts = filter(None, (text, evidence.pop(node, ""), _surprises(executed[node])))
            nodes.setdefault("; ".join(parts), []).append(node)
    lines = [f"{', '.join(held)}: {text}" for text, held in nodes.items()]
    return [*lines, *(f"{node}: {text}" for node, text in evidence.items())]


def _surprises(count: int) -> str:
    """Return that commands accepted a wrong length all the same; empty for none."""
    return f"but {count} command{'s' * (count > 1)} accepted a wrong length" if count else ""
