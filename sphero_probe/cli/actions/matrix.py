"""``matrix``: compare commands across robots and firmware, over all recorded runs."""

from collections.abc import Callable, Iterator

from sphero_probe.catalogue.naming import id_range, pair
from sphero_probe.cli.actions.runs import filter_of
from sphero_probe.cli.messages import say
from sphero_probe.cli.output import show
from sphero_probe.cli.values import Output, RunChoice
from sphero_probe.errors import BadInputFileError, UsageError
from sphero_probe.probing.finding import Finding
from sphero_probe.protocol.packets import Generation
from sphero_probe.reports.matrix import Matrix, column_title, is_had
from sphero_probe.reports.phrases import Data
from sphero_probe.reports.rows import finding_row
from sphero_probe.runs.kept_runs import kept_runs
from sphero_probe.runs.record_stream import RecordStream

_Matches = Callable[[int, int], bool]


def show_matrix(output: Output, what: tuple[str, ...], chosen: RunChoice) -> None:
    """Show which robots have a command, or the commands of a device.

    Args:
        output: where and how.
        what: devices and commands, by id or name.
        chosen: which runs.

    Raises:
        UsageError: a word is neither a device nor a command.
        BadInputFileError: the folder of runs cannot be read.
    """
    matches = {generation: _matching(what, generation) for generation in Generation}
    if not any(matches.values()):
        for word in what:
            _matches_of(word, Generation.V2)  # says what is wrong
    matrix = Matrix()
    for run in kept_runs(filter_of(chosen)):
        opening = run.overview.opening if run.overview else None
        wanted = matches[opening.generation] if opening else None
        if run.overview and opening and wanted:
            heading = run.overview.heading
            title = column_title(
                heading.model if heading else opening.robot, heading.firmware if heading else {}
            )
            try:
                with RecordStream(run.path) as stream:
                    matrix.add(title, _findings(stream, wanted))
            except BadInputFileError as error:
                say(f"left out: {error}")
    rows = matrix.rows()
    shown = [row for row in rows if output.format != "table" or len(rows) <= len(what) or is_had(row)]
    show(output, matrix.view, shown)
    if len(shown) < len(rows):
        say(f"Not shown: {len(rows) - len(shown)} commands that no robot has; --format plain lists them.")


def _findings(stream: RecordStream, wanted: _Matches) -> Iterator[Data]:
    for record in stream.records():
        if isinstance(record, Finding) and wanted(record.command.did, record.command.cid):
            yield finding_row(record).data


def _matching(what: tuple[str, ...], generation: Generation) -> _Matches | None:
    """Return what tells whether a pair is meant; None where this protocol has no such names."""
    try:
        tests = [_matches_of(word, generation) for word in what]
    except UsageError:
        return None
    return lambda did, cid: any(test(did, cid) for test in tests)


def _matches_of(word: str, generation: Generation) -> _Matches:
    if ":" in word or "." in word:
        meant = pair(word, generation)
        return lambda did, cid: (did, cid) == meant
    devices = frozenset(id_range(word, generation, devices=True))
    return lambda did, _: did in devices
