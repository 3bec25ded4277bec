"""What happens on one robot of a fleet, as values."""

from enum import StrEnum
from typing import NamedTuple

from sphero_probe.probing.evidence import Evidence
from sphero_probe.probing.facts import Fact
from sphero_probe.probing.finding import Record
from sphero_probe.probing.latency import RoundTrips
from sphero_probe.protocol.packets import Generation


class Status(StrEnum):
    """How the work on a robot ended."""

    DONE = "done"
    INCOMPLETE = "incomplete"
    """Part of the result is missing; ``--resume`` may get it."""
    UNREACHABLE = "unreachable"
    """It could not be connected, or answers nothing."""
    REFUSED = "refused"
    """The policy refused, or the class ``brick`` is not confirmed with the robot's name."""
    FAILED = "failed"
    """Something else: the message says what."""


class Step(NamedTuple):
    """A step of connecting or of the action begins, or the robot waits.

    Attributes:
        text: which one, for people.
    """

    text: str


class Reached(NamedTuple):
    """The robot is connected.

    Attributes:
        name: as it advertises.
        model: the model's name, "unknown model" where it is not known.
        generation: the protocol that it speaks.
        address: where it was reached, as ``--device`` takes it.
        adapter: the Bluetooth adapter, empty for another kind of line or the system's choice.
    """

    name: str
    model: str
    generation: Generation
    address: str
    adapter: str = ""


class Progress(NamedTuple):
    """How far the plan is.

    Attributes:
        total: probes known so far.
    """

    total: int


class Battery(NamedTuple):
    """What the robot says of its battery.

    Attributes:
        facts: its answers; none if it did not answer.
    """

    facts: tuple[Fact, ...]


class Lit(NamedTuple):
    """The colours that the robot's LEDs were set to.

    Attributes:
        leds: LED name -> colour, as people write it.
    """

    leds: dict[str, str]


class Health(NamedTuple):
    """How well a robot works.

    Attributes:
        awake: it answered before it was woken.
        firmware: node name -> version, for the nodes that answered.
        dead: the names of nodes that the model has and that answer nothing.
        trips: round trips of echoes.
    """

    awake: bool
    firmware: dict[str, str]
    dead: tuple[str, ...]
    trips: RoundTrips


class Ended(NamedTuple):
    """The work on a robot has ended: the last record of each robot.

    Attributes:
        status: how.
        trouble: what went wrong, one line; empty if nothing did.
        hint: what to do about it, or empty.
        journal: the path of the journal, empty if none was kept.
    """

    status: Status
    trouble: str = ""
    hint: str = ""
    journal: str = ""


FleetRecord = Step | Reached | Progress | Record | Battery | Health | Lit | Evidence | Ended
