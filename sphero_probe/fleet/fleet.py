"""Run an action on every robot of a fleet at once. ``Fleet`` is the main class of the package."""

import asyncio
from collections.abc import AsyncGenerator, Callable, Mapping, Sequence
from contextlib import aclosing
from pathlib import Path
from typing import Final

from sphero_probe.errors import SpheroProbeError
from sphero_probe.fleet.action import Action
from sphero_probe.fleet.adapters import Adapters
from sphero_probe.fleet.on_robot import RobotOptions, run_on_robot
from sphero_probe.fleet.records import Ended, FleetRecord, Status, Step
from sphero_probe.fleet.robots import FleetRobot
from sphero_probe.runs.reader import read_journal
from sphero_probe.runs.resume import RunJournal

_WAITING: Final = 256
"""Records that may wait to be taken; then the robots wait."""

JournalFor = Callable[[FleetRobot], RunJournal]
"""Returns the journal of a robot's run, not entered."""


class Fleet:
    """Runs one action on many robots, each in a task of its own; one robot's failure ends no other's work.

    Attributes:
        robots: in the order of the report.
        stop: set it to end every run once nothing of it is in flight.
    """

    def __init__(
        self,
        robots: Sequence[FleetRobot],
        action: Action,
        journal_for: JournalFor,
        *,
        options: RobotOptions | None = None,
        adapters: Adapters | None = None,
        stop: asyncio.Event | None = None,
        finished: Mapping[str, Path] | None = None,
    ) -> None:
        """Prepare a run; nothing is connected yet.

        Args:
            robots: which.
            action: what to do on each.
            journal_for: returns the journal of one robot.
            options: how to connect, and what may be sent.
            adapters: the Bluetooth adapters to use.
            stop: as the attribute.
            finished: robot name -> journal of a complete run; its records are yielded, and nothing is sent.
        """
        self.robots = tuple(robots)
        self.stop = stop or asyncio.Event()
        self._action = action
        self._journal_for = journal_for
        self._options = options or RobotOptions()
        self._adapters = adapters or Adapters()
        self._finished = finished or {}
        self._queue: asyncio.Queue[tuple[FleetRobot, FleetRecord]] = asyncio.Queue(_WAITING)
        self._bugs: list[Exception] = []

    async def records(self) -> AsyncGenerator[tuple[FleetRobot, FleetRecord], None]:
        """Yield what happens on each robot, as it happens; the last record of each robot is an ``Ended``.

        Closing the generator ends every run and disconnects every robot.

        Raises:
            Exception: a bug ended the work on a robot; it is raised after the other robots have ended.
        """
        tasks = [asyncio.create_task(self._work(robot), name=f"fleet: {robot.name}") for robot in self.robots]
        try:
            left = len(tasks)
            while left:
                robot, record = await self._queue.get()
                left -= isinstance(record, Ended)
                yield robot, record
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
        if self._bugs:
            raise self._bugs[0]

    def _on_robot(
        self, robot: FleetRobot, on_step: Callable[[str], None]
    ) -> AsyncGenerator[FleetRecord, None]:
        """Yield what happens on one robot, an ``Ended`` at last."""
        journal = self._journal_for(robot)
        return run_on_robot(robot, self._action, self._options, self._adapters, journal, self.stop, on_step)

    async def _work(self, robot: FleetRobot) -> None:
        """Put the records of one robot into the queue."""

        def on_step(text: str) -> None:
            if not self._queue.full():  # a step is news only while it is new
                self._queue.put_nowait((robot, Step(text)))

        try:
            if path := self._finished.get(robot.name):
                for recorded in read_journal(path).records():
                    await self._queue.put((robot, recorded))
                await self._queue.put((robot, Ended(Status.DONE, journal=str(path))))
                return
            async with aclosing(self._on_robot(robot, on_step)) as records:
                async for record in records:
                    await self._queue.put((robot, record))
        except SpheroProbeError as error:  # the journal cannot be read any more
            await self._queue.put((robot, Ended(Status.FAILED, str(error), error.hint)))
        except Exception as bug:  # noqa: BLE001 - raised when the other robots have ended
            self._bugs.append(bug)
            await self._queue.put((robot, Ended(Status.FAILED, f"a bug in sphero-probe: {bug!r}")))
