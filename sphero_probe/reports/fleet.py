"""Results of a fleet as rows: a row for each robot, and a matrix of commands and robots."""

import math
from collections import defaultdict
from collections.abc import Mapping
from typing import Final

from sphero_probe.fleet.records import Battery, Health
from sphero_probe.fleet.results import RobotResult
from sphero_probe.reports.matrix import Matrix, column_title
from sphero_probe.reports.phrases import Data, found, measured, shown
from sphero_probe.reports.rows import Row, counts_by_word, fact_row
from sphero_probe.reports.views import Column, Place, View, both, record_only, table_only

_KEPT: Final = ("did", "cid", "name", "state")
"""The keys of a finding that the matrix needs."""


def robot_result_row(result: RobotResult) -> Row:
    """Return the row of one robot of a fleet; what was not asked is null.

    ``echoes`` are those that were sent and answered, ``rtt_ms`` the median of their round trips.
    """
    robot, reached, health, ended = result.robot, result.reached, result.health, result.ended
    data: dict[str, object] = {
        "name": result.name,
        "label": robot.label or None,
        "device": robot.device,
        "address": reached.address if reached else None,
        "adapter": (reached.adapter or None) if reached else None,
        "model": result.model or None,
        "firmware": dict(result.firmware),
        "battery": _battery(result.battery),
        "counts": counts_by_word(result.counts) if result.done else {},
        "leds": dict(result.lit.leds) if result.lit else {},
        "status": ended.status.value if ended else None,
        "trouble": (ended.trouble or None) if ended else None,
        "hint": (ended.hint or None) if ended else None,
        "journal": (ended.journal or None) if ended else None,
    }
    return Row("fleet_robot", data | _health(health))


def _health(health: Health | None) -> dict[str, object]:
    if health is None:
        return {"awake": None, "dead_nodes": [], "echoes": [], "rtt_ms": None}
    trips = health.trips
    median = None if math.isnan(trips.median) else round(trips.median * 1000, 3)
    echoes = [trips.sent, len(trips.times)]
    return {"awake": health.awake, "dead_nodes": list(health.dead), "echoes": echoes, "rtt_ms": median}


def _battery(battery: Battery | None) -> dict[str, object]:
    """Return the facts about a battery: ``{"percentage": "87 %"}``."""
    facts = battery.facts if battery else ()
    named = {fact.name.rpartition(" ")[2]: measured(fact_row(fact).data) for fact in facts}
    return {
        name.removeprefix("battery_"): value
        for name, value in named.items()
        if "battery" in name or "state" in name
    }


def _battery_text(data: Data) -> str:
    battery = data.get("battery")
    return ", ".join(map(shown, battery.values())) if isinstance(battery, Mapping) else ""


def _firmware_text(data: Data) -> str:
    firmware = data.get("firmware")
    return "/".join(dict.fromkeys(map(shown, firmware.values()))) if isinstance(firmware, Mapping) else ""


def _leds_text(data: Data) -> str:
    """Return the colour of all LEDs, or of each where they differ."""
    leds = data.get("leds")
    colours = set(leds.values()) if isinstance(leds, Mapping) else set()
    return shown(*colours) if len(colours) == 1 else shown(leds or None)


def _link_text(data: Data) -> str:
    """Return ``14.9 ms``, and how many echoes were lost."""
    echoes, median = data.get("echoes"), data.get("rtt_ms")
    if not isinstance(echoes, list) or not echoes or not echoes[0]:
        return ""
    sent, answered = echoes
    time = f"{median:.1f} ms" if isinstance(median, float) else ""
    return ", ".join(filter(None, (time, f"{sent - answered} of {sent} lost" if sent > answered else "")))


def _trouble_text(data: Data) -> str:
    return ": ".join(filter(None, (shown(data.get("status")), shown(data.get("trouble")))))


FLEET: Final = View(
    "fleet_robot",
    (
        both("name", whole=True),
        both("label"),
        *record_only("device", "address"),
        both("adapter"),
        both("model"),
        Column("firmware", "Firmware", _firmware_text, Place.BOTH),
        Column("battery", "Battery", _battery_text, Place.BOTH),
        *record_only("counts"),
        table_only("Found", found),
        Column("leds", "LEDs", lambda data: shown(data.get("leds")), Place.RECORD),
        table_only("LEDs", _leds_text),
        table_only("Awake", lambda data: shown(data.get("awake"))),
        table_only("Round trip", _link_text),
        *record_only("status", "trouble", "hint", "journal", "awake", "dead_nodes", "echoes", "rtt_ms"),
        table_only("Result", _trouble_text),
    ),
    "No robot.",
)
"""The robots of a fleet, and how each ended."""


class FleetMatrix:
    """Collects the findings of robots, and compares them: a column for each model and firmware.

    Robots of one model and firmware share a column, unless they differ in a command; then each has its own.
    """

    def __init__(self) -> None:
        self._findings: defaultdict[str, dict[int, tuple[object, ...]]] = defaultdict(dict)
        self._shared: dict[tuple[object, ...], tuple[object, ...]] = {}  # robots of a fleet are much alike

    def add(self, robot: str, row: Row) -> None:
        """Take a row of a run; of findings of the same number, the last counts.

        Args:
            robot: its name in the fleet.
            row: of its run.
        """
        number = row.data.get("number")
        if row.type == "finding" and isinstance(number, int):
            kept = tuple(row.data[key] for key in _KEPT)
            self._findings[robot][number] = self._shared.setdefault(kept, kept)

    def compared(self, results: Mapping[str, RobotResult]) -> Matrix:
        """Return the matrix.

        Args:
            results: robot name -> its result, which has model and firmware.
        """
        groups: defaultdict[str, list[str]] = defaultdict(list)
        for robot in self._findings:
            groups[column_title(results[robot].model, results[robot].firmware)].append(robot)
        matrix = Matrix()
        for title, robots in groups.items():
            alike = len({self._states(robot) for robot in robots}) == 1
            count = f" ({len(robots)} robots)" if len(robots) > 1 else ""
            for robot in robots[:1] if alike else robots:
                name = f"{title}{count}" if alike else f"{results[robot].name} {title}"
                found = self._findings[robot].values()
                matrix.add(name, (dict(zip(_KEPT, kept, strict=True)) for kept in found))
        return matrix

    def _states(self, robot: str) -> tuple[tuple[object, ...], ...]:
        return tuple(kept for _, kept in sorted(self._findings[robot].items()))
