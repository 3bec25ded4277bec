"""Makes the plan of ``fleet sweep`` for each robot, and finds mistakes before anything is connected."""

from contextlib import suppress
from pathlib import Path
from typing import Final

from sphero_probe.catalogue import ROBOTS
from sphero_probe.catalogue.libraries.finding import find_library
from sphero_probe.cli.actions.sweep import SweepOptions, plan_of
from sphero_probe.errors import BadInputFileError
from sphero_probe.fleet.plans import PlanFor, Subject
from sphero_probe.probing.plan import Plan
from sphero_probe.probing.plans.claims import library_in
from sphero_probe.protocol.packets import Generation
from sphero_probe.transports.base import BLE_PORT

ANY: Final = Subject(Generation.V2, None, BLE_PORT, None)
"""Stands for any robot, to find mistakes in what was typed."""


def sweep_plans(options: SweepOptions) -> PlanFor:
    """Return what makes the plan for each robot.

    Robots of one protocol share the probes of a range or a capture; a plan file, and what a library claims,
    may differ for each robot.

    Args:
        options: what to ask, as typed.

    Raises:
        UsageError: the options contradict each other, or name nothing.
        BadInputFileError: the plan, the capture or the library cannot be used for any robot.
    """
    if options.plan and Path(options.plan).is_file():  # workers run in other folders
        options = options._replace(plan=str(Path(options.plan).absolute()))
    made: dict[Generation, tuple[Plan, dict[str, str]]] = {}

    def plan_for(subject: Subject) -> tuple[Plan, dict[str, str]]:
        if options.plan:
            return plan_of(*subject[:3], options)
        if subject.generation not in made:
            made[subject.generation] = plan_of(*subject[:3], options)
        return made[subject.generation]

    if options.capture is None:
        plan_for(_example(options.plan))
        return plan_for
    for generation in Generation:  # here, as workers may not have the file
        with suppress(BadInputFileError):
            plan_for(ANY._replace(generation=generation))
    if not made:
        plan_for(ANY)  # raises
    return plan_for


def _example(plan: str | None) -> Subject:
    """Return a robot for which a plan can be made: what a library claims needs a model that it knows."""
    library = library_in(plan) if plan else None
    if library is None:
        return ANY
    robot = ROBOTS[min(find_library(library).robots)]
    return ANY._replace(generation=robot.generation, robot=robot)
