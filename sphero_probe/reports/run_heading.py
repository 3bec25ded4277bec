"""Writes the head of a run's table: the robot, the plan, and what calibration measured."""

from collections.abc import Sequence

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
    return [
        f"{shown(heading.get('model'))} {shown(heading.get('device'))}, firmware: {versions}",
        f"Plan {shown(heading.get('plan'))}{where}, allowed: {shown(heading.get('consent'))}",
        f"Started {shown(heading.get('started'))}, sphero-probe {shown(heading.get('tool_version'))}",
        *(f"Length check, {text}" for text in measured),
    ]


def calibration_lines(notes: Sequence[Data]) -> list[str]:
    """Return what calibration measured: a line for each node, with the last count of its evidence.

    Nodes with the same result share a line.
    """
    evidence: dict[str, str] = {}
    for note in notes:
        if note.get("kind") == "evidence":
            node, _, text = shown(note.get("text")).partition(": ")
            evidence[node] = text
    nodes: dict[str, list[str]] = {}
    for note in notes:
        if note.get("kind") == "calibration":
            node, _, text = shown(note.get("text")).partition(": ")
            counted = evidence.pop(node, "")
            nodes.setdefault(f"{text}; {counted}" if counted else text, []).append(node)
    lines = [f"{', '.join(held)}: {text}" for text, held in nodes.items()]
    return [*lines, *(f"{node}: {text}" for node, text in evidence.items())]
