"""The options that several commands share: a decorator for each group, which a command gets as one value.

``--help`` imports this module, so it imports nothing but click.
"""

from typing import Final

import click

from sphero_probe.cli.complete.lazily import offer
from sphero_probe.cli.gathered import Function, gather
from sphero_probe.cli.time_type import Seconds
from sphero_probe.cli.values import (
    COLOURS,
    FORMATS,
    RISKS,
    SUFFIXES,
    TOLERANCES,
    AskOptions,
    ConnectOptions,
    FlagOptions,
    JournalOptions,
    Output,
)


def seconds_option(
    *names: str, least: float, most: float, about: str, default: float | None = None
) -> Function:
    """Return an option that takes a time.

    Args:
        *names: as ``click.option`` takes them.
        least: the shortest time, in seconds.
        most: the longest.
        about: its text in ``--help``.
        default: seconds without the option, None for no time.
    """
    return click.option(*names, type=Seconds(least, most), default=default, metavar="TIME", help=about)


CONNECT_TIMEOUT: Final = seconds_option(
    "--connect-timeout",
    "connecting_connect_timeout",
    least=0.1,
    most=600,
    default=10.0,
    about="Limit for the scan, and for each step of connecting.  [default: 10s]",
)
TOLERATE: Final = click.option(
    "--tolerate",
    "connecting_tolerate",
    multiple=True,
    type=click.Choice(TOLERANCES),
    help="Accept answers that name another node, another number, or lack the response flag.",
)
_CAPTURE: Final = click.option(
    "--capture",
    "connecting_capture",
    metavar="FILE",
    help="Write all frames to this pcapng file, which Wireshark reads.",
)


def device_options(
    function: Function, *, unnamed: str = "the only robot nearby", capture: bool = True
) -> Function:
    """Give a command ``--device`` and what says how to connect; it gets ``connecting``.

    Args:
        function: the command.
        unnamed: what happens without ``--device``, for the help.
        capture: with ``--capture`` too.
    """
    return gather(
        function,
        "connecting",
        ConnectOptions,
        click.option(
            "-d",
            "--device",
            "connecting_device",
            envvar="SPHERO_PROBE_DEVICE",
            metavar="ROBOT",
            callback=_check_device,
            help=(
                "Name or its beginning (BP-12), Bluetooth address, serial:/dev/ttyS0, rfcomm:/dev/rfcomm0 or "
                f"fake:bolt-plus; default: SPHERO_PROBE_DEVICE, or {unnamed}."
            ),
            shell_complete=offer("devices"),
        ),
        adapter_option("connecting_adapter"),
        CONNECT_TIMEOUT,
        click.option(
            "-v", "--verbose", "connecting_verbose", is_flag=True, help="Show each step of connecting."
        ),
        TOLERATE,
        *([_CAPTURE] if capture else []),
    )


def adapter_option(name: str = "adapter") -> Function:
    """Return ``--adapter``.

    Args:
        name: of the parameter.
    """
    return click.option(
        "--adapter", name, default="", metavar="NAME", help="The Bluetooth adapter, like hci1."
    )


def _check_device(ctx: click.Context, param: click.Parameter, value: str | None) -> str:
    if value is not None and not value.strip():
        raise click.BadParameter("the name is empty; leave --device out for the only one nearby", ctx, param)
    if value and value.startswith("replay:"):
        from sphero_probe.cli.replay_address import with_path  # noqa: PLC0415 - only a recorded robot needs it

        return with_path(value)
    return value or ""


TARGET: Final = click.option(
    "--target",
    "asking_target",
    metavar="NODE",
    help="Node: primary, secondary, 0x12 or none; default: the robot's usual node.",
    shell_complete=offer("nodes"),
)
TIMEOUT: Final = seconds_option(
    "--timeout",
    "asking_timeout",
    least=0.01,
    most=60,
    about="Time until a command counts as silent.  [default: measured]",
)


def asking_options(function: Function) -> Function:
    """Give a command ``--target``, ``--timeout``, ``--allow``, ``--confirm``, ``--dry-run``: ``asking``."""
    return gather(
        function,
        "asking",
        AskOptions.checked,
        TARGET,
        TIMEOUT,
        *_consent(),
        click.option(
            "--dry-run", "asking_dry_run", is_flag=True, help="Print the exact bytes; send nothing."
        ),
    )


def flag_options(function: Function) -> Function:
    """Give a command ``--no-answer``, ``--only-errors``, ``--no-activity`` and ``--source``: ``flags``."""
    return gather(
        function,
        "flags",
        FlagOptions,
        click.option("--no-answer", "flags_no_answer", is_flag=True, help="Ask for no answer."),
        click.option(
            "--only-errors", "flags_only_errors", is_flag=True, help="Ask for an answer on error only (V2)."
        ),
        click.option(
            "--no-activity", "flags_no_activity", is_flag=True, help="Do not reset the robot's sleep timer."
        ),
        click.option(
            "--source",
            "flags_source",
            metavar="ADDRESS",
            help="The address of the sender, 0x01, or none (V2).  [default: 0x01 beside a target]",
        ),
    )


def consent_options(function: Function) -> Function:
    """Give a command ``--allow`` and ``--confirm`` only; it gets ``asking``."""
    return gather(function, "asking", AskOptions.checked, *_consent())


ALLOW: Final = click.option(
    "--allow",
    "asking_allow",
    multiple=True,
    type=click.Choice(RISKS),
    help=(
        "Also allow this risk class; may be repeated. write: LEDs, volume, streaming; motion: "
        "moving, noise, sleep; persist: names, settings, animations; brick: firmware, factory data, "
        "deep sleep."
    ),
)


def _consent() -> tuple[Function, Function]:
    return (
        ALLOW,
        click.option(
            "--confirm",
            "asking_confirm",
            default="",
            metavar="NAME",
            help="The robot's name, to allow the class brick.",
        ),
    )


def journal_options(function: Function, *, resume: bool = False) -> Function:
    """Give a command ``--journal`` and ``--no-journal``; it gets ``journal``.

    Args:
        function: the command.
        resume: give it ``--resume``, too.
    """
    resuming = click.option(
        "--resume",
        "journal_resume",
        metavar="RUN",
        help='Resume an interrupted run: a journal file, a run name, or "last", the last unfinished one.',
        shell_complete=offer("runs"),
    )
    return gather(
        function,
        "journal",
        JournalOptions,
        *((resuming,) if resume else ()),
        click.option(
            "--journal",
            "journal_file",
            metavar="FILE",
            help="Write the journal to FILE.  [default: see sphero-probe runs]",
            shell_complete=offer("files"),
        ),
        click.option("--no-journal", "journal_off", is_flag=True, help="Write no journal."),
    )


def output_options(function: Function, *, detail: bool = False) -> Function:
    """Give a command ``--format``, ``--json``, ``-o``, ``--header``, ``--color`` and ``--debug``: ``output``.

    Args:
        function: the command.
        detail: with ``--detail`` too.
    """
    detailed = click.option(
        "--detail", "output_detail", is_flag=True, help="List in a table what it folds otherwise."
    )
    return gather(
        function,
        "output",
        Output.checked,
        click.option(
            "--format",
            "output_chosen",
            type=click.Choice(FORMATS),
            help="Default: table on a terminal, plain otherwise.",
        ),
        click.option("--json", "output_chosen", flag_value="json", help="The same as --format json."),
        click.option(
            "-o",
            "--output",
            "output_file",
            metavar="FILE",
            help=f"Write to FILE instead of stdout; {', '.join(SUFFIXES)} choose the format.",
            shell_complete=offer("files"),
        ),
        click.option(
            "--header",
            "output_header",
            is_flag=True,
            help="Begin plain output with its column names.",
        ),
        *([detailed] if detail else []),
        click.option(
            "--color", "output_color", type=click.Choice(COLOURS), default="auto", help="When to use colour."
        ),
        click.option("--debug", is_flag=True, expose_value=False, help="Show tracebacks."),
    )
