"""The command group: it imports the module of a command when the command is called, not for help."""

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

import click

from sphero_probe import __version__
from sphero_probe.errors import did_you_mean

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

COMMANDS: Final[dict[str, str]] = {
    "scan": "List the robots nearby.",
    "info": "Ask a robot about itself: firmware, battery, addresses.",
    "nodes": "Find the nodes of a robot, and what each serves.",
    "sweep": "Probe ranges of commands, or a plan, and report what exists.",
    "discover": "Map a whole robot: its nodes, its devices, every command.",
    "send": "Send one command and show the answer.",
    "led": "Set LEDs.",
    "listen": "Print notifications as they arrive.",
    "stream": "Stream sensors by name: live, as CSV, JSON lines or a chart.",
    "shell": "Keep one connection, and run commands over it.",
    "decode": "Decode packets from arguments, files or standard input.",
    "capture": "Show what is in a recording of Bluetooth or serial traffic.",
    "explain": "Explain an error code or a command.",
    "catalog": "List the known commands.",
    "plan": "List, show and check probe plans.",
    "report": "Print a recorded run in any format.",
    "diff": "Compare two runs, or a run with what is known.",
    "runs": "List the recorded runs; tag, prune or export them.",
    "matrix": "Compare commands across robots and firmware, over all runs.",
    "fleet": "Run one action on many robots at once, and compare them.",
    "serve": "Serve the built-in robot at a serial or TCP port, for other programs.",
    "evidence": "Ask a robot what no public source says, and write it to be shared.",
    "doctor": "Check that this machine can reach a robot, and suggest fixes.",
    "completion": "Print the script that completes commands in a shell.",
}
"""Command -> its line in ``--help``; the command is ``command`` in ``sphero_probe.cli.commands.<name>``."""

SECTIONS: Final[dict[str, tuple[str, ...]]] = {
    "Find a robot": ("scan", "info", "doctor"),
    "Map it": ("sweep", "discover", "nodes", "plan", "evidence", "fleet"),
    "Act on it": ("send", "led", "listen", "stream", "shell"),
    "Read and compare": ("decode", "capture", "explain", "catalog", "report", "diff", "matrix", "runs"),
    "Tools": ("serve", "completion"),
}
"""How ``--help`` groups the commands."""
EXIT_CODES: Final = (
    "Exit codes: 0 done; 1 failure, or a difference; 2 usage; 3 robot not found; 4 could not connect; "
    "5 incomplete; 6 blocked by the policy, or not confirmed; 7 the robot rejected the command; 8 bad input "
    "file; 9 no Bluetooth or serial port here; 10 cannot write output; 11 the journal is in use; 70 a bug; "
    "130 interrupted."
)
"""The codes in short; the README has the whole list."""


class LazyGroup(click.Group):
    """A group whose commands are the modules named in ``COMMANDS``."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the commands, in the order of ``COMMANDS``."""
        del ctx
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import a command; None for an unknown name."""
        del ctx
        if cmd_name not in COMMANDS:
            return None
        command: click.Command = import_module(f"sphero_probe.cli.commands.{cmd_name}").command
        command.short_help = COMMANDS[cmd_name]
        return command

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the arguments; ``help X`` and ``-v X`` stand for ``X --help`` and ``X -v``."""
        if args[:1] == ["help"]:
            args = [*args[1:], "--help"]
        elif args[:1] in (["-v"], ["--verbose"]) and len(args) > 1:
            args = [args[1], args[0], *args[2:]]
        return super().parse_args(ctx, args)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command that the arguments name.

        Raises:
            UsageError: there is none; the nearest is suggested.
        """
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            ctx.fail(f"no command '{args[0]}'; {did_you_mean(args[0], COMMANDS, 'see --help')}")
        return super().resolve_command(ctx, args)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> "list[CompletionItem[Any]]":
        """Offer the commands, without importing them, and the options."""
        from click.shell_completion import CompletionItem  # noqa: PLC0415 - help does without

        offers = [CompletionItem(name, help=said) for name, said in COMMANDS.items()]
        begun = [offer for offer in offers if offer.value.startswith(incomplete)]
        return [*begun, *click.Command.shell_complete(self, ctx, incomplete)]

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write a line for each command, without importing it."""
        del ctx
        wide = max(map(len, COMMANDS))
        for title, names in SECTIONS.items():
            with formatter.section(title):
                formatter.write_dl([(name.ljust(wide), COMMANDS[name]) for name in names])


@click.group(cls=LazyGroup, epilog=EXIT_CODES, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, "-V", "--version", message="sphero-probe %(version)s")
def group() -> None:
    """Map what a Sphero robot can do, from the terminal.

    It asks the robot first, measures whether the robot rejects wrong lengths before it probes unknown
    commands, and reports "inconclusive" where the evidence is thin. No robot at hand? Try
    --device fake:bolt-plus.
    """


def whole_group() -> click.Group:
    """Return the group with every command imported and its summary set, as a manual needs it."""
    context = click.Context(group)
    members = {name: command for name in COMMANDS if (command := group.get_command(context, name))}
    manual = click.Group(
        group.name,
        members,
        params=group.params,
        help=f"{group.help}\n\n{EXIT_CODES}",  # a man page has no epilog
        context_settings=group.context_settings,
    )
    _sum_up(manual)
    return manual


def _sum_up(command: click.Command) -> None:
    if not command.short_help:
        command.short_help = " ".join((command.help or "").partition("\n\n")[0].split())
    for member in command.commands.values() if isinstance(command, click.Group) else ():
        _sum_up(member)
