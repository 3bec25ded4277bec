from typing import Final

from sphero_probe import errors, sync
from sphero_probe.api.answer import Answer
from sphero_probe.api.connecting import connect, discover, scan
from sphero_probe.api.decoding import DecodedPacket, decode
from sphero_probe.api.fleet import Fleet, FleetRun
from sphero_probe.api.notifications import Notifications
from sphero_probe.api.result import Run, load_run
from sphero_probe.api.robot import ConnectedRobot
from sphero_probe.api.running import RunningPlan
from sphero_probe.catalogue.risk import Risk
from sphero_probe.fleet.results import RobotResult
from sphero_probe.fleet.robots import FleetRobot
from sphero_probe.link.exchange import Answered, Blocked, LateResponse, Silent
from sphero_probe.link.policy import Consent
from sphero_probe.probing.finding import Confidence, Finding, Heading, Note, Outcome, Summary
from sphero_probe.probing.plan import Plan, Probe, sweep
from sphero_probe.protocol.packets import (
    Command,
    Generation,
    Malformed,
    Notification,
    Request,
    Response,
)
from sphero_probe.transports.base import Seen

__version__: Final[str]

__all__ = [
    "Answer",
    "Answered",
    "Blocked",
    "Command",
    "Confidence",
    "ConnectedRobot",
    "Consent",
    "DecodedPacket",
    "Finding",
    "Fleet",
    "FleetRobot",
    "FleetRun",
    "Generation",
    "Heading",
    "LateResponse",
    "Malformed",
    "Note",
    "Notification",
    "Notifications",
    "Outcome",
    "Plan",
    "Probe",
    "Request",
    "Response",
    "Risk",
    "RobotResult",
    "Run",
    "RunningPlan",
    "Seen",
    "Silent",
    "Summary",
    "__version__",
    "connect",
    "decode",
    "discover",
    "errors",
    "load_run",
    "scan",
    "sweep",
    "sync",
]
