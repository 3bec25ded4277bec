"""Records read one by one, and the overview of a journal: the same as from the whole journal in memory."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import BadInputFileError
from sphero_probe.link.exchange import Silent
from sphero_probe.probing.finding import Confidence, Finding, Heading, Note, Outcome, Summary
from sphero_probe.protocol.packets import Command, Generation
from sphero_probe.runs.decode import Entry, Intent, Opening
from sphero_probe.runs.encode import encode
from sphero_probe.runs.overview import read_overview
from sphero_probe.runs.reader import read_journal
from sphero_probe.runs.record_stream import RecordStream

OPENING = Opening("sweep", "test", "", {}, "", "fake:bolt", Generation.V2, "bolt", "SB-1", ("read",))
HEADING = Heading("bolt", "Sphero BOLT", "SB-1", {}, "test", "0.1.0", ("read",), {}, "2026-01-02T03:04:05Z")


def finding(number: int, outcome: Outcome) -> Finding:
    command = Command(0x13, number)
    silent = Silent(command, 7, b"\x8d\xd8", 0.5)
    return Finding(number, command, outcome, Confidence.CERTAIN, Risk.READ, silent, None, "", 1)


ENTRIES: st.SearchStrategy[Entry] = st.one_of(
    st.builds(finding, st.integers(1, 6), st.sampled_from(Outcome)),
    st.builds(lambda number: Intent(number, Command(0x13, number), Risk.READ), st.integers(1, 6)),
    st.builds(
        lambda kind, text, target: Note(kind, text, {"target": target}),
        st.sampled_from(("calibration", "run")),
        st.text(max_size=3),
        st.none() | st.integers(17, 18) | st.just("odd"),
    ),
    st.just(HEADING),
    st.builds(lambda done: Summary({Outcome.EXISTS: 1}, 1.0, 1, 1, done), st.booleans()),
)


@given(entries=st.lists(ENTRIES, max_size=14), cut=st.integers(0, 60))
def test_a_stream_of_records_is_the_whole_journal(
    entries: list[Entry], cut: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.getbasetemp() / "run.jsonl"
    content = b"".join(map(encode, [OPENING, *entries]))
    path.write_bytes(content[: len(content) - cut])
    recorded = read_journal(path)
    with RecordStream(path) as stream:
        assert stream.opening == recorded.opening
        assert list(stream.records()) == recorded.records()


@given(entries=st.lists(ENTRIES, max_size=5), cut=st.integers(0, 60), counts=st.integers(0, 3))
def test_an_overview_is_that_of_the_whole_journal(
    entries: list[Entry], cut: int, counts: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.getbasetemp() / "run.jsonl"
    probed = [finding(number, Outcome.ABSENT) for number in range(1, counts + 1)]
    summary = Summary({Outcome.ABSENT: counts} if counts else {}, 1.0, counts, counts, counts != 1)
    notes = [entry for entry in entries if not isinstance(entry, Finding | Summary)]
    content = b"".join(map(encode, [OPENING, HEADING, *notes, *probed, summary]))
    path.write_bytes(content[: len(content) - cut])
    recorded = read_journal(path)
    overview = read_overview(path)
    heading = recorded.headings[0] if recorded.headings else None
    assert overview == (path, recorded.opening, heading, recorded.counts, recorded.complete)


@pytest.mark.parametrize(
    ("line", "problem"),
    [
        pytest.param(b'{"type":"finding","number":2,"did":300}\n', ":3: ", id="a finding"),
        pytest.param(b'{"type":"finding","number":99999999999}\n', ":3: ", id="a large number"),
        pytest.param(b"[]\n", ":3: not a JSON object", id="no object"),
        pytest.param(b'{"type":"cooking"}\n', ":3: an unknown type of line", id="an unknown type"),
        pytest.param(b"x" * ((1 << 20) + 1), ":3: a line of more than 1048576 bytes", id="a long line"),
    ],
)
def test_a_damaged_line_is_named(line: bytes, problem: str, tmp_path: Path) -> None:
    path = tmp_path / "run.jsonl"
    path.write_bytes(encode(OPENING) + encode(HEADING) + line + encode(finding(1, Outcome.EXISTS)))
    with pytest.raises(BadInputFileError, match=problem), RecordStream(path) as stream:
        list(stream.records())
