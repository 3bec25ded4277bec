"""``diff``: compare two runs, or a run with what is known."""

from typing import Final

import click

from sphero_probe.catalogue import ROBOTS, robot_by_prefix
from sphero_probe.cli.connect import connect
from sphero_probe.cli.messages import say
from sphero_probe.cli.output import show
from sphero_probe.cli.run import start_run
from sphero_probe.cli.signals import Interrupts, run_interruptible
from sphero_probe.cli.values import ConnectOptions, Output
from sphero_probe.errors import BadInputFileError, OutputError, SpheroProbeError, UsageError
from sphero_probe.link.policy import Consent
from sphero_probe.probing.finding import Finding
from sphero_probe.probing.plans.discovery import claims
from sphero_probe.reports.diff_rows import DIFFERENCES, count_row, diff_row, diff_rows, ending, warnings
from sphero_probe.runs.diff import Diff, compare
from sphero_probe.runs.listed_sides import CATALOGUE, catalogue_side, claims_side, firmware_side
from sphero_probe.runs.side_files import file_side
from sphero_probe.runs.sides import Side
from sphero_probe.runs.store import find_journal
from sphero_probe.session.addressing import usual_target
from sphero_probe.transports.base import HARDWARE_ADDRESS
from sphero_probe.transports.fake import built_in_robot
from sphero_probe.transports.registry import SCHEMES

TROUBLE: Final = 2
"""The exit code of a comparison that could not be made."""
_PAGES: Final = ("table", "md", "json", "jsonl")
"""The formats that also show what is no difference."""


def show_diff(output: Output, before: str, after: str, *, values: bool) -> None:
    """Show the differences between two sides.

    Args:
        output: where and how.
        before: the first side, as typed.
        after: the second side.
        values: compare all values of answers.

    Raises:
        SpheroProbeError: a side cannot be read; its exit code is 2.
        Exit: with code 1, if there are differences.
    """
    try:
        diff = compare(*_sides(before, after), values=values)
        show(output, DIFFERENCES, diff_rows(diff))
    except SpheroProbeError as error:
        error.exit_code = TROUBLE
        raise
    except BrokenPipeError as error:
        raise click.exceptions.Exit(TROUBLE) from error
    except OSError as error:
        trouble = OutputError(f"cannot write the output: {error.strerror or error}", "is the disk full?")
        trouble.exit_code = TROUBLE
        raise trouble from error
    if output.format not in _PAGES:
        _say_the_rest(diff)
    if diff.differences:
        raise click.exceptions.Exit(1)


def _say_the_rest(diff: Diff) -> None:
    """Say on standard error what a list of differences does not show."""
    for text in warnings(diff_row(diff).data):
        say(f"note: {text}")
    say(ending(count_row(diff).data))


def _sides(before: str, after: str) -> tuple[Side, Side]:
    if before == after == CATALOGUE:
        raise UsageError("the catalogue is compared with a robot", "name a run, or fake:bolt")
    if before == CATALOGUE:
        other = side_of(after)
        return _catalogue(other), other
    first = side_of(before)
    return first, _catalogue(first) if after == CATALOGUE else side_of(after)


def _catalogue(other: Side) -> Side:
    robot = ROBOTS.get(other.robot)
    if robot is None:
        raise UsageError(f"{other.source}: its model is not known, so the catalogue has no list for it")
    return catalogue_side(robot)


def side_of(text: str) -> Side:
    """Return the side that a person names: a run, a file, or an address.

    Raises:
        SpheroProbeError: there is no such run, file or robot, or it cannot be read.
    """
    scheme, colon, rest = text.partition(":")
    if colon and scheme == "fake":
        robot = built_in_robot(rest)
        return firmware_side(text, robot.model, robot.name, robot.truth())
    if (colon and scheme in SCHEMES) or HARDWARE_ADDRESS.fullmatch(text):
        return claims_of_robot(text)
    try:
        return file_side(find_journal(text), text)
    except BadInputFileError as error:
        if robot_by_prefix(text):
            error.hint = f"to ask the robot of that name for its own list: ble:{text}"
        raise


def claims_of_robot(address: str) -> Side:
    """Ask a robot for its own list, and for nothing else.

    Raises:
        SpheroProbeError: it cannot be reached, or gives no list.
    """
    interrupts = Interrupts()
    sides: list[Side] = []

    async def work() -> None:
        async with connect(ConnectOptions(address), Consent()) as session:
            connection = session.connection
            target = usual_target(connection.robot, connection.port)
            run = start_run(claims(connection.generation, target), session, None, interrupts)
            findings = [record async for record in run.records() if isinstance(record, Finding)]
            sides.append(
                claims_side(address, connection.robot, connection.name, findings, session.link.codec)
            )

    run_interruptible(interrupts, work())
    return sides[0]
