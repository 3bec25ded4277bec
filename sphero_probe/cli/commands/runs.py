"""The subcommands of ``runs`` and their options."""

from datetime import timedelta

import click

from sphero_probe.cli.age_type import Age
from sphero_probe.cli.complete.lazily import offer
from sphero_probe.cli.options import output_options
from sphero_probe.cli.run_options import run_filter_options
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.strict_group import StrictGroup, refuse_options
from sphero_probe.cli.values import Output, RunChoice


@click.group(
    "runs",
    cls=StrictGroup,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
@run_filter_options
@output_options
@click.pass_context
def command(ctx: click.Context, output: Output, chosen: RunChoice) -> None:
    """List the recorded runs, newest first.

    Example: sphero-probe runs --model bolt-plus --since 7d
    """
    if ctx.invoked_subcommand:
        refuse_options(ctx)
        return
    from sphero_probe.cli.actions.runs import list_runs

    list_runs(output, chosen)


@command.command("tag", cls=StrictCommand)
@click.argument("run", metavar="RUN", shell_complete=offer("runs"))
@click.argument("words", metavar="WORD...", nargs=-1, required=True)
@click.option("--remove", is_flag=True, help="Take these tags away.")
@output_options
def tag(output: Output, run: str, words: tuple[str, ...], remove: bool) -> None:
    """Tag a run, to find it again and to keep it from prune.

    RUN is a run name, a journal file, or "last". The tags are in a file beside the journal.

    Example: sphero-probe runs tag last before-update
    """
    from sphero_probe.cli.actions.runs import tag_run

    tag_run(output, run, words, remove=remove)


@command.command("prune", cls=StrictCommand)
@click.option(
    "--keep",
    type=click.IntRange(min=0),
    required=True,
    metavar="N",
    help="Keep the N runs that were written last.",
)
@click.option("--older-than", type=Age(), metavar="AGE", help="Remove only runs older than this, like 30d.")
@click.option("--dry-run", is_flag=True, help="List what would be removed; remove nothing.")
@output_options
def prune(output: Output, keep: int, older_than: timedelta | None, dry_run: bool) -> None:
    """Remove old runs, and list them.

    The last run of each robot stays, and so do tagged runs, runs in use, and damaged journals.

    Example: sphero-probe runs prune --keep 100 --older-than 30d --dry-run
    """
    from sphero_probe.cli.actions.runs_prune import prune_runs

    prune_runs(output, keep, older_than, dry_run=dry_run)


@command.command("export", cls=StrictCommand)
@click.argument("file", metavar="FILE", shell_complete=offer("files"))
@click.option("--format", "form", type=click.Choice(("sqlite",)), default="sqlite", help="The only format.")
@run_filter_options
@click.option("--debug", is_flag=True, expose_value=False, help="Show tracebacks.")
def export(file: str, form: str, chosen: RunChoice) -> None:
    """Write runs into one SQLite file, for sqlite-utils, Datasette or DuckDB.

    Example: sphero-probe runs export --format sqlite runs.db
    """
    del form  # there is only one
    from sphero_probe.cli.actions.runs_export import export_runs

    export_runs(file, chosen)
