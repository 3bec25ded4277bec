"""``report``: choosing, sorting, other files than journals, and the reference document."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from sphero_probe.cli.invoke import run
from tests.support.cli import Cli, objects

USAGE, BAD_FILE = 2, 8
ROBOT = "fake:rvr?seed=4&hidden=3"
PAGES = ("table", "md", "html")
Wanted = Callable[[dict[str, Any]], bool]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sweep of two devices: its journal and its report."""
    folder = tmp_path_factory.mktemp("report")
    out = ("--journal", str(folder / "run.jsonl"), "-o", str(folder / "run.json"))
    assert run(("sweep", "--did", "0x11,0x13", "--device", ROBOT, *out)) == 0
    return folder


@pytest.fixture
def journal(folder: Path) -> str:
    return str(folder / "run.jsonl")


def findings(cli: Cli, *arguments: str) -> list[dict[str, Any]]:
    ran = cli("report", *arguments, "--format", "jsonl")
    assert (ran.code, ran.err) == (0, "")
    rows = [row for row in objects(ran.out) if row["type"] == "finding"]
    for row in rows:
        row.pop("schema_version", None)
    return rows


def is_blocked(row: dict[str, Any]) -> bool:
    return row["outcome"] == "skipped" and row["did"] == 0x13 and row["name"] is None


def is_there(row: dict[str, Any]) -> bool:
    return row["outcome"] in ("exists", "absent")


@pytest.mark.parametrize(
    ("options", "wanted"),
    [
        (("--only", "exists,absent"), is_there),
        (("--only", " Absent , exists"), is_there),
        (("--only", "blocked", "--did", "power", "--unknown"), is_blocked),
        (("--only", "skipped", "--did", "0x12-0x13", "--unknown", "--node", "primary"), is_blocked),
        (("--only", "skipped", "--did", "19", "--unknown", "--node", "1"), is_blocked),
        (("--only", "skipped", "--did", "0x13", "--unknown", "--node", "0x11"), is_blocked),
    ],
)
def test_findings_are_chosen(cli: Cli, journal: str, options: tuple[str, ...], wanted: Wanted) -> None:
    every = findings(cli, journal)
    assert len(every) == 512
    held = findings(cli, journal, *options)
    assert held == [row for row in every if wanted(row)]
    assert held


def test_findings_are_sorted(cli: Cli, journal: str) -> None:
    by_time = findings(cli, journal, "--sort", "time")
    assert by_time == findings(cli, journal)
    by_did = findings(cli, journal, "--sort", "did")
    assert by_did == sorted(by_time, key=lambda row: (row["target"], row["did"], row["cid"]))
    by_rtt = [row["rtt_ms"] for row in findings(cli, journal, "--sort", "rtt")]
    timed = [time for time in by_rtt if time is not None]
    assert timed == sorted(timed, reverse=True)
    assert by_rtt[len(timed) :] == [None] * (len(by_rtt) - len(timed))
    words = [row["outcome"] for row in findings(cli, journal, "--sort", "outcome")]
    order = ["exists", "absent", "skipped"]
    assert list(dict.fromkeys(words)) == order
    assert words == sorted(words, key=order.index)


@pytest.mark.parametrize(
    ("form", "expected"),
    [
        ("json", "[]\n"),
        ("jsonl", ""),
        ("plain", ""),
        ("table", "0 of 512 findings are shown"),
        ("md", "- 0 of 512 findings are shown"),
        ("html", "<li>0 of 512 findings are shown</li>"),
    ],
)
@pytest.mark.parametrize("options", ["--did 0x77", "--node secondary", "--node 0x15"])
def test_nothing_is_an_empty_report(cli: Cli, journal: str, form: str, expected: str, options: str) -> None:
    ran = cli("report", journal, *options.split(), "--format", form)
    assert (ran.code, ran.err) == (0, "")
    assert expected in ran.out if form in PAGES else expected == ran.out


@pytest.mark.parametrize("form", PAGES)
def test_a_page_shows_what_was_chosen(cli: Cli, journal: str, form: str) -> None:
    absent = cli("report", journal, "--only", "absent", "--did", "0x13", "--format", form).out
    assert "0x13:0x2b-0xff" in absent or "0x13:0x30-0xff" in absent
    assert "get_battery_voltage" not in absent
    slowest = cli("report", journal, "--only", "exists", "--sort", "rtt", "--format", form)
    held = findings(cli, journal, "--only", "exists", "--sort", "rtt")
    assert slowest.code == 0
    at = [slowest.out.rindex(f"0x{row['did']:02x}:0x{row['cid']:02x}") for row in held]
    assert at == sorted(at)


def test_what_is_left_out_is_not_called_unconfirmed(cli: Cli, journal: str) -> None:
    page = cli("report", journal, "--only", "absent", "--format", "html").out
    assert '<td class="d">' not in page
    assert "not asked, or left out" in page
    document = cli("report", journal, "--as", "protocol", "--only", "absent").out
    assert "documented, not asked" not in document


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--only", "exist,silnt"), "no outcome 'silnt'\n  did you mean 'silent'?"),
        (("--only", ""), "no outcome ''"),
        (("--did", "pwer"), "no device named 'pwer'\n  did you mean 'power'?"),
        (("--did", "0x100"), "larger than 0xff"),
        (("--node", "secndary"), "no node 'secndary'\n  did you mean 'secondary'?"),
        (("--node", "999"), "999 is larger than 0xff"),
        (("--sort", "size"), "'size' is not one of 'did', 'outcome', 'time', 'rtt'"),
        (("--as", "protcol"), "'protcol' is not 'protocol'"),
        (("--as", "protocol", "--json"), "--as protocol is written in Markdown, not as json"),
        (("--as", "protocol", "-o", "x.html"), "written in Markdown, not as html"),
    ],
)
def test_unknown_words_are_usage_errors(cli: Cli, journal: str, options: tuple[str, ...], said: str) -> None:
    ran = cli("report", journal, *options)
    assert ran.code == USAGE
    assert said in ran.err
    assert len(ran.err.splitlines()) in (1, 2)
    assert ran.out == ""


def test_a_report_in_json_is_a_run_too(cli: Cli, journal: str, folder: Path, tmp_path: Path) -> None:
    expected = cli("report", journal, "--format", "jsonl").out
    array = folder / "run.json"
    lines = tmp_path / "lines.jsonl"
    lines.write_text(expected)
    indented = tmp_path / "indented.json"
    indented.write_text(json.dumps(json.loads(array.read_text()), indent=2))
    for path in (array, lines, indented):
        for form in ("md", "html", "csv"):
            ran = cli("report", str(path), "--format", form)
            assert (ran.code, ran.err) == (0, "")
            assert ran.out == cli("report", journal, "--format", form).out
        again = cli("report", str(path), "--format", "jsonl").out
        assert sorted(again.splitlines()) == sorted(expected.splitlines())  # notes may stand elsewhere


def test_a_command_sent_alone_can_be_shown_again(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "one.json"
    cli("send", "0x13", "0x03", "--device", "fake:bolt", "-o", str(path))
    assert "0x13:0x03" in cli("report", str(path), "--format", "md").out


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[1]", "object 1: not a JSON object"),
        ("[", ""),
        ("[\n{", "not valid JSON"),
        ('[{"type": "packet"}]', "object 1: not an object of a run"),
        ('{"type": "finding"}', ":1: did is not a number from 0 to 255"),
        ('{"type": "run", "robot": "hal"}', "robot is not one of"),
        ('{"type": "note", "kind": "x", "text": "y", "deep": ' + "[" * 900 + "]" * 900 + "}", ""),
        ('{"type": "note", "kind": "x", "text": 1}', "text is not a text"),
    ],
)
def test_a_bad_report_is_one_clear_line(cli: Cli, tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "bad.json"
    path.write_text(text)
    ran = cli("report", str(path))
    assert said in ran.err
    if text == "[":
        assert (ran.code, ran.out, ran.err) == (0, "", "")
    else:
        assert ran.code == BAD_FILE
        assert ran.out == ""


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"did": 256}, "did is not a number"),
        ({"number": 0}, "number is not a number"),
        ({"sent": "8d00"}, "sent is not this command"),
        ({"sent": "zz"}, "sent is not hexadecimal"),
        ({"cid": 0x77}, "sent is not this command"),
        ({"received": "8d"}, "received is not one response"),
        ({"rtt_ms": "fast"}, "rtt_ms is not a duration"),
        ({"outcome": "gone"}, "outcome is not one of"),
        ({"risk": []}, "risk is not one of"),
        ({"note": 7}, "note is not a text"),
        ({"attempts": None}, "attempts is not a number"),
    ],
)
def test_each_field_of_a_report_is_checked(
    cli: Cli, folder: Path, tmp_path: Path, change: dict[str, object], said: str
) -> None:
    rows = json.loads((folder / "run.json").read_text())
    at = next(at for at, row in enumerate(rows) if row.get("outcome") == "exists")
    rows[at] |= change
    path = tmp_path / "changed.jsonl"
    path.write_text("\n".join(map(json.dumps, rows)))
    ran = cli("report", str(path))
    assert ran.code == BAD_FILE
    assert f"changed.jsonl:{at + 1}: {said}" in ran.err
    assert ran.out == ""


def test_names_come_from_the_catalogue(cli: Cli, folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "changed.json"
    path.write_text((folder / "run.json").read_text().replace("power.get_battery_voltage", "power.pwned"))
    assert "pwned" not in cli("report", str(path), "--format", "csv").out


@pytest.mark.parametrize("form", ["md", "html"])
def test_the_suffix_of_the_file_chooses_the_format(cli: Cli, tmp_path: Path, form: str) -> None:
    path = tmp_path / f"map.{form}"
    ran = cli("sweep", "--did", "0x13", "--cid", "0-9", "--device", "fake:bolt", "-o", str(path))
    assert ran.code == 0
    assert path.read_text().startswith("# Commands of" if form == "md" else "<!DOCTYPE html>")


def test_the_protocol_is_written_from_journals_and_reports(
    cli: Cli, journal: str, folder: Path, tmp_path: Path
) -> None:
    written = []
    for source in (journal, str(folder / "run.json")):
        path = tmp_path / "protocol.md"
        assert cli("report", source, "--as", "protocol", "-o", str(path)).code == 0
        written.append(path.read_text())
    assert written[0] == written[1] == cli("report", journal, "--as", "protocol").out
    assert written[0].startswith("# Protocol of Sphero RVR")
    only = cli("report", journal, "--as", "protocol", "--did", "0x13", "--format", "md").out
    assert "## 0x13 power" in only
    assert "## 0x11" not in only
