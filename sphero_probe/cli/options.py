"""The options that commands share, one decorator each."""

from collections.abc import Callable
from typing import Any, Final, NamedTuple

import click

from sphero_probe.cli.complete.offers import offer_devices, offer_files, offer_nodes, offer_runs
from sphero_probe.cli.output import COLOURS, FORMATS, Output

Command = Callable[..., Any]

RISKS: Final = ("read", "probe", "write", "motion", "persist", "brick")
"""The risk classes as people type them; the catalogue's own words, repeated so that help stays light."""


class JournalOptions(NamedTuple):
    """Which journal a run keeps.

    Attributes:
        file: where, None for a new file in the state directory.
        off: keep none.
        resume: the journal to go on with, None for a new run.
    """

    file: str | None = None
    off: bool = False
    resume: str | None = None


def output_options(function: Command) -> Command:
    """Give a command ``--format``, ``--json``, ``-o``, ``--color`` and ``--debug``; it gets ``output``."""

    def collect(**arguments: Any) -> Any:
        chosen = "json" if arguments.pop("as_json") else arguments.pop("output_format")
        arguments.pop("output_format", None)
        output = Output(chosen, arguments.pop("output_file"), arguments.pop("color"))
        arguments.pop("debug")
        return function(output=output, **arguments)

    decorated = _instead_of(function, collect)
    for option in (
        click.option("--debug", is_flag=True, help="Show tracebacks."),
        click.option("--color", type=click.Choice(COLOURS), default="auto", help="When to colour."),
        click.option(
            "-o",
            "--output",
            "output_file",
            metavar="FILE",
            help="Write there instead of stdout.",
            shell_complete=offer_files,
        ),
        click.option("--json", "as_json", is_flag=True, help="The same as --format json."),
        click.option(
            "--format",
            "output_format",
            type=click.Choice(FORMATS),
            help="Default: table on a terminal, plain otherwise.",
        ),
    ):
        decorated = option(decorated)
    return decorated


def journal_options(function: Command) -> Command:
    """Give a command ``--journal`` and ``--no-journal``; it gets ``journal_choice``."""

    def collect(**arguments: Any) -> Any:
        journal_choice = JournalOptions(
            arguments.pop("journal"), arguments.pop("no_journal"), arguments.pop("resume", None)
        )
        return function(journal_choice=journal_choice, **arguments)

    decorated = _instead_of(function, collect)
    for option in (
        click.option("--no-journal", is_flag=True, help="Keep no journal of the run."),
        click.option(
            "--journal",
            metavar="FILE",
            help="Keep it there.  [default: see sphero-probe runs]",
            shell_complete=offer_files,
        ),
    ):
        decorated = option(decorated)
    return decorated


def resume_option(function: Command) -> Command:
    """Give a command with ``journal_options`` ``--resume``, too."""
    decorated: Command = click.option(
        "--resume",
        metavar="RUN",
        help="Go on with an interrupted run: its journal, or last.",
        shell_complete=offer_runs,
    )(function)
    return decorated


def _instead_of(function: Command, collect: Command) -> Command:
    """Let one function stand for another with the options it has already."""
    collect.__doc__ = function.__doc__
    collect.__name__ = function.__name__
    collect.__click_params__ = getattr(function, "__click_params__", [])  # type: ignore[attr-defined]
    return collect


def device_options(function: Command, *, unnamed: str = "the only robot nearby") -> Command:
    """Give a command ``--device``, ``--adapter``, ``--connect-timeout`` and ``-v``.

    Args:
        function: the command.
        unnamed: what is done without ``--device``, for the help.
    """
    for option in (
        click.option("-v", "--verbose", is_flag=True, help="Show each step of connecting."),
        click.option(
            "--connect-timeout",
            type=click.FloatRange(min=0.1, max=600),
            default=10.0,
            metavar="SECONDS",
            help="For scanning, and again for each step of connecting.  [default: 10]",
        ),
        click.option("--adapter", default="", metavar="NAME", help="The Bluetooth adapter, like hci1."),
        click.option(
            "-d",
            "--device",
            envvar="SPHERO_PROBE_DEVICE",
            default="",
            metavar="ROBOT",
            help=f"Name, its beginning (BP-12), address, or fake:bolt-plus; default: {unnamed}.",
            shell_complete=offer_devices,
        ),
    ):
        function = option(function)
    return function


def asking_options(function: Command) -> Command:
    """Give a command ``--target``, ``--timeout``, ``--allow``, ``--confirm`` and ``--dry-run``."""
    for option in (
        click.option("--dry-run", is_flag=True, help="Show the exact bytes and touch nothing."),
        click.option(
            "--confirm", default="", metavar="NAME", help="The robot's name, to allow the brick class."
        ),
        click.option(
            "--allow",
            multiple=True,
            type=click.Choice(RISKS),
            help="Allow a risk class, by name; may be repeated.",
        ),
        click.option(
            "--timeout",
            type=click.FloatRange(min=0.01, max=60),
            metavar="SECONDS",
            help="Until a command counts as silent.  [default: measured]",
        ),
        click.option(
            "--target",
            metavar="NODE",
            help="primary, secondary, 0x12 or none; default: the robot's usual.",
            shell_complete=offer_nodes,
        ),
    ):
        function = option(function)
    return function
