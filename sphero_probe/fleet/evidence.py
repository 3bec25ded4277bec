"""Collect evidence on each robot of a fleet."""

from collections.abc import AsyncGenerator
from typing import NamedTuple

from sphero_probe.errors import IncompleteError
from sphero_probe.fleet.action import Visit
from sphero_probe.fleet.plans import Subject
from sphero_probe.fleet.records import FleetRecord
from sphero_probe.fleet.robots import FleetRobot
from sphero_probe.probing.collecting import Collecting, CollectingOptions
from sphero_probe.probing.plan import Plan
from sphero_probe.probing.plans.evidence import evidence_plan
from sphero_probe.runs.evidence import redact_once
from sphero_probe.session.addressing import address_of


class EvidenceAction(NamedTuple):
    """Collects evidence on each robot; it keeps no journal.

    Attributes:
        idle: seconds without a command at the end, 0 for none.
        command: empty, as there is no journal.
        target: None: each robot's nodes are asked.
    """

    idle: float = 0.0
    command: str = ""
    target: str | None = None

    def plan_on(self, _robot: FleetRobot, subject: Subject) -> Plan:
        """Return the plan of an evidence run on one robot."""
        return evidence_plan(subject.generation, subject.robot, subject.target, subject.port)

    async def run(self, visit: Visit) -> AsyncGenerator[FleetRecord, None]:
        """Yield the redacted evidence of one robot.

        Raises:
            IncompleteError: the run ended early, or a wrong length was executed.
            NoAnswerError: the robot answers nothing.
        """
        session, device = visit.session, visit.robot.device
        options = CollectingOptions(
            address_of(device).scheme, self.idle, lambda topic: session.on_step(topic.value)
        )
        evidence = await Collecting(session, visit.stop, options).run()
        connection = session.connection
        identifiers = (connection.name, connection.address, device, visit.robot.name, visit.robot.label)
        yield redact_once(evidence, identifiers)
        if problem := evidence.problem:
            raise IncompleteError(problem)
