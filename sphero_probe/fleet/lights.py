"""Set LEDs on each robot of a fleet: the same on all, or each another colour, to tell which is which."""

from collections.abc import AsyncGenerator, Mapping, Sequence
from contextlib import aclosing
from typing import Final, NamedTuple

from sphero_probe.catalogue.leds import Colour
from sphero_probe.catalogue.model import Robot
from sphero_probe.catalogue.naming import colour
from sphero_probe.fleet.action import Visit
from sphero_probe.fleet.plans import Subject
from sphero_probe.fleet.records import FleetRecord, Lit
from sphero_probe.fleet.robots import FleetRobot
from sphero_probe.probing.plan import Plan
from sphero_probe.runs.sending import plan_of, send_each
from sphero_probe.session.commands import led_commands_for

PALETTE: Final = ("red", "lime", "blue", "yellow", "magenta", "cyan", "white", "orange")
"""Colours that people tell apart on LEDs."""

Pair = tuple[str, str]
"""The colour of the first LED and that of the others, as people write them."""


def colours_of(robots: Sequence[FleetRobot]) -> dict[str, Pair]:
    """Return robot name -> two colours; different for up to 64 robots.

    The first eight robots show one colour, the following ones two.
    """
    size = len(PALETTE)
    return {
        robot.name: (PALETTE[at % size], PALETTE[(at + at // size) % size]) for at, robot in enumerate(robots)
    }


class LedAction(NamedTuple):
    """Sets the LEDs of each robot.

    Attributes:
        colours: robot name -> its colours, as of ``colours_of``; None sets ``wanted`` on all.
        wanted: LED name or alias -> colour.
        off: switch off every LED that is not named.
        target: the node as typed, None for the one that serves the LEDs.
        command: of the journal.
    """

    colours: Mapping[str, Pair] | None = None
    wanted: Mapping[str, Colour] = {}
    off: bool = False
    target: str | None = None
    command: str = "led"

    def plan_on(self, robot: FleetRobot, subject: Subject) -> Plan:
        """Return the plan that sets the LEDs of one robot.

        Raises:
            UsageError: the robot has no such LED, or its model is not known.
        """
        wanted, _ = self._wanted(robot, subject.robot)
        commands = led_commands_for(wanted, subject.robot, subject.port, self.target, off=self.off)
        return plan_of(self.command, commands)

    def _wanted(self, robot: FleetRobot, model: Robot | None) -> tuple[Mapping[str, Colour], dict[str, str]]:
        """Return LED name -> colour, and the same as people write it if each robot gets its own."""
        if self.colours is None:
            return self.wanted, {}
        shown = _all_leds(model, self.colours[robot.name])
        return {name: colour(text) for name, text in shown.items()}, shown

    async def run(self, visit: Visit) -> AsyncGenerator[FleetRecord, None]:
        """Send the commands; yield their findings, and the colours.

        Raises:
            UsageError: the robot has no such LED.
            CommandFailedError: the robot rejected a command, or did not answer it.
            SpheroProbeError: as ``send_each`` does.
        """
        connection = visit.session.connection
        wanted, shown = self._wanted(visit.robot, connection.robot)
        commands = led_commands_for(wanted, connection.robot, connection.port, self.target, off=self.off)
        async with aclosing(send_each(self.command, commands, visit.session, visit.journal)) as records:
            async for record in records:
                yield record
        yield Lit(shown or {name: bytes(channels).hex() for name, channels in wanted.items()})


def _all_leds(robot: Robot | None, pair: Pair) -> dict[str, str]:
    """Return every LED with three channels -> its colour."""
    groups = robot.leds.groups if robot and robot.leds else ()
    names = [group.name for group in groups if len(group.bits) == 3]
    return {name: pair[min(at, 1)] for at, name in enumerate(names)}
