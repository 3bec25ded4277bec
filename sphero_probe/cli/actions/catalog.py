"""``catalog``: list the known commands that match a filter, or compare them with a library."""

from sphero_probe.catalogue import ROBOTS, all_rows, async_rows, commands_of, robot_by_word
from sphero_probe.catalogue.libraries.comparison import OURS, Difference, compare_library
from sphero_probe.catalogue.libraries.finding import find_library
from sphero_probe.catalogue.model import CommandRow, Robot
from sphero_probe.catalogue.naming import choose
from sphero_probe.cli.messages import say
from sphero_probe.cli.output import show
from sphero_probe.cli.values import Output
from sphero_probe.protocol.packets import Generation
from sphero_probe.reports.rows import command_row, difference_row
from sphero_probe.reports.views import COMMANDS, DIFFERENCES


def list_commands(output: Output, pattern: str | None, model: str | None, generation: str | None) -> None:
    """List the known commands.

    Args:
        output: where and how.
        pattern: part of a name, a risk class or an id; None for all.
        model: only those of this robot.
        generation: only those of this protocol, ``v1`` or ``v2``.

    Raises:
        UsageError: no robot has this name.
    """
    chosen = [Generation(generation)] if generation else list(Generation)
    rows = tuple(row for one in chosen for row in (*all_rows(one), *async_rows(one)))
    if model is not None:
        rows = commands_of(_robot(model))
    matching = [row for row in rows if pattern is None or _matches(row, pattern.lower())]
    show(output, COMMANDS, map(command_row, matching))
    if not matching:
        say("no known command matches; see: sphero-probe catalog")


def compare(
    output: Output, library: str, pattern: str | None, model: str | None, generation: str | None
) -> None:
    """List what only the catalogue or only a library knows.

    Args:
        output: where and how.
        library: its name, or the path of its source.
        pattern: part of a name or an id; None for all.
        model: only what only one side knows of this robot.
        generation: only this protocol, ``v1`` or ``v2``.

    Raises:
        UsageError: no robot has this name.
        BadInputFileError: the library is not there, or has no commands.
    """
    robot = None if model is None else _robot(model)
    found = find_library(library)
    differences = [
        one
        for one in compare_library(found)
        if generation in (None, one.generation.value)
        and (robot is None or robot.key in one.robots)
        and (pattern is None or _names(one, pattern.lower()))
    ]
    show(output, DIFFERENCES, map(difference_row, differences))
    theirs = sum(one.known_by != OURS for one in differences)
    say(
        f"{found.name}: {len(found.claims)} commands and notifications, {len(found.robots)} robots; "
        f"only there: {theirs}, only in the catalogue: {len(differences) - theirs}"
    )


def _robot(model: str) -> Robot:
    return robot_by_word(model) or ROBOTS[choose(model, ROBOTS, "robot")]


def _names(difference: Difference, pattern: str) -> bool:
    pair = f"0x{difference.did:02x}:0x{difference.cid:02x}"
    return any(pattern in word.lower() for word in (difference.name, difference.their_name, pair))


def _matches(row: CommandRow, pattern: str) -> bool:
    words = (row.name, row.risk.word, f"0x{row.did:02x}:0x{row.cid:02x}", *row.aliases)
    return any(pattern in word for word in words)
