"""The subcommands of ``fleet`` and their options."""

from functools import partial
from typing import Final

import click

from sphero_probe.cli.complete.lazily import offer
from sphero_probe.cli.fleet_options import (
    FLEET_DRY_RUN,
    adapters_option,
    devices_option,
    fleet_asking_options,
    fleet_journal_options,
    per_adapter_option,
    robots_options,
    scheduler_option,
)
from sphero_probe.cli.options import output_options, seconds_option
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.strict_group import OptionlessGroup
from sphero_probe.cli.values import FleetAskOptions, FleetConnectOptions, FleetJournalOptions, Output
from sphero_probe.cli.what_options import led_options, range_options

_SCAN_SECONDS: Final = 5.0
_matrix = click.option(
    "--matrix", is_flag=True, help="In plain and csv, write the matrix of commands and robots."
)


@click.group("fleet", cls=OptionlessGroup, context_settings={"help_option_names": ["-h", "--help"]})
def command() -> None:
    """Run one action on many robots at once, and compare them.

    The robots are those of a file, those named with --device, or all nearby. Bluetooth adapters are used in
    turn. A robot that fails does not stop the others; the report says what went wrong. Exit code 5 means that
    a robot has no complete result.

    Example: sphero-probe fleet health --device fake:bolt-plus --device fake:rvr
    """


@command.command("health", cls=StrictCommand)
@robots_options
@output_options
def health(output: Output, connecting: FleetConnectOptions) -> None:
    """Check each robot: awake, firmware of each node, battery, round trips, dead nodes.

    Example: sphero-probe fleet health --device fake:bolt-plus --device fake:rvr
    """
    from sphero_probe.cli.actions.fleet import fleet_health

    fleet_health(output, connecting)


@command.command("sweep", cls=StrictCommand, words_belong_to="--did")
@range_options
@_matrix
@fleet_asking_options
@robots_options
@fleet_journal_options
@partial(output_options, detail=True)
def sweep(
    output: Output,
    journal: FleetJournalOptions,
    connecting: FleetConnectOptions,
    asking: FleetAskOptions,
    did: str | None,
    cid: str | None,
    plan: str | None,
    payload: str | None,
    capture: str | None,
    *,
    matrix: bool,
) -> None:
    """Probe ranges of commands, or a plan, on each robot, and list the commands in which they differ.

    Every robot keeps a journal of its own, under the same rules as the command sweep.

    Example: sphero-probe fleet sweep --did 0x13 --device fake:bolt-plus --device fake:bolt
    """
    from sphero_probe.cli.actions.fleet import fleet_sweep
    from sphero_probe.cli.actions.sweep import SweepOptions

    options = SweepOptions(did, cid, plan, payload, capture)
    fleet_sweep(output, journal, connecting, asking, options, matrix=matrix)


@command.command("discover", cls=StrictCommand)
@click.option(
    "--did", metavar="IDS", help="Only these device ids.  [default: all 256]", shell_complete=offer("dids")
)
@click.option("--lengths", is_flag=True, help="Also find the lengths that unknown commands accept.")
@click.option("--values", is_flag=True, help="Also try other values where a value was rejected.")
@_matrix
@fleet_asking_options
@robots_options
@fleet_journal_options
@partial(output_options, detail=True)
def discover(
    output: Output,
    journal: FleetJournalOptions,
    connecting: FleetConnectOptions,
    asking: FleetAskOptions,
    did: str | None,
    *,
    lengths: bool,
    values: bool,
    matrix: bool,
) -> None:
    """Map each robot whole, and list the commands in which they differ.

    Example: sphero-probe fleet discover --did power --device fake:bolt-plus --device fake:bolt
    """
    from sphero_probe.cli.actions.fleet import fleet_discover

    wanted = {"lengths": str(int(lengths)), "values": str(int(values))} | ({"did": did} if did else {})
    fleet_discover(output, journal, connecting, asking, wanted, matrix=matrix)


@command.command("evidence", cls=StrictCommand)
@click.option(
    "--folder",
    metavar="FOLDER",
    help="Write what can be shared to this folder, two files per robot.  [default: write nothing]",
    shell_complete=offer("files"),
)
@seconds_option(
    "--idle",
    least=1,
    most=3600,
    about="At the end, send nothing for this long, to see when each robot sleeps.",
)
@FLEET_DRY_RUN
@robots_options
@output_options
def evidence(
    output: Output,
    connecting: FleetConnectOptions,
    folder: str | None,
    idle: float | None,
    *,
    asking_dry_run: bool,
) -> None:
    """Collect evidence on each robot, under the same rules as the command evidence.

    Example: sphero-probe fleet evidence --device fake:bolt-plus --device fake:rvr
    """
    from sphero_probe.cli.actions.fleet_evidence import fleet_evidence

    fleet_evidence(output, connecting, folder, idle, dry_run=asking_dry_run)


@command.command("led", cls=StrictCommand)
@led_options
@fleet_asking_options
@robots_options
@partial(fleet_journal_options, resume=False)
@output_options
def led(
    output: Output,
    journal: FleetJournalOptions,
    connecting: FleetConnectOptions,
    asking: FleetAskOptions,
    front: str | None,
    back: str | None,
    leds: tuple[str, ...],
    *,
    off: bool,
) -> None:
    """Light each robot in another colour, to tell which is which; or set the named LEDs on all.

    Example: sphero-probe fleet led --device fake:bolt-plus --device fake:rvr
    """
    from sphero_probe.cli.actions.fleet import fleet_led

    fleet_led(output, journal, connecting, asking, front, back, leds, off=off)


@command.command("scan", cls=StrictCommand)
@seconds_option(
    "--timeout", least=0.1, most=600, default=_SCAN_SECONDS, about="How long to listen.  [default: 5s]"
)
@click.option(
    "--save",
    metavar="FILE",
    help="Write the robots to a fleet file (.toml or .csv), for --robots.",
    shell_complete=offer("files"),
)
@adapters_option("adapters")
@output_options
def scan(output: Output, timeout: float, save: str | None, adapters: tuple[str, ...]) -> None:
    """List the robots nearby through all adapters, and write them to a fleet file.

    Example: sphero-probe fleet scan --timeout 3 --save class.toml
    """
    from sphero_probe.cli.actions.fleet_scan import fleet_scan

    fleet_scan(output, timeout, save, adapters)


@command.command("worker", cls=StrictCommand)
@scheduler_option(
    "scheduler", required=True, about="The Dask scheduler: tcp://HOST:PORT, or tls://HOST:PORT."
)
@devices_option("devices", "A robot to offer; repeat it for each robot.  [default: those that scans find]")
@adapters_option("adapters")
@per_adapter_option("per_adapter")
@seconds_option(
    "--timeout",
    least=0.1,
    most=600,
    default=_SCAN_SECONDS,
    about="How long each scan listens.  [default: 5s]",
)
@click.option(
    "--listen",
    metavar="ADDRESS",
    help="Let other machines connect to this worker at this IP address.  [default: 127.0.0.1 only]",
)
def worker(
    scheduler: str,
    devices: tuple[str, ...],
    adapters: tuple[str, ...],
    per_adapter: int,
    timeout: float,
    listen: str | None,
) -> None:
    """Offer the robots near this host to fleet commands on other hosts, through a Dask scheduler.

    It needs the extra dask. Anyone who can reach the scheduler can run code on this host. The worker ends
    when the scheduler does, and on Ctrl-C; other workers that reach its robots then finish their runs.

    Example: sphero-probe fleet worker --scheduler tcp://127.0.0.1:8786 --device fake:bolt-plus
    """
    from sphero_probe.cli.actions.fleet_worker import serve_fleet

    serve_fleet(scheduler, devices, adapters, per_adapter, timeout, listen)
