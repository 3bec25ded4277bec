"""The interface of what a fleet can do on each robot."""

import asyncio
from collections.abc import AsyncGenerator
from typing import NamedTuple, Protocol

from sphero_probe.fleet.records import FleetRecord
from sphero_probe.fleet.robots import FleetRobot
from sphero_probe.runs.resume import RunJournal
from sphero_probe.session.session import Session


class Visit(NamedTuple):
    """An action meets one robot.

    Attributes:
        robot: which.
        session: with it, open.
        journal: of the run, entered; it may keep nothing.
        stop: set when the action must end.
    """

    robot: FleetRobot
    session: Session
    journal: RunJournal
    stop: asyncio.Event


class Action(Protocol):
    """One action of a fleet. It is a value, so that it can be sent to another process."""

    @property
    def command(self) -> str:
        """The command whose journals it writes: ``sweep``, ``discover``, ``led``; empty if it writes none."""
        ...

    def run(self, visit: Visit) -> AsyncGenerator[FleetRecord, None]:
        """Yield what happens on one robot.

        Raises:
            IncompleteError: part of the result is missing.
            SpheroProbeError: something else went wrong.
        """
        ...
