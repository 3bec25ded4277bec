"""The options of ``discover``."""

from functools import partial

import click

from sphero_probe.cli.check_options import check_options
from sphero_probe.cli.complete.lazily import offer
from sphero_probe.cli.options import (
    asking_options,
    device_options,
    journal_options,
    output_options,
)
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.values import AskOptions, CheckOptions, ConnectOptions, JournalOptions, Output


@click.command("discover", cls=StrictCommand)
@click.option(
    "--did", metavar="IDS", help="Only these device ids.  [default: all 256]", shell_complete=offer("dids")
)
@click.option("--lengths", is_flag=True, help="Also find the lengths that unknown commands accept.")
@click.option("--values", is_flag=True, help="Also try other values where a value was rejected.")
@asking_options
@device_options
@partial(journal_options, resume=True)
@check_options
@partial(output_options, detail=True)
def command(
    output: Output,
    journal: JournalOptions,
    connecting: ConnectOptions,
    asking: AskOptions,
    did: str | None,
    lengths: bool,
    values: bool,
    baseline: str | None,
    baseline_update: bool,
    fail_on: str | None,
) -> None:
    """Map a whole robot: its firmware, its nodes, its devices, every command of each.

    The report compares the findings with the robot's own list. At the end, every command that exists or was
    silent is sent once more, one at a time; if the answer differs, the finding becomes inconclusive.
    Wrong lengths are sent under the same rules as by sweep. --lengths and --values execute unknown commands;
    they need --allow.

    Example: sphero-probe discover --device fake:bolt-plus
    """
    from sphero_probe.cli.actions.discover import discover

    discover(
        output,
        CheckOptions(baseline, baseline_update, fail_on),
        journal,
        connecting,
        asking,
        did,
        lengths=lengths,
        values=values,
    )
