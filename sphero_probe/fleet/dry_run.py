"""Show what a plan would send to each robot of a fleet, without connecting to any."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from typing import Final, NamedTuple, Protocol

from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import RefusedByPolicyError, SpheroProbeError, UsageError
from sphero_probe.fleet.on_robot import FleetConsent
from sphero_probe.fleet.plans import Subject
from sphero_probe.fleet.robots import FleetRobot
from sphero_probe.link.policy import Consent
from sphero_probe.probing.dry_run import PlannedProbe, planned_probes
from sphero_probe.probing.plan import Plan
from sphero_probe.session.addressing import (
    address_of,
    generation_behind,
    model_behind,
    name_behind,
    port_behind,
)
from sphero_probe.session.commands import node
from sphero_probe.transports.registry import DeviceAddress

_UNKNOWN: Final = "it depends on the model, which is known once the robot is connected"


class Planner(Protocol):
    """An action of which it is known before what it sends, at least to begin with."""

    @property
    def target(self) -> str | None:
        """The node as typed, None for each robot's usual one."""
        ...

    def plan_on(self, robot: FleetRobot, subject: Subject) -> Plan:
        """Return the plan for one robot.

        Raises:
            SpheroProbeError: there is none for this robot.
        """
        ...


class Planned(NamedTuple):
    """What a plan would do on a robot, as far as that is known before it answers.

    Attributes:
        sent: class -> how many probes would be sent.
        blocked: the probes that the policy blocks.
        following: the names of stages whose probes follow from what is found.
    """

    sent: Mapping[Risk, int] = {}
    blocked: tuple[PlannedProbe, ...] = ()
    following: tuple[str, ...] = ()


class PlannedRobot(NamedTuple):
    """What a plan would do on one robot of a fleet.

    Attributes:
        robot: which.
        subject: its protocol, model, port and node, as far as name and address tell.
        planned: what would be sent.
        error: why nothing could be sent, None if something can.
    """

    robot: FleetRobot
    subject: Subject
    planned: Planned = Planned()
    error: SpheroProbeError | None = None


def planned_fleet(
    robots: Iterable[FleetRobot], action: Planner, consent: FleetConsent
) -> Iterator[PlannedRobot]:
    """Yield what an action would send to each robot; robots that are asked the same share one result.

    Args:
        robots: in the order of the report.
        action: makes the plans.
        consent: what may be sent.

    Raises:
        UsageError: an address is not valid.
        BadInputFileError: the file of a ``replay:`` address cannot be used.
    """
    made: dict[tuple[object, ...], tuple[Plan, Planned]] = {}
    for robot in robots:
        name, subject = _subject_of(robot)
        try:
            subject = subject._replace(target=node(action.target, subject.robot, subject.port))
            # Without a name to compare, a dry run shows what the class brick is needed for.
            compares = name and consent.confirmed
            allowed = consent.for_robot(name) if compares else Consent(consent.allowed)
            plan = action.plan_on(robot, subject)
            model = subject.robot.key if subject.robot else ""
            key = (id(plan), model, subject.port, subject.target, allowed)
            if key not in made:  # with the plan, as its id is taken only as long as it is kept
                made[key] = plan, _planned(plan, subject, allowed, name)
            yield PlannedRobot(robot, subject, made[key][1])
        except RefusedByPolicyError as error:
            yield PlannedRobot(robot, subject, error=error)
        except SpheroProbeError as error:
            known = subject.robot is not None
            yield PlannedRobot(robot, subject, error=error if known else UsageError(_UNKNOWN))


def _subject_of(robot: FleetRobot) -> tuple[str, Subject]:
    """Return a robot's name, empty if it is not known, and what else is known of it.

    A fleet file may tell both the name and the Bluetooth address, which does not tell the model.
    """
    address, named = address_of(robot.device), DeviceAddress("ble", robot.name)
    name, model, generation = name_behind(address), model_behind(address), generation_behind(address)
    if model is None and address.scheme == named.scheme:
        name, model, generation = name_behind(named), model_behind(named), generation_behind(named)
    return name, Subject(generation, model, port_behind(address), None)


def _planned(plan: Plan, subject: Subject, consent: Consent, name: str) -> Planned:
    sent: Counter[Risk] = Counter()
    blocked: list[PlannedProbe] = []
    probes = planned_probes(plan, subject.generation, subject.robot, consent, subject.target, name)
    for probe in probes:
        if probe.blocked is None:
            sent[probe.risk] += 1
        else:
            blocked.append(probe)
    return Planned(dict(sorted(sent.items())), tuple(blocked), plan.open_stages)
