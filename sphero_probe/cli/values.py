"""The typed values of the options.

``--help`` imports this module, so it imports nothing of the layers below.
"""

import os
import sys
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Self

from sphero_probe.errors import RefusedByPolicyError, UsageError

if TYPE_CHECKING:
    from datetime import datetime

RISKS: Final = ("read", "probe", "write", "motion", "persist", "brick")
"""The risk classes as people type them: a copy of the catalogue's, to keep help fast (a test compares)."""
FORMATS: Final = ("table", "plain", "json", "jsonl", "csv", "md", "html", "junit")
"""The names of the formats: a copy of the reports', for the same reason."""
TOLERANCES: Final = ("source", "seq", "flags")
"""In what answers may differ; a copy of the link's, likewise."""
SORTS: Final = ("did", "outcome", "time", "rtt")
"""By what findings can be sorted; a copy of the reports', likewise."""
DOCUMENTS: Final = ("protocol",)
"""What ``report`` can write instead of a report."""
COLOURS: Final = ("auto", "always", "never")
SUFFIXES: Final = {
    ".json": "json",
    ".jsonl": "jsonl",
    ".csv": "csv",
    ".txt": "table",
    ".md": "md",
    ".html": "html",
    ".xml": "junit",
}
"""Suffix of an output file -> its format."""


class ConnectOptions(NamedTuple):
    """Which robot to connect to, and how.

    Attributes:
        device: the robot's address, empty for the only robot nearby.
        adapter: the Bluetooth adapter, empty for the usual one.
        connect_timeout: seconds for scanning, and for each step of connecting.
        verbose: print each step of connecting.
        tolerate: in what an answer may differ from what it should be and still count.
        capture: the pcapng file to write what is said to, None for none.
    """

    device: str = ""
    adapter: str = ""
    connect_timeout: float = 10.0
    verbose: bool = False
    tolerate: tuple[str, ...] = ()
    capture: str | None = None


class AskOptions(NamedTuple):
    """What may be sent, and to which node.

    Attributes:
        target: the node as typed, None for the robot's usual one.
        timeout: seconds until a command counts as silent, None to measure it.
        allow: the risk classes to allow.
        confirm: the robot's name, to allow the class ``brick``; otherwise empty.
        dry_run: print what would be sent, and send nothing.
    """

    target: str | None = None
    timeout: float | None = None
    allow: tuple[str, ...] = ()
    confirm: str = ""
    dry_run: bool = False

    @classmethod
    def checked(cls, **options: Any) -> Self:
        """Return the options, as the attributes are called.

        Raises:
            RefusedByPolicyError: the class ``brick`` is allowed without naming the robot.
            UsageError: a robot is named for nothing.
        """
        asking = cls(**options)
        _check_brick(asking.allow, confirmed=bool(asking.confirm), dry_run=asking.dry_run)
        return asking


class FleetConnectOptions(NamedTuple):
    """Which robots a fleet has, and how to connect to them.

    Attributes:
        everything: all robots nearby.
        file: a fleet file, None for none.
        devices: addresses.
        adapters: the Bluetooth adapters to use, empty for all.
        per_adapter: connections on each adapter at a time.
        connect_timeout: seconds for scanning, and for each step of connecting.
        tolerate: in what an answer may differ from what it should be and still count.
        scheduler: of Dask, whose workers reach the robots; empty if this host does.
        wait: seconds to wait for a worker that reaches a robot, None for the usual time.
    """

    everything: bool = False
    file: str | None = None
    devices: tuple[str, ...] = ()
    adapters: tuple[str, ...] = ()
    per_adapter: int = 4
    connect_timeout: float = 10.0
    tolerate: tuple[str, ...] = ()
    scheduler: str = ""
    wait: float | None = None

    @classmethod
    def checked(cls, **options: Any) -> Self:
        """Return the options, as the attributes are called.

        Raises:
            UsageError: the robots are named in no way, or in several, or options exclude each other.
        """
        connecting = cls(**options)
        ways = (connecting.everything, connecting.file is not None, bool(connecting.devices))
        if not any(ways):
            raise UsageError("no robot is named", "add --all, --robots FILE, or --device for each robot")
        if sum(ways) > 1:
            raise UsageError("--all, --robots and --device exclude each other")
        if connecting.scheduler and connecting.adapters:
            raise UsageError("--scheduler and --adapter exclude each other", "give --adapter to fleet worker")
        if connecting.wait is not None and not connecting.scheduler:
            raise UsageError("--wait needs --scheduler")
        return connecting


class FleetAskOptions(NamedTuple):
    """What may be sent to the robots of a fleet, and to which node.

    Attributes:
        target: the node as typed, None for each robot's usual one.
        timeout: seconds until a command counts as silent, None to measure it.
        allow: the risk classes to allow.
        confirm: the names of the robots for which the class ``brick`` is confirmed.
        dry_run: print what would be sent, and send nothing.
    """

    target: str | None = None
    timeout: float | None = None
    allow: tuple[str, ...] = ()
    confirm: tuple[str, ...] = ()
    dry_run: bool = False

    @classmethod
    def checked(cls, **options: Any) -> Self:
        """Return the options, as the attributes are called.

        Raises:
            RefusedByPolicyError: the class ``brick`` is allowed without naming a robot.
            UsageError: a robot is named for nothing.
        """
        asking = cls(**options)
        _check_brick(asking.allow, confirmed=bool(asking.confirm), dry_run=asking.dry_run)
        return asking


class FleetJournalOptions(NamedTuple):
    """Which journals a fleet keeps.

    Attributes:
        off: keep none.
        resume: finish the last run of each robot.
    """

    off: bool = False
    resume: bool = False

    @classmethod
    def checked(cls, **options: Any) -> Self:
        """Return the options, as the attributes are called.

        Raises:
            UsageError: they exclude each other.
        """
        journal = cls(**options)
        if journal.off and journal.resume:
            raise UsageError("--no-journal and --resume exclude each other")
        return journal


class FlagOptions(NamedTuple):
    """With which flags and source address a command is sent.

    Attributes:
        no_answer: ask for no response.
        only_errors: ask for a response on error only.
        no_activity: leave the robot's sleep timer as it is.
        source: the source address as it was typed, ``none`` for none, None for the usual one.
    """

    no_answer: bool = False
    only_errors: bool = False
    no_activity: bool = False
    source: str | None = None


class RunChoice(NamedTuple):
    """Which recorded runs are meant; the attributes are those of ``runs.kept_runs.RunFilter``.

    Attributes:
        outcome: ``complete`` or ``incomplete``, None for either.
    """

    robot: str = ""
    model: str = ""
    firmware: str = ""
    outcome: str | None = None
    tags: tuple[str, ...] = ()
    since: "datetime | None" = None
    until: "datetime | None" = None


class JournalOptions(NamedTuple):
    """Which journal a run keeps.

    Attributes:
        file: a new journal's path, None for a new file in the folder of runs.
        off: keep none.
        resume: the journal to continue, None for a new run.
    """

    file: str | None = None
    off: bool = False
    resume: str | None = None


class CheckOptions(NamedTuple):
    """What a run must come up to.

    Attributes:
        file: an earlier run to compare it with, None for nothing.
        update: write the run to that file.
        fail_on: outcomes that must not occur, or ``incomplete``, separated by commas; None for none.
    """

    file: str | None = None
    update: bool = False
    fail_on: str | None = None


class Output(NamedTuple):
    """Where and how results are written.

    Attributes:
        chosen: the format that was chosen, None for the default.
        file: a path, None for standard output.
        color: ``auto``, ``always`` or ``never``.
        header: begin tab-separated records with the names of the columns.
        detail: list what a table folds.
    """

    chosen: str | None = None
    file: str | None = None
    color: str = "auto"
    header: bool = False
    detail: bool = False

    @property
    def format(self) -> str:
        """The format to write."""
        if self.chosen:
            return self.chosen
        if self.file:
            return SUFFIXES.get(_suffix(self.file), "plain")
        return "table" if sys.stdout.isatty() else "plain"

    @classmethod
    def checked(cls, chosen: str | None, file: str | None, color: str, **more: bool) -> Self:
        """Return the output for these options, as the attributes are called.

        Raises:
            UsageError: no format is chosen, and the suffix of the file is not known.
        """
        if file and not chosen and (suffix := _suffix(file)) and suffix not in SUFFIXES:
            raise UsageError(
                f"{file}: the suffix {suffix} stands for no format",
                f"use {', '.join(SUFFIXES)}, or choose a format with --format",
            )
        return cls(chosen, file, color, **more)


def _check_brick(allow: tuple[str, ...], *, confirmed: bool, dry_run: bool = False) -> None:
    if "brick" in allow and not confirmed and not dry_run:
        raise RefusedByPolicyError(
            "--allow brick can destroy a robot: confirm it with the robot's name",
            "add --confirm NAME-OF-ROBOT, such as --confirm BP-1234",
        )
    if confirmed and "brick" not in allow:
        raise UsageError("--confirm belongs to --allow brick", "add --allow brick, or leave --confirm out")


def _suffix(file: str) -> str:
    return os.path.splitext(file)[1].lower()  # noqa: PTH122 - pathlib would slow down --help
