"""A dry run of a fleet as rows: a row for each robot, and what the policy blocks on which robots."""

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Final

from sphero_probe.fleet.dry_run import PlannedRobot
from sphero_probe.probing.dry_run import PlannedProbe
from sphero_probe.reports.ids import pair_spans
from sphero_probe.reports.phrases import Data, hex_id, pair, shown
from sphero_probe.reports.rows import Row
from sphero_probe.reports.run_blocked import NAMED_AT_MOST, without_command
from sphero_probe.reports.views import View, both, record_only, table_only

_Key = tuple[str, int | None, int, int]
"""Why a command is blocked, its node, DID and CID."""


def planned_robot_row(planned: PlannedRobot) -> Row:
    """Return what would be sent to one robot: ``sent`` and ``withheld`` are class -> number of probes."""
    robot, subject, (sent, blocked, following), error = planned
    withheld = Counter(probe.risk for probe in blocked)
    data: dict[str, object] = {
        "name": robot.name,
        "label": robot.label or None,
        "device": robot.device,
        "model": subject.robot.name if subject.robot else None,
        "generation": subject.generation.value,
        "sent": {risk.word: count for risk, count in sent.items()},
        "withheld": {risk.word: withheld[risk] for risk in sorted(withheld)},
        "following": list(following),
        "trouble": str(error) if error else None,
    }
    return Row("fleet_planned", data)


def withheld_rows(robots: Sequence[PlannedRobot]) -> list[Row]:
    """Return a row for each reason: commands that are blocked on the same robots, the mildest class first.

    ``target`` is null where a command is meant for the usual node of its robots. ``everywhere`` says that it
    is blocked on all robots of the fleet.
    """
    alike: defaultdict[_Key, list[str]] = defaultdict(list)
    probes: dict[_Key, PlannedProbe] = {}
    for robot, subject, planned, _ in robots:
        for probe in planned.blocked:
            command, reason = probe.command, without_command(probe.blocked or "")
            target = None if command.target == subject.target else command.target
            key = (reason, target, command.did, command.cid)
            alike[key].append(robot.name)
            probes[key] = probe
    held: defaultdict[tuple[str, int | None, tuple[str, ...]], list[PlannedProbe]] = defaultdict(list)
    for key, names in alike.items():
        held[key[0], key[1], tuple(dict.fromkeys(names))].append(probes[key])
    ordered = sorted(held.items(), key=lambda item: item[1][0].risk)
    return [_withheld_row(*key, blocked, len(robots)) for key, blocked in ordered]


def _withheld_row(
    reason: str, target: int | None, robots: tuple[str, ...], blocked: Sequence[PlannedProbe], of: int
) -> Row:
    commands = [
        {
            "did": probe.command.did,
            "cid": probe.command.cid,
            "name": probe.knowledge.name if probe.knowledge else None,
        }
        for probe in blocked
    ]
    data: dict[str, object] = {
        "risk": blocked[0].risk.word,
        "withheld": reason,
        "target": target,
        "robots": list(robots),
        "everywhere": len(robots) == of,
        "commands": commands,
    }
    return Row("fleet_withheld", data)


def _total(key: str, data: Data) -> str:
    """Return ``20: 4 read, 16 probe``."""
    counts = data.get(key)
    if not isinstance(counts, Mapping) or not counts:
        return ""
    return f"{sum(counts.values())}: {', '.join(f'{count} {risk}' for risk, count in counts.items())}"


def _commands(data: Data) -> str:
    """Return a few commands with their names, many as ranges of ids."""
    commands = data.get("commands")
    held = commands if isinstance(commands, list) else []
    if len(held) <= NAMED_AT_MOST and all(one["name"] for one in held):
        return ", ".join(f"{pair(one)} {one['name']}" for one in held)
    return ", ".join(pair_spans((one["did"], one["cid"]) for one in held))


def _robots(data: Data) -> str:
    return "all" if data.get("everywhere") else shown(data.get("robots"))


WITHHELD: Final = View(
    "fleet_withheld",
    (
        both("withheld", "Because"),
        both("target", "Node", hex_id, whole=True),
        table_only("Commands", _commands),
        table_only("Robots", _robots),
    ),
    "Nothing is blocked.",
    heading="Blocked",
)
"""What is blocked on which robots; formats with one list leave it out."""

FLEET_PLANNED: Final = View(
    "fleet_planned",
    (
        both("name", "Robot", whole=True),
        both("label"),
        *record_only("device", "model"),
        table_only("Model", lambda data: shown(data.get("model")) or "not known yet"),
        both("generation", "Protocol", whole=True),
        *record_only("sent", "withheld"),
        table_only("To send", partial(_total, "sent")),
        table_only("Blocked", partial(_total, "withheld")),
        both("following", "More in"),
        both("trouble"),
    ),
    "No robot.",
    below=WITHHELD,
)
"""What a run would send to each robot of a fleet."""
