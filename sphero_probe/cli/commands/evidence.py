"""The options of ``evidence`` and ``evidence check``."""

import click

from sphero_probe.cli.complete.lazily import offer
from sphero_probe.cli.options import device_options, output_options, seconds_option
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.values import COLOURS, ConnectOptions, Output


class _Group(StrictCommand, click.Group):
    """A group that is a command of its own, too."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options, then the subcommands."""
        super().format_options(ctx, formatter)
        self.format_commands(ctx, formatter)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the subcommand.

        Raises:
            UsageError: there is none of that name.
        """
        if args and args[0] not in self.commands:
            ctx.fail(f"no command '{args[0]}'; to check a file: sphero-probe evidence check {args[0]}")
        return super().resolve_command(ctx, args)


@click.group(
    "evidence",
    cls=_Group,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.option(
    "-o",
    "--output",
    "name",
    metavar="NAME",
    help="Write what can be shared to NAME.json and NAME.md.  [default: write nothing]",
    shell_complete=offer("files"),
)
@click.option("--show", is_flag=True, help="Print exactly what those two files hold.")
@seconds_option(
    "--idle",
    least=1,
    most=3600,
    about="At the end, send nothing for this long, to see when the robot sleeps.",
)
@click.option("--dry-run", is_flag=True, help="Print the exact bytes; send nothing.")
@click.option("--color", type=click.Choice(COLOURS), default="auto", help="When to use colour.")
@click.option("--debug", is_flag=True, expose_value=False, help="Show tracebacks.")
@device_options
@click.pass_context
def command(
    ctx: click.Context,
    connecting: ConnectOptions,
    name: str | None,
    idle: float | None,
    color: str,
    *,
    show: bool,
    dry_run: bool,
) -> None:
    """Ask a robot what no public source says, and write the answers without what identifies the robot.

    A short run: documented reads, commands that cannot exist, echoes, and wrong lengths where the robot
    rejects them; nothing else can be sent. Name, addresses and serial numbers are left out or replaced.
    Nothing is uploaded: read the two files, then attach them to an issue.

    Example: sphero-probe evidence --device fake:bolt-plus -o my-robot
    """
    if ctx.invoked_subcommand is None:
        from sphero_probe.cli.actions.evidence import EvidenceOptions, collect_evidence

        collect_evidence(connecting, EvidenceOptions(name, show, idle, dry_run, color))


@command.command("check", cls=StrictCommand)
@click.argument("file", metavar="FILE", shell_complete=offer("files"))
@output_options
def check(output: Output, file: str) -> None:
    """Check an evidence file, and print which open questions it settles.

    The file may come from a stranger. A file that is not valid gives one line and exit code 8.

    Example: sphero-probe evidence check my-robot.json
    """
    from sphero_probe.cli.actions.evidence import check_evidence

    check_evidence(output, file)
