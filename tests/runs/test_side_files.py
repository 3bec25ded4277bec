"""Sides from files: a journal and a report of one run say the same, and bad files are named."""

import json
import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import BadInputFileError
from sphero_probe.link.exchange import Answered, Silent
from sphero_probe.probing.finding import Finding
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation, Response
from sphero_probe.runs.decode import Opening
from sphero_probe.runs.diff import compare
from sphero_probe.runs.encode import encode
from sphero_probe.runs.side_files import file_side
from tests.runs.test_diff import side
from tests.support.reports_by_hand import (
    HEADING,
    HOSTILE,
    SECONDARY,
    answered,
    found,
    refused,
    rendered,
    run_of,
    silent,
    summary,
)

FINDINGS = [
    answered(1, 0x13, 0x10, 0x00, b"\x57"),
    answered(2, 0x13, 0x99, 0x05),
    answered(3, 0x13, 0x98, 0x02, target=SECONDARY),
    silent(4, 0x13, 0x97),
    refused(5, 0x13, 0x00, Risk.BRICK, f"brick: {HOSTILE}"),
    answered(6, 0x10, 0x00, 0x00, b"=1+1")._replace(note="a note"),
    answered(7, 0x13, 0x96, 0x05, masked=True),
    found(8, Command(0x13, 0x95), Silent(Command(0x13, 0x95), 0, b"", 0.0)),
]
OPENING = Opening(
    "sweep", "sweep", "digest", {}, "", "fake:bolt", Generation.V2, "bolt", "SB-1B2C", ("read", "probe")
)


def journal_of(findings: list[Finding], path: Path) -> Path:
    lines = [encode(OPENING), encode(HEADING)]
    for finding in findings:
        lines.append(b'{"type":"intent","number":1,"target":17,"did":1,"cid":1,"payload":"","risk":"read"}\n')
        lines.append(encode(finding))
    path.write_bytes(b"".join([*lines, encode(summary(findings))]))
    return path


def report_of(findings: list[Finding], path: Path, form: str) -> Path:
    path.write_text(rendered(form, run_of(findings)), encoding="utf-8")
    return path


@pytest.mark.parametrize("form", ["json", "jsonl"])
def test_a_journal_and_a_report_of_a_run_are_the_same_side(tmp_path: Path, form: str) -> None:
    journal = file_side(journal_of(FINDINGS, tmp_path / "a.jsonl"), "a")
    report = file_side(report_of(FINDINGS, tmp_path / f"b.{form}", form), "b")
    assert journal.entries == report.entries == side(FINDINGS).entries
    assert (journal.kind, report.kind) == ("run", "report")
    assert journal[2:9] == report[2:9]
    assert journal.complete
    assert (journal.device, journal.firmware) == ("SB-1B2C", HEADING.firmware)


def test_an_array_of_any_layout_is_read(tmp_path: Path) -> None:
    path = report_of(FINDINGS, tmp_path / "a.json", "json")
    expected = file_side(path, "a")
    held = json.loads(path.read_text(encoding="utf-8"))
    for layout in ({"indent": 2}, {"separators": (",", ":")}):
        path.write_text(json.dumps(held, **layout), encoding="utf-8")
        assert file_side(path, "a").entries == expected.entries


def test_a_report_that_was_compared_with_a_baseline_is_read(tmp_path: Path) -> None:
    path = report_of(FINDINGS, tmp_path / "a.jsonl", "jsonl")
    expected = file_side(path, "a")
    with path.open("a", encoding="utf-8") as file:
        file.writelines(
            f'{{"type": "{kind}"}}\n' for kind in ("diff", "difference", "uncertain", "diff_summary")
        )
    assert file_side(path, "a").entries == expected.entries


def test_a_later_finding_of_a_number_replaces_the_earlier(tmp_path: Path) -> None:
    verified = [*FINDINGS, FINDINGS[1]._replace(outcome=FINDINGS[6].outcome, note="said two things")]
    for path in (
        journal_of(verified, tmp_path / "a.jsonl"),
        report_of(verified, tmp_path / "b.jsonl", "jsonl"),
    ):
        assert file_side(path, "a").entry((1, 0x13, 0x99)).standing == "inconclusive"


def test_a_report_without_its_heading_is_read_by_its_frames(tmp_path: Path) -> None:
    codec = CODECS[Generation.V1]
    command = Command(0x02, 0x07)
    response = Response(1, 0, b"\1\2\3\4", None, None)
    answer = Answered(
        command, 1, codec.encode_command(command, 1), response, codec.encode_response(response), 0.1
    )
    path = tmp_path / "v1.jsonl"
    lines = rendered("jsonl", run_of([found(1, command, answer)])).splitlines()
    path.write_text("\n".join(line for line in lines if '"type": "finding"' in line), encoding="utf-8")
    read = file_side(path, "v1")
    assert read.generation is Generation.V1
    assert read.entry((None, 0x02, 0x07)).answers[b""].payload == b"\1\2\3\4"
    assert not compare(read, read).differences


GOOD = '{"type": "finding", "number": 1, "target": 17, "did": 1, "cid": 2, "name": null, "risk": "read", '
GOOD += '"outcome": "absent", "confidence": "certain", "sent": null, "received": null, "note": ""}'


def test_the_line_that_the_next_test_spoils_is_good(tmp_path: Path) -> None:
    path = tmp_path / "x.jsonl"
    path.write_text(GOOD, encoding="utf-8")
    assert file_side(path, "x").entry((1, 1, 2)).standing == "absent"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        pytest.param("", "empty", id="empty"),
        pytest.param("[]\n", "empty", id="no-objects"),
        pytest.param("hello\n", "object 1: not valid JSON", id="no-json"),
        pytest.param("[1, 2]", "object 1: not a JSON object", id="no-objects-in-it"),
        pytest.param("[" * 100_000, "object 1: not valid JSON", id="deep"),
        pytest.param('{"type": "robot"}\n', ":1: not an object of a run", id="another-report"),
        pytest.param(f"{GOOD}\n{{}}\n", ":2: not an object of a run", id="second"),
        pytest.param(f"[\n{GOOD},\nnope\n]\n", ":3: not valid JSON", id="in-an-array"),
        pytest.param(GOOD.replace('"did": 1', '"did": 256'), "did is not a number from 0 to 255", id="did"),
        pytest.param(GOOD.replace('"did": 1', '"did": NaN'), "not valid JSON", id="nan"),
        pytest.param(GOOD.replace('"sent": null', '"sent": "zz"'), "sent is not hex", id="hex"),
        pytest.param(GOOD.replace('"sent": null', '"sent": "8d"'), "sent is not one command", id="frame"),
        pytest.param(
            GOOD.replace('"received": null', '"received": "8dd8"'), "received is not one", id="answer"
        ),
        pytest.param(GOOD.replace("absent", "gone"), "outcome is not one of", id="outcome"),
        pytest.param(GOOD.replace('"name": null', f'"name": "{"x" * 600}"'), "name is not a text", id="long"),
        pytest.param(f"{GOOD}\n{' ' * ((1 << 20) + 1)}", ":2: a line of more than", id="long-line"),
    ],
)
def test_a_bad_file_is_named_with_its_place(tmp_path: Path, text: str, says: str) -> None:
    path = tmp_path / "x.jsonl"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(BadInputFileError, match=says) as caught:
        file_side(path, "x")
    assert str(path) in str(caught.value)


def test_a_pipe_or_a_folder_is_no_side(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", tmp_path, tmp_path / "none"):
        with pytest.raises(BadInputFileError, match=str(path)):
            file_side(path, "x")


@pytest.mark.unmeasured
@given(st.binary(max_size=60), st.integers(0, 4000), st.sampled_from(["json", "jsonl", "journal"]))
def test_damage_is_named_or_read(
    tmp_path_factory: pytest.TempPathFactory, junk: bytes, at: int, form: str
) -> None:
    path = tmp_path_factory.getbasetemp() / "damaged"
    if form == "journal":
        journal_of(FINDINGS, path)
    else:
        report_of(FINDINGS, path, form)
    whole = path.read_bytes()
    path.write_bytes(whole[:at] + junk + whole[at + len(junk) // 2 :])
    try:
        file_side(path, "x")
    except BadInputFileError as error:
        assert "damaged" in str(error)  # noqa: PT017 - both are fine
