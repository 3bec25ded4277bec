"""``report``: print a recorded run, or write the reference document of its robot."""

import gc
from collections.abc import Sequence
from pathlib import Path
from typing import Final, NamedTuple

from sphero_probe.catalogue import ROBOTS
from sphero_probe.catalogue.model import Robot
from sphero_probe.catalogue.naming import NUMBER, byte, choose, id_range
from sphero_probe.cli.output import show
from sphero_probe.cli.run import row_of
from sphero_probe.cli.values import Output
from sphero_probe.errors import BadInputFileError, UsageError
from sphero_probe.probing.finding import Finding, Heading, Outcome, Record
from sphero_probe.probing.notes import node_name
from sphero_probe.protocol.address import Address
from sphero_probe.protocol.packets import Generation
from sphero_probe.reports.phrases import counted_outcome
from sphero_probe.reports.registry import PAGES
from sphero_probe.reports.selection import Selection, select
from sphero_probe.reports.views import FINDING, FINDINGS, PROTOCOL
from sphero_probe.runs.json_report import is_json_report, read_json_report
from sphero_probe.runs.reader import read_journal
from sphero_probe.runs.record_stream import RecordStream
from sphero_probe.runs.store import find_journal

_SINGLE: Final = ("send", "led")
"""Commands of the tool whose findings are shown one by one."""
_OUTCOMES: Final = {counted_outcome(word.value): word.value for word in Outcome} | {
    word.value: word.value for word in Outcome
}
"""What people type -> the outcome: ``blocked`` is ``skipped``."""


class ReportOptions(NamedTuple):
    """What to show, as typed.

    Attributes:
        only: outcomes, None for all.
        did: devices, None for all.
        node: one node, None for all.
        unknown: only commands that no catalogue knows.
        sort: the order, empty for that of the run.
        document: ``protocol`` for the reference document, None for the report.
    """

    only: str | None = None
    did: str | None = None
    node: str | None = None
    unknown: bool = False
    sort: str = ""
    document: str | None = None


def show_run(output: Output, run: str, options: ReportOptions) -> None:
    """Show the records of a run.

    Args:
        output: where and how.
        run: a journal file, a run name, ``last``, or a report in JSON.
        options: which findings, and as what.

    Raises:
        BadInputFileError: there is no such run, or its file cannot be read.
        UsageError: an option is not valid.
    """
    path = find_journal(run)
    if options == ReportOptions() and not is_json_report(path):
        _stream_run(output, path)
        return
    records, single = _records(path)
    gc.freeze()  # the records stay until the end: the collector need not look at them again and again
    heading = next((record for record in records if isinstance(record, Heading)), None)
    robot = ROBOTS.get(heading.robot) if heading else None
    selection = _selection(options, records, robot)
    page = output.format in PAGES
    if options.document:
        if output.chosen not in (None, "md") or (output.file and output.format not in ("md", "plain")):
            raise UsageError(
                f"--as {options.document} is written in Markdown, not as {output.format}", "use -o FILE.md"
            )
        output, view, page = output._replace(chosen="md"), PROTOCOL, True
    elif single:
        view = FINDING
        records = [record for record in records if isinstance(record, Finding)]
    else:
        view = FINDINGS
    if selection == Selection():
        show(output, view, map(row_of, records))
    else:
        rows = select(records, row_of, selection, page=page and not single)
        show(output, view._replace(selection=selection), rows)


def _stream_run(output: Output, path: Path) -> None:
    """Show all records of a journal while it is read.

    Raises:
        BadInputFileError: it cannot be read.
    """
    with RecordStream(path) as stream:
        if stream.opening is None:
            raise BadInputFileError(f"{stream.path}: this journal is still empty")
        records = stream.records()
        if stream.opening.command in _SINGLE:
            show(output, FINDING, (row_of(record) for record in records if isinstance(record, Finding)))
        else:
            show(output, FINDINGS, map(row_of, records))


def _records(path: Path) -> tuple[Sequence[Record], bool]:
    """Return the records of a file, and whether they are of single commands, each shown in full."""
    if is_json_report(path):
        return read_json_report(path), False
    recorded = read_journal(path)
    if recorded.opening is None:
        raise BadInputFileError(f"{recorded.path}: this journal is still empty")
    return recorded.records(), recorded.opening.command in _SINGLE


def _selection(options: ReportOptions, records: Sequence[Record], robot: Robot | None) -> Selection:
    """Return what the options select.

    Raises:
        UsageError: a word is not known; a similar one is suggested.
    """
    outcomes = frozenset(
        _OUTCOMES[choose(word.strip().lower(), _OUTCOMES, "outcome")]
        for word in (options.only.split(",") if options.only is not None else ())
    )
    generation = robot.generation if robot else Generation.V2
    dids = id_range(options.did, generation, devices=True) if options.did is not None else None
    targets = {record.command.target for record in records if isinstance(record, Finding)}
    nodes = _nodes(options.node, targets, robot) if options.node is not None else None
    return Selection(
        outcomes, None if dids is None else frozenset(dids), nodes, options.unknown, options.sort
    )


def _nodes(text: str, targets: set[int | None], robot: Robot | None) -> frozenset[int | None]:
    """Return the address bytes of the node that the user means; none where the run asked no such node.

    Args:
        text: a node's name, its address or its number, or ``none`` for commands without an address.
        targets: the address bytes that the run asked.
        robot: the model, None if it is not known.
    """
    if NUMBER.fullmatch(text):
        number = byte(text, "node")
        return frozenset(target for target in targets if target is not None and _is_node(target, number))
    named: dict[str, set[int | None]] = {"none": {None}}
    named |= {name: set() for name in (robot.nodes.values() if robot else ())}
    for target in targets:
        named.setdefault(node_name(target, robot), set()).add(target)
    return frozenset(named[choose(text.lower(), named, "node")])


def _is_node(target: int, number: int) -> bool:
    """Whether a number is this address, or the number of its node."""
    return number in (target, Address.from_byte(target).node)
