"""``evidence``: collect what settles open questions, write it redacted, and check such a file."""

import asyncio
import os
from pathlib import Path
from typing import Final, NamedTuple

import click

from sphero_probe.cli.connect import connect
from sphero_probe.cli.dry_run import show_dry_run
from sphero_probe.cli.messages import say
from sphero_probe.cli.output import show
from sphero_probe.cli.run import progress
from sphero_probe.cli.signals import Interrupts, run_interruptible
from sphero_probe.cli.values import ConnectOptions, Output
from sphero_probe.errors import IncompleteError, OutputError
from sphero_probe.link.policy import Consent
from sphero_probe.probing.collecting import Collecting, CollectingOptions
from sphero_probe.probing.evidence import Evidence, Topic
from sphero_probe.probing.open_questions import settlements
from sphero_probe.probing.plans.evidence import evidence_plan
from sphero_probe.probing.progress import Progress
from sphero_probe.reports.evidence import (
    SETTLEMENTS,
    headline,
    markdown,
    reservations,
    settlement_rows,
)
from sphero_probe.runs.evidence import encode, redact_once
from sphero_probe.runs.evidence_reader import read_evidence
from sphero_probe.session.addressing import (
    address_of,
    generation_behind,
    model_behind,
    port_behind,
    usual_target,
)

_SUFFIXES: Final = (".json", ".md")


class EvidenceOptions(NamedTuple):
    """What to do with the evidence, as typed.

    Attributes:
        name: of the two files, with or without a suffix; None to write none.
        show: print what the files hold.
        idle: seconds without a command at the end, None for none.
        dry_run: print what would be sent, and send nothing.
        color: when to use colour.
    """

    name: str | None = None
    show: bool = False
    idle: float | None = None
    dry_run: bool = False
    color: str = "auto"


def collect_evidence(connecting: ConnectOptions, options: EvidenceOptions) -> None:
    """Ask a robot, and print and write what can be shared.

    Args:
        connecting: which robot.
        options: what to do with the evidence.

    Raises:
        SpheroProbeError: the robot cannot be reached, or answers nothing.
        InterruptedRunError: a signal ended the run; what was found is printed and written.
        IncompleteError: the run ended early, or a wrong length was executed; likewise.
        OutputError: a file cannot be written.
    """
    place, output = address_of(connecting.device), Output(color=options.color)
    if options.dry_run:
        robot, generation, port = model_behind(place), generation_behind(place), port_behind(place)
        target = usual_target(robot, port)
        plan = evidence_plan(generation, robot, target, port)
        show_dry_run(output, plan, place, Consent(), target)
        return
    files = _files(options.name)
    interrupts = Interrupts()
    found: list[Evidence] = []

    async def work() -> None:
        stop = asyncio.Event()
        interrupts.stop_politely(stop)
        async with connect(connecting, Consent()) as session:
            with progress("evidence", output) as show_progress:

                def on_topic(topic: Topic) -> None:
                    done = list(Topic).index(topic)
                    show_progress(Progress(topic.value, done + 1, len(Topic), done, len(Topic)))
                    if topic is Topic.IDLE:
                        say(f"sending nothing for {options.idle:g} s ...")

                collecting = CollectingOptions(place.scheme, options.idle or 0.0, on_topic)
                evidence = await Collecting(session, stop, collecting).run()
            connection = session.connection
            identifiers = (connection.name, connection.address, connecting.device)
            found.append(redact_once(evidence, identifiers))

    try:
        run_interruptible(interrupts, work())
    finally:
        if found:
            _deliver(found[0], files, output, shown=options.show)
    if found and (problem := found[0].problem):
        raise IncompleteError(problem)


def _files(name: str | None) -> tuple[Path, Path] | None:
    """Return the two files to write, after checking that their folder can be written."""
    if name is None:
        return None
    path = Path(name)
    stem = path.with_suffix("") if path.suffix.lower() in _SUFFIXES else path
    if not stem.name or (stem.is_dir() and name.endswith(("/", os.sep))):
        raise OutputError(f"cannot write {name}: this names a folder, not a file")
    if not os.access(stem.parent, os.W_OK):
        raise OutputError(f"cannot write {name}: the folder does not exist, or is not writable")
    json_file, summary = (stem.with_name(stem.name + suffix) for suffix in _SUFFIXES)
    return json_file, summary


def write_evidence(evidence: Evidence, files: tuple[Path, Path]) -> None:
    """Write redacted evidence as JSON and as markdown.

    Args:
        evidence: redacted.
        files: the JSON file and the markdown file.

    Raises:
        OutputError: a file cannot be written.
    """
    for file, text in zip(files, (encode(evidence), markdown(evidence)), strict=True):
        try:
            file.write_text(text, encoding="utf-8", newline="\n")
        except OSError as error:
            raise OutputError(f"cannot write {file}: {error.strerror}") from error


def _deliver(evidence: Evidence, files: tuple[Path, Path] | None, output: Output, *, shown: bool) -> None:
    """Write the files, and print what they hold or which questions they settle."""
    if files:
        write_evidence(evidence, files)
    if shown:
        click.echo(markdown(evidence))
        click.echo(encode(evidence), nl=False)
    else:
        show(output, SETTLEMENTS, settlement_rows(evidence))
    for sentence in reservations(evidence):
        say(sentence)
    say(_outcome(evidence))
    if files:
        say(f"wrote {files[0]} and {files[1]}: read them, then attach both to an issue")
    else:
        say("nothing was written; to write the two files to share: -o NAME")


def _outcome(evidence: Evidence) -> str:
    said = [settled for _, (settled, _) in settlements(evidence)]
    return f"{headline(evidence)}: {sum(said)} of {len(said)} open questions settled"


def check_evidence(output: Output, file: str) -> None:
    """Check an evidence file and show what it settles.

    Args:
        output: where and how.
        file: its path.

    Raises:
        BadInputFileError: it is not a valid evidence file.
    """
    evidence = read_evidence(Path(file))
    show(output, SETTLEMENTS, settlement_rows(evidence))
    for sentence in reservations(evidence):
        say(sentence)
    say(_outcome(evidence))
