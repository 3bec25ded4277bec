"""The options of ``sweep``."""

from functools import partial

import click

from sphero_probe.cli.check_options import check_options
from sphero_probe.cli.options import (
    asking_options,
    device_options,
    journal_options,
    output_options,
)
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.values import AskOptions, CheckOptions, ConnectOptions, JournalOptions, Output
from sphero_probe.cli.what_options import range_options


@click.command("sweep", cls=StrictCommand, words_belong_to="--did")
@range_options
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
    cid: str | None,
    plan: str | None,
    payload: str | None,
    capture: str | None,
    baseline: str | None,
    baseline_update: bool,
    fail_on: str | None,
) -> None:
    """Probe ranges of commands, or a plan, and report what exists.

    Documented reads are sent as documented. Other commands are sent with a length that no documented command
    takes: a robot that checks lengths rejects it without executing anything. The tool measures this first, on
    documented commands of each device. A command that does not check its length would run; after the first
    that does, no further wrong length is sent to that node. Commands that could do harm are blocked.

    Example: sphero-probe sweep --did 0x13 --device fake:bolt-plus
    """
    from sphero_probe.cli.actions.sweep import SweepOptions, sweep

    sweep(
        output,
        CheckOptions(baseline, baseline_update, fail_on),
        journal,
        connecting,
        asking,
        SweepOptions(did, cid, plan, payload, capture),
    )
