"""What resuming a run needs of its journal, compared with all that the journal holds."""

from collections.abc import Iterator
from contextlib import closing, contextmanager
from io import BytesIO
from pathlib import Path
from typing import Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import BadInputFileError
from sphero_probe.link.exchange import Answered, Exchange, Silent
from sphero_probe.probing.finding import Confidence, Finding, Note, Outcome
from sphero_probe.probing.notes import EXECUTED
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation, Response
from sphero_probe.runs.decode import Opening
from sphero_probe.runs.encode import encode, encode_finding, encode_intent
from sphero_probe.runs.interrupted import InterruptedRun
from sphero_probe.runs.reader import read_journal

CODEC: Final = CODECS[Generation.V2]
OPENING: Final = encode(
    Opening("sweep", "sweep", "", {}, "", "fake:bolt", Generation.V2, "bolt", "SB-1", ("read",))
)


def command(number: int) -> Command:
    return Command(0x13, number, b"", 0x11)


def finding(number: int, risk: Risk, outcome: Outcome, *, silent: bool) -> bytes:
    asked = command(number)
    response = Response(1, 2, b"", asked.did, asked.cid, 0x11, flags=9)
    sent = CODEC.encode_command(asked, 1)
    exchange: Exchange = Answered(asked, 1, sent, response, CODEC.encode_response(response), 0.1)
    if silent:
        exchange = Silent(asked, 1, sent, 0.1)
    return encode_finding(
        Finding(number, asked, outcome, Confidence.CERTAIN, risk, exchange, None, attempts=1)
    )


NUMBERS: Final = st.integers(1, 4)
RISKS: Final = st.sampled_from([Risk.READ, Risk.PROBE, Risk.WRITE])
LINES: Final = st.lists(
    st.builds(lambda number, risk: encode_intent(number, command(number), risk), NUMBERS, RISKS)
    | st.builds(finding, NUMBERS, RISKS, st.sampled_from(Outcome), silent=st.booleans()),
    max_size=20,
)


@contextmanager
def interrupted(lines: bytes) -> Iterator[InterruptedRun]:
    with closing(InterruptedRun(BytesIO(lines), Path("run.jsonl"))) as run:
        yield run


@given(lines=LINES)
def test_the_last_finding_counts_and_an_open_one_is_none(
    tmp_path_factory: pytest.TempPathFactory, lines: list[bytes]
) -> None:
    path = tmp_path_factory.getbasetemp() / "interrupted.jsonl"
    path.write_bytes(b"".join([OPENING, *lines]))
    recorded = read_journal(path)
    settled = {
        number: found
        for number, found in recorded.findings.items()
        if not isinstance(found.exchange, Silent)
        or found.outcome is not Outcome.INCONCLUSIVE
        or found.risk > Risk.PROBE
    }
    doubtful = {
        number: intent.risk
        for number, intent in recorded.intents.items()
        if number not in settled and intent.risk > Risk.PROBE
    }
    with interrupted(path.read_bytes()) as run:
        assert dict(run.earlier.findings) == settled
        assert [number in run.earlier.findings for number in range(6)] == [n in settled for n in range(6)]
        assert [run.earlier.findings.get(number) for number in range(6)] == [
            settled.get(number) for number in range(6)
        ]
        assert len(run.earlier.findings) == len(settled)
        assert run.earlier.doubtful == doubtful
        assert (run.opening, run.headings) == (recorded.opening, recorded.headings)
        assert (run.valid_bytes, run.is_torn) == (recorded.valid_bytes, recorded.is_torn)


@pytest.mark.parametrize(
    ("data", "lenient"),
    [({"target": 17}, {17}), ({"target": None}, {None}), ({"target": True}, set()), ({"target": "x"}, set())],
)
def test_a_node_that_executed_a_wrong_length_is_lenient(
    data: dict[str, object], lenient: set[int | None]
) -> None:
    with interrupted(
        OPENING + encode(Note(EXECUTED, "", data)) + encode(Note("run", "", {"target": 18}))
    ) as run:
        assert run.earlier.lenient == lenient


@pytest.mark.parametrize(
    "line",
    [
        pytest.param(b"{}\n", id="no entry"),
        pytest.param(encode_intent(1, command(1), Risk.PROBE), id="no finding"),
        pytest.param(finding(2, Risk.PROBE, Outcome.ABSENT, silent=False), id="another finding"),
    ],
)
def test_a_file_that_is_changed_meanwhile_is_named(tmp_path: Path, line: bytes) -> None:
    path = tmp_path / "run.jsonl"
    path.write_bytes(OPENING + finding(1, Risk.PROBE, Outcome.ABSENT, silent=False))
    with closing(InterruptedRun(path.open("rb", buffering=0), path)) as run:
        path.write_bytes(OPENING + line)
        with pytest.raises(BadInputFileError, match=r"run\.jsonl: the finding 1 was changed"):
            run.earlier.findings[1]
