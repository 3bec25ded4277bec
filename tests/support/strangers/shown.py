"""Shows a run in every format and keeps it in a journal: what a robot says must break neither."""

from pathlib import Path
from tempfile import TemporaryDirectory

from sphero_probe.cli.run import row_of
from sphero_probe.probing.finding import Note
from sphero_probe.protocol.packets import Generation
from sphero_probe.reports.registry import FORMATS
from sphero_probe.runs.decode import Opening
from sphero_probe.runs.journal import Journal
from sphero_probe.runs.reader import read_journal
from tests.support.reports_by_hand import rendered
from tests.support.strangers.runs import Ran


def check_shown_and_kept(ran: Ran) -> None:
    """Check that every format shows the records, and that the journal gives them back."""
    for form in FORMATS:
        text = rendered(form, map(row_of, ran.records))
        assert text or not ran.findings, form
        assert not {"\x1b", "\x07", "\u202e"} & set(text), form
    with TemporaryDirectory() as folder:
        path = Path(folder) / "run.jsonl"
        _keep(ran, path)
        recorded = read_journal(path)
    assert not recorded.is_torn
    assert dict(recorded.findings) == {finding.number: finding for finding in ran.findings}
    notes = [record for record in ran.records if isinstance(record, Note)]
    assert [record.text for record in recorded.entries if isinstance(record, Note)] == [
        note.text for note in notes
    ]
    for form in FORMATS:
        assert rendered(form, map(row_of, recorded.records())) or not ran.findings, form


def _keep(ran: Ran, path: Path) -> None:
    generation = Generation.V1 if ran.stranger.firmware.older else Generation.V2
    opening = Opening(
        *("sweep", "test", "", {}, "", "AA:BB:CC:DD:EE:FF", generation, ran.stranger.model),
        *("Stranger", ("read",)),
    )
    with Journal.create(path) as journal:
        journal.open(opening)
        for record in ran.records:
            journal.record(record)
