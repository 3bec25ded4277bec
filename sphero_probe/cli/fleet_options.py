"""The options that the subcommands of ``fleet`` share.

``--help`` imports this module, so it imports nothing but click.
"""

import re
from typing import Any, Final

import click

from sphero_probe.cli.complete.lazily import offer
from sphero_probe.cli.gathered import Function, gather
from sphero_probe.cli.options import ALLOW, CONNECT_TIMEOUT, TARGET, TIMEOUT, TOLERATE, seconds_option
from sphero_probe.cli.values import FleetAskOptions, FleetConnectOptions, FleetJournalOptions
from sphero_probe.errors import UsageError

_SCHEDULER: Final = re.compile(r"(tcp|tls)://(\[[0-9A-Fa-f:]+\]|[A-Za-z0-9._-]+):[0-9]{1,5}")


def adapters_option(name: str) -> Function:
    """Return ``--adapter``, which may be repeated.

    Args:
        name: of the parameter.
    """
    return click.option(
        "--adapter",
        name,
        multiple=True,
        metavar="NAME",
        help="A Bluetooth adapter, like hci1; may be repeated.  [default: all]",
    )


def per_adapter_option(name: str) -> Function:
    """Return ``--per-adapter``.

    Args:
        name: of the parameter.
    """
    return click.option(
        "--per-adapter",
        name,
        type=click.IntRange(1, 64),
        default=4,
        metavar="N",
        help="Robots connected through one adapter at a time.  [default: 4]",
    )


def scheduler_option(name: str, *, about: str, **more: Any) -> Function:
    """Return ``--scheduler``.

    Args:
        name: of the parameter.
        about: the help text.
        **more: as ``click.option`` takes them.
    """
    return click.option("--scheduler", name, metavar="ADDRESS", callback=_check_scheduler, help=about, **more)


def devices_option(name: str, about: str) -> Function:
    """Return ``--device``, which may be repeated.

    Args:
        name: of the parameter.
        about: the help text.
    """
    return click.option(
        "-d",
        "--device",
        name,
        multiple=True,
        metavar="ROBOT",
        callback=_check_devices,
        help=about,
        shell_complete=offer("devices"),
    )


def robots_options(function: Function) -> Function:
    """Give a command the robots of a fleet and how to connect to them; it gets ``connecting``."""
    return gather(
        function,
        "connecting",
        FleetConnectOptions.checked,
        click.option("--all", "connecting_everything", is_flag=True, help="All robots nearby."),
        click.option(
            "--robots",
            "connecting_file",
            metavar="FILE",
            help="The robots of a fleet file (.toml or .csv), which fleet scan --save writes.",
            shell_complete=offer("files"),
        ),
        devices_option(
            "connecting_devices", "A robot: name, address or fake:bolt-plus; repeat it for each robot."
        ),
        adapters_option("connecting_adapters"),
        per_adapter_option("connecting_per_adapter"),
        scheduler_option(
            "connecting_scheduler",
            default="",
            about="Use the robots that the workers of this Dask scheduler reach: tcp://HOST:PORT.",
        ),
        seconds_option(
            "--wait",
            "connecting_wait",
            least=1,
            most=86400,
            about="How long to wait for a worker that reaches a robot.  [default: 1m]",
        ),
        CONNECT_TIMEOUT,
        TOLERATE,
        _refused(
            "--capture",
            "a capture holds the frames of one robot, and a fleet has many",
            "after a run, for each robot: sphero-probe capture convert RUN -o FILE",
        ),
    )


FLEET_DRY_RUN: Final = click.option(
    "--dry-run",
    "asking_dry_run",
    is_flag=True,
    help="Print how much would be sent to each robot and what is blocked; send nothing.",
)


def fleet_asking_options(function: Function) -> Function:
    """Give a command ``--target``, ``--timeout``, ``--allow``, ``--confirm``, ``--dry-run``: ``asking``."""
    return gather(
        function,
        "asking",
        FleetAskOptions.checked,
        TARGET,
        TIMEOUT,
        ALLOW,
        click.option(
            "--confirm",
            "asking_confirm",
            multiple=True,
            metavar="NAME",
            help="A robot's name, to allow the class brick on it; repeat it for each robot.",
        ),
        FLEET_DRY_RUN,
    )


def fleet_journal_options(function: Function, *, resume: bool = True) -> Function:
    """Give a command ``--no-journal`` and ``--resume``; it gets ``journal``.

    Args:
        function: the command.
        resume: with ``--resume``.
    """
    resuming = click.option(
        "--resume",
        "journal_resume",
        is_flag=True,
        help="Finish each robot's last run of this plan; what is finished is not sent again.",
    )
    return gather(
        function,
        "journal",
        FleetJournalOptions.checked,
        *((resuming,) if resume else ()),
        click.option("--no-journal", "journal_off", is_flag=True, help="Write no journals."),
        _refused(
            "--journal",
            "each robot of a fleet keeps a journal of its own",
            "sphero-probe runs lists them; sphero-probe runs export writes them to one file",
        ),
    )


def _check_scheduler(ctx: click.Context, param: click.Parameter, value: str) -> str:
    if value and not _SCHEDULER.fullmatch(value):
        raise click.BadParameter(f"'{value}' is no address; write it like tcp://127.0.0.1:8786", ctx, param)
    return value


def _refused(option: str, why: str, instead: str) -> Function:
    """Return a hidden option of the single command that says what a fleet has instead.

    Args:
        option: as it is typed.
        why: a fleet does not have it.
        instead: what to do.
    """

    def refuse(_ctx: click.Context, _param: click.Parameter, value: str | None) -> None:
        if value is not None:
            raise UsageError(f"{option}: {why}", instead)

    name = f"no_{option.removeprefix('--')}"
    return click.option(option, name, hidden=True, expose_value=False, callback=refuse)


def _check_devices(ctx: click.Context, param: click.Parameter, value: tuple[str, ...]) -> Any:
    if any(not device.strip() for device in value):
        raise click.BadParameter("a name is empty; --all uses all robots nearby", ctx, param)
    return value
