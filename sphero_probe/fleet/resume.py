"""Find the last run of a plan on each robot of a fleet, so that what is unfinished can be resumed."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from sphero_probe.catalogue import ROBOTS
from sphero_probe.errors import BadInputFileError, SpheroProbeError
from sphero_probe.fleet.plans import PlanAction, Subject
from sphero_probe.fleet.robots import FleetRobot
from sphero_probe.link.policy import Consent
from sphero_probe.runs.decode import Opening
from sphero_probe.runs.overview import read_overview
from sphero_probe.runs.store import journal_files
from sphero_probe.session.addressing import address_of, port_behind
from sphero_probe.session.commands import node


class EarlierRun(NamedTuple):
    """The last run of a plan on one robot.

    Attributes:
        journal: its file.
        complete: nothing is left to do.
    """

    journal: Path
    complete: bool


def earlier_runs(robots: Sequence[FleetRobot], action: PlanAction, consent: Consent) -> dict[str, EarlierRun]:
    """Return robot name -> its last run of this plan with this consent, for the robots that have one.

    Args:
        robots: whose names or addresses are those of the journals.
        action: makes the plan.
        consent: its classes are compared with those of the runs.

    Raises:
        SpheroProbeError: the folder of runs cannot be read.
    """
    found: dict[str, EarlierRun] = {}
    for path in journal_files():
        if len(found) == len(robots):
            break
        try:
            run = read_overview(path)
        except BadInputFileError:
            continue
        if run.opening is None or not _is_of(run.opening, action, consent):
            continue
        for robot in robots:
            if robot.name not in found and _is_meant(robot, run.opening):
                found[robot.name] = EarlierRun(path, run.complete)
    return found


def _is_of(opening: Opening, action: PlanAction, consent: Consent) -> bool:
    """Whether a run had this command, plan and consent."""
    if opening.command != action.command or set(opening.consent) != set(consent.words):
        return False
    if action.target is not None and action.target != opening.target:
        return False
    try:
        port = port_behind(address_of(opening.address))
        robot = ROBOTS.get(opening.robot)
        target = node(opening.target or None, robot, port)
        plan, options = action.plan_for(Subject(opening.generation, robot, port, target))
    except SpheroProbeError:  # the address or the plan makes no sense on this robot
        return False
    return (plan.name, options) == (opening.plan, opening.options)


def _is_meant(robot: FleetRobot, opening: Opening) -> bool:
    names = {opening.device.casefold(), opening.address.casefold()}
    return bool(names & {robot.name.casefold(), str(address_of(robot.device)).casefold()}) or (
        address_of(robot.device).rest.casefold() == opening.device.casefold()
    )
