"""``catalog``: list the known commands that match a filter."""

from sphero_probe.catalogue import ROBOTS, all_rows, async_rows, commands_of, robot_by_word
from sphero_probe.catalogue.model import CommandRow
from sphero_probe.catalogue.naming import choose
from sphero_probe.cli.messages import say
from sphero_probe.cli.output import show
from sphero_probe.cli.values import Output
from sphero_probe.protocol.packets import Generation
from sphero_probe.reports.rows import command_row
from sphero_probe.reports.views import COMMANDS


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
        rows = commands_of(robot_by_word(model) or ROBOTS[choose(model, ROBOTS, "robot")])
    matching = [row for row in rows if pattern is None or _matches(row, pattern.lower())]
    show(output, COMMANDS, map(command_row, matching))
    if not matching:
        say("no known command matches; see: sphero-probe catalog")


def _matches(row: CommandRow, pattern: str) -> bool:
    words = (row.name, row.risk.word, f"0x{row.did:02x}:0x{row.cid:02x}", *row.aliases)
    return any(pattern in word for word in words)
