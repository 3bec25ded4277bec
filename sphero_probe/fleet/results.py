"""Sum up what happened on one robot of a fleet, without keeping its findings."""

from collections import Counter

from sphero_probe.fleet.records import Battery, Ended, FleetRecord, Health, Lit, Progress, Reached, Step
from sphero_probe.fleet.robots import FleetRobot
from sphero_probe.probing.evidence import Evidence
from sphero_probe.probing.finding import Finding, Heading, Outcome


class RobotResult:
    """The result of one robot so far.

    Attributes:
        robot: which.
        name: the robot's own name once it is connected, before that the one in the fleet.
        step: what it does now.
        reached: who answered, None before it is connected.
        model: the model's name, empty before it is known.
        firmware: node name -> version.
        battery: what it says of its battery, None if it was not asked.
        health: how well it works, None if that was not asked.
        lit: the colours of its LEDs, None if they were not set.
        evidence: what was collected, None for another action.
        total: probes known so far.
        ended: how the work ended, None before that.
    """

    def __init__(self, robot: FleetRobot) -> None:
        self.robot = robot
        self.name = robot.name
        self.step = ""
        self.reached: Reached | None = None
        self.model = ""
        self.firmware: dict[str, str] = {}
        self.battery: Battery | None = None
        self.health: Health | None = None
        self.lit: Lit | None = None
        self.evidence: Evidence | None = None
        self.total = 0
        self.ended: Ended | None = None
        self._outcomes: dict[int, Outcome] = {}

    def add(self, record: FleetRecord) -> None:
        """Take the next record of this robot."""
        match record:
            case Step():
                self.step = record.text
            case Reached():
                self.reached, self.name, self.model = record, record.name, record.model
            case Progress():
                self.total = record.total
            case Heading():
                self.name, self.model, self.firmware = record.device, record.model, dict(record.firmware)
            case Finding():
                self._outcomes[record.number] = record.outcome
            case Battery():
                self.battery = record
            case Health():
                self.health, self.firmware = record, record.firmware
            case Lit():
                self.lit = record
            case Evidence():
                self.evidence, self.firmware = record, dict(record.firmware)
            case Ended():
                self.ended = record
            case _:  # notes and summaries
                pass

    @property
    def done(self) -> int:
        """Probes with a finding."""
        return len(self._outcomes)

    @property
    def counts(self) -> Counter[Outcome]:
        """Outcome -> number of probes."""
        return Counter(self._outcomes.values())
