"""``fleet evidence``: collect evidence on many robots, and write two files for each."""

from pathlib import Path

from sphero_probe.cli.actions.evidence import write_evidence
from sphero_probe.cli.actions.fleet import Asked, Results, run_fleet
from sphero_probe.cli.fleet_dry_run import show_fleet_dry_run
from sphero_probe.cli.messages import say
from sphero_probe.cli.values import FleetConnectOptions, Output
from sphero_probe.errors import OutputError
from sphero_probe.fleet.evidence import EvidenceAction
from sphero_probe.fleet.on_robot import FleetConsent


def fleet_evidence(
    output: Output,
    connecting: FleetConnectOptions,
    folder: str | None,
    idle: float | None,
    *,
    dry_run: bool,
) -> None:
    """Collect evidence on each robot, and write it if a folder is named; or show what would be sent.

    Args:
        output: where and how to report the robots.
        connecting: which robots, and how to connect.
        folder: where to write two files per robot, None to write none.
        idle: seconds without a command at the end, None for none.
        dry_run: send and write nothing.

    Raises:
        OutputError: the folder or a file cannot be written.
        SpheroProbeError: as ``run_fleet`` does.
    """
    if dry_run:
        show_fleet_dry_run("evidence", output, connecting, lambda _: EvidenceAction(), FleetConsent())
        return
    results: Results = {}
    asked = Asked(lambda _: EvidenceAction(idle or 0.0))
    try:
        if folder is not None:
            _make(Path(folder))
        run_fleet(output, connecting, asked, results)
    finally:
        if folder is not None:
            _write(Path(folder), results)


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot write {folder}: {error.strerror}") from error


def _write(folder: Path, results: Results) -> None:
    """Write the evidence of each robot; file names say the model, not the robot, as the files are shared."""
    written = 0
    for number, result in enumerate(results.values(), 1):
        if result.evidence:
            stem = folder / f"{result.evidence.robot or 'robot'}-{number}"
            write_evidence(result.evidence, (stem.with_suffix(".json"), stem.with_suffix(".md")))
            written += 1
    if written:
        many = "1 robot" if written == 1 else f"{written} robots"
        say(f"wrote two files for each of {many} to {folder}: read them before you share them")
