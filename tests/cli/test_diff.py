"""``diff`` and ``--baseline`` from the command line, on built-in robots, whose truth a file tells."""

import json
import re
from collections.abc import Iterable
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from benchmarks.process import spent
from sphero_probe.cli.actions.diff import claims_of_robot, side_of
from sphero_probe.errors import UsageError
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation, Response
from sphero_probe.reports.json_text import SCHEMA_VERSION
from sphero_probe.runs.diff import compare
from sphero_probe.simulator.firmware import LISTS
from tests.support.cli import Cli, Ran, objects

ONE, OTHER = "fake:bolt?seed=1", "fake:bolt?seed=2&hidden=5"
SWEEP = ("sweep", "--did", "0x18", "--cid", "0x60-0x7f", "--device")
_Place = tuple[object, object, object]


def hidden(truth: Path) -> set[_Place]:
    facts = [json.loads(line) for line in truth.read_text(encoding="utf-8").splitlines()]
    return {(fact["node"], fact["did"], fact["cid"]) for fact in facts if fact["hidden"]}


def named(ran: Ran, kind: str = "difference") -> list[_Place]:
    rows = objects(ran.out)
    return [(row["node"], row["did"], row["cid"]) for row in rows if row["type"] == kind]


def test_it_names_exactly_the_hidden_commands(cli: Cli, tmp_path: Path) -> None:
    truth = tmp_path / "truth.jsonl"
    cli("send", "power.wake", "--device", f"{OTHER}&truth={truth}")
    ran = cli("diff", ONE, OTHER, "--format", "jsonl")
    assert ran.code == 1
    assert len(named(ran)) == len(hidden(truth)) == 5
    assert set(named(ran)) == hidden(truth)
    assert {row["kind"] for row in objects(ran.out) if row["type"] == "difference"} == {"appeared"}
    assert named(cli("diff", OTHER, ONE, "--format", "jsonl")) == named(ran)


def test_two_runs_differ_in_the_hidden_commands_and_nothing_else(cli: Cli, tmp_path: Path) -> None:
    truth, one, other = (tmp_path / name for name in ("truth.jsonl", "one.jsonl", "other.json"))
    cli(*SWEEP, ONE, "--journal", str(one))
    cli(*SWEEP, f"{OTHER}&truth={truth}", "-o", str(other))
    expected = {(1, 0x18, cid) for cid in range(0x60, 0x80)} & hidden(truth)
    assert expected
    ran = cli("diff", str(one), str(other), "--format", "jsonl")
    assert (ran.code, set(named(ran))) == (1, expected)
    head, *_, counts = objects(ran.out)
    assert (head["type"], head["schema_version"]) == ("diff", SCHEMA_VERSION)
    assert (head["same_robot"], head["values"]) == (False, "none")
    assert list(head["other_firmware"]) == ["primary", "secondary"]
    assert (counts["type"], counts["differences"]) == ("diff_summary", len(expected))
    assert counts["counts"]["appeared"] == len(expected)
    against_truth = cli("diff", str(other), OTHER)
    assert (against_truth.code, against_truth.out) == (0, "")


@pytest.mark.slow
def test_two_discoveries_differ_in_the_five_and_nothing_else(cli: Cli, tmp_path: Path) -> None:
    truth, one, other = (tmp_path / name for name in ("truth.jsonl", "one.jsonl", "other.jsonl"))
    cli("discover", "--device", ONE, "--journal", str(one))
    cli("discover", "--device", f"{OTHER}&truth={truth}", "--journal", str(other))
    assert set(named(cli("diff", str(one), str(other), "--format", "jsonl"))) == hidden(truth)


def test_a_run_and_itself_are_the_same(cli: Cli) -> None:
    cli(*SWEEP, ONE)
    ran = cli("diff", "last", "last", "--format", "table")
    assert ran.code == 0
    assert ran.out.splitlines()[-1].startswith("No difference in ")
    assert cli("diff", "last", "last").out == ""


def test_the_table_says_first_that_robots_differ(cli: Cli, tmp_path: Path) -> None:
    one = tmp_path / "one.jsonl"
    cli(*SWEEP, ONE, "--journal", str(one))
    cli(*SWEEP, OTHER)
    lines = cli("diff", str(one), "last", "--format", "table").out.splitlines()
    assert lines[0].startswith("Different robots: Sphero BOLT SB-A931 and Sphero BOLT SB-3118")
    assert lines[1].startswith("Different firmware: primary 9.3.236 -> 7.2.156")
    assert "2 appeared: absent in A, exist in B" in lines
    plain = cli("diff", str(one), "last")
    assert plain.err.startswith("note: Different robots: ")
    assert [line.split("\t")[:4] for line in plain.out.splitlines()] == [
        ["appeared", "1", "0x18", "0x6b"],
        ["appeared", "1", "0x18", "0x6f"],
    ]
    csv = cli("diff", str(one), "last", "--format", "csv").out.splitlines()
    assert csv[0] == "kind,node,did,cid,name,request,before,after"
    assert csv[1] == "appeared,1,0x18,0x6b,,,absent: 0x02 bad command id,exists: 0x05 bad data length"


def test_markdown_can_be_pasted_into_an_issue(cli: Cli, tmp_path: Path) -> None:
    one, page = tmp_path / "one.jsonl", tmp_path / "page.md"
    cli(*SWEEP, ONE, "--journal", str(one))
    cli(*SWEEP, OTHER)
    assert cli("diff", str(one), "last", "-o", str(page)).code == 1
    lines = page.read_text(encoding="utf-8").splitlines()
    assert lines[0].startswith("**Different robots: Sphero BOLT SB-A931 and Sphero BOLT SB-3118")
    assert "### 2 appeared: absent in A, exist in B" in lines
    assert "| DID:CID | Name | Node | A | B |" in lines
    row = "| 0x18:0x6b | unknown | primary | absent: 0x02 bad command id | exists: 0x05 bad data length |"
    assert row in lines
    assert lines[-2].startswith("2 differences in ")


def test_withheld_is_never_missing(cli: Cli) -> None:
    cli("sweep", "--did", "0x13", "--device", "fake:bolt-plus")
    ran = cli("diff", "catalogue", "last", "--format", "jsonl")
    assert (ran.code, named(ran)) == (0, [])
    uncertain = [row for row in objects(ran.out) if row["type"] == "uncertain"]
    assert {row["kind"] for row in uncertain} == {"not_comparable"}
    by_standing = [row for row in uncertain if row["after"]["standing"] == "withheld"]
    assert "power.enter_deep_sleep" in {row["name"] for row in by_standing}
    assert {row["before"]["standing"] for row in uncertain} == {"exists"}
    table = cli("diff", "catalogue", "last", "--format", "table").out
    assert "exists in A, withheld in B:" in table
    assert "exists in A, not asked in B:" in table


def test_values_of_one_robot(cli: Cli, tmp_path: Path) -> None:
    """The built-in robot's battery never changes, so the answer in the second journal is made by hand."""
    one, other = tmp_path / "one.jsonl", tmp_path / "other.jsonl"
    cli("sweep", "--did", "0x13", "--cid", "0x10", "--device", "fake:bolt-plus", "--journal", str(one))
    text = one.read_text(encoding="utf-8")
    (line,) = [line for line in text.splitlines() if '"type":"finding"' in line]
    frame = json.loads(line)["received"]
    seq = json.loads(line)["seq"]
    percent = CODECS[Generation.V2].encode_response(Response(seq, 0, b"\x01", 0x13, 0x10, 0x11, 0x01, 0x39))
    other.write_text(text.replace(frame, percent.hex()), encoding="utf-8")
    assert cli("diff", str(one), str(other)).code == 0
    ran = cli("diff", str(one), str(other), "--values", "--format", "jsonl")
    (row,) = (row for row in objects(ran.out) if row["type"] == "difference")
    assert (ran.code, row["kind"], row["after"]["fields"]) == (1, "changed_value", {"percentage": 1})
    assert "\tpercentage 1" in cli("diff", str(one), str(other), "--values").out


@pytest.mark.parametrize(
    ("sides", "says"),
    [
        pytest.param(("none", ONE), "none: no such run", id="no-run"),
        pytest.param((ONE, "fake:nope"), "unknown fake robot 'nope'", id="no-fake"),
        pytest.param(("catalogue", "catalogue"), "the catalogue is compared with a robot", id="catalogue"),
        pytest.param((ONE, "BP-1234"), "ble:BP-1234", id="a-name"),
        pytest.param((ONE, "serial:/dev/none"), "sphero-probe: ", id="no-port"),
        pytest.param((ONE, "fake:bb8"), "different protocols, V2 and V1", id="protocols"),
        pytest.param((__file__, ONE), "object 1: not valid JSON", id="no-report"),
        pytest.param((ONE, OTHER, "-o", "/none/x.json"), "cannot write /none/x.json", id="no-output"),
        pytest.param((ONE,), "Missing argument 'B'", id="one-side"),
        pytest.param((ONE, OTHER, "-o", "x.zip"), "the suffix .zip stands for no format", id="suffix"),
    ],
)
def test_all_trouble_has_exit_code_2(cli: Cli, sides: Iterable[str], says: str) -> None:
    ran = cli("diff", *sides)
    assert (ran.code, ran.out) == (2, "")
    assert says in ran.err
    assert len(ran.err.splitlines()) <= 2


def test_a_report_of_an_unknown_model_has_no_catalogue(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "x.json"
    cli(*SWEEP, ONE, "-o", str(path))
    path.write_text(path.read_text(encoding="utf-8").replace('"bolt"', '""'), encoding="utf-8")
    ran = cli("diff", str(path), "catalogue")
    assert (ran.code, "its model is not known" in ran.err) == (2, True)


def test_a_robot_is_asked_for_its_own_list_and_nothing_else(tmp_path: Path) -> None:
    ledger = tmp_path / "ledger.jsonl"
    listed = claims_of_robot(f"fake:bolt?hidden=4&ledger={ledger}")
    executed = {
        (entry["did"], entry["cid"])
        for entry in map(json.loads, ledger.read_text(encoding="utf-8").splitlines())
    }
    introduction = {(0x13, 0x0D), (0x10, 0x00), (0x11, 0x00)}  # wake, echo, version
    assert executed <= {*LISTS, *introduction}
    firmware = side_of("fake:bolt?hidden=4")
    diff = compare(listed, firmware)
    unnamed = {key for key, entry in firmware.entries.items() if entry.name is None}
    assert {one.key for one in diff.differences} == unnamed
    assert len(diff.differences) == 4
    with pytest.raises(UsageError, match="does not list its commands"):
        claims_of_robot("fake:mini")


# ---------------------------------------------------------------- the baseline


@pytest.fixture
def baseline(cli: Cli, tmp_path: Path) -> Path:
    path = tmp_path / "base.json"
    ran = cli(*SWEEP, ONE, "--baseline", str(path), "--baseline-update")
    assert (ran.code, ran.err.splitlines()[-1]) == (0, f"baseline written: {path}")
    return path


def test_a_run_like_its_baseline_passes(cli: Cli, baseline: Path) -> None:
    before = baseline.read_bytes()
    ran = cli(*SWEEP, f"{ONE}&latency=1ms&duplicate=0.1", "--baseline", str(baseline))
    assert ran.code == 0
    assert "baseline: No difference in " in ran.err
    assert baseline.read_bytes() == before
    assert not list(baseline.parent.glob(".*"))


def test_a_run_unlike_its_baseline_fails_and_shows_how(cli: Cli, baseline: Path) -> None:
    ran = cli(*SWEEP, OTHER, "--baseline", str(baseline))
    assert ran.code == 1
    assert "appeared: primary 0x18:0x6b unknown: absent: 0x02 bad command id -> exists" in ran.err
    assert f"2 differences from the baseline {baseline}" in ran.err
    page = cli(*SWEEP, OTHER, "--baseline", str(baseline), "--format", "table")
    assert page.code == 1
    assert "\n\nDifferent robots: " in page.out
    assert "2 appeared: absent in A, exist in B" in page.out
    rows = cli(*SWEEP, OTHER, "--baseline", str(baseline), "--format", "jsonl")
    assert named(rows) == [(1, 0x18, 0x6B), (1, 0x18, 0x6F)]
    suite = ET.fromstring(cli(*SWEEP, OTHER, "--baseline", str(baseline), "--format", "junit").out)[0]
    assert [case.get("name") for case in suite if case.findall("failure")] == [
        "0x18:0x6b unknown",
        "0x18:0x6f unknown",
    ]


def test_a_baseline_is_replaced_when_asked(cli: Cli, baseline: Path) -> None:
    ran = cli(*SWEEP, OTHER, "--baseline", str(baseline), "--baseline-update")
    assert (ran.code, "appeared: primary 0x18:0x6b" in ran.err) == (0, True)
    assert cli(*SWEEP, OTHER, "--baseline", str(baseline)).code == 0


def test_a_journal_is_a_baseline_and_is_not_replaced(cli: Cli, tmp_path: Path) -> None:
    journal = tmp_path / "base.jsonl"
    cli(*SWEEP, ONE, "--journal", str(journal))
    assert cli(*SWEEP, ONE, "--baseline", str(journal)).code == 0
    ran = cli(*SWEEP, ONE, "--baseline", str(journal), "--baseline-update")
    assert (ran.code, "this is a journal" in ran.err) == (2, True)


def test_an_incomplete_run_has_its_own_exit_code_and_is_no_baseline(cli: Cli, baseline: Path) -> None:
    lenient = "fake:ollie?hidden=8&seed=5"  # one hidden command of this robot does not check its length
    where = ("--baseline", str(baseline), "--baseline-update")
    baseline.unlink()
    cli("sweep", "--did", "0x02", "--cid", "0x07", "--device", lenient, *where)
    before = baseline.read_bytes()
    ran = cli("sweep", "--did", "0x02", "--device", lenient, *where)
    assert (ran.code, baseline.read_bytes()) == (5, before)
    assert "baseline: " in ran.err
    assert "baseline not written: the run is incomplete" in ran.err


@pytest.mark.parametrize(
    ("options", "code", "says"),
    [
        pytest.param(("--baseline", "none.json"), 8, "none.json: no such baseline", id="missing"),
        pytest.param(("--baseline-update",), 2, "--baseline-update needs --baseline FILE", id="without-file"),
        pytest.param(
            ("--baseline", "x.txt", "--baseline-update"), 2, "written as .json or .jsonl", id="suffix"
        ),
        pytest.param(("--baseline", __file__), 8, "object 1: not valid JSON", id="no-report"),
        pytest.param(
            ("--baseline", "x.json", "--dry-run"), 2, "cannot be combined with --baseline", id="dry"
        ),
        pytest.param(
            ("--baseline", "/none/x.json", "--baseline-update"), 10, "cannot write /none/x.json", id="folder"
        ),
    ],
)
@pytest.mark.parametrize(
    "command", [("sweep", "--did", "0x13", "--cid", "0x10"), ("discover", "--did", "0x13")]
)
def test_a_bad_baseline_is_said_before_anything_is_sent(
    cli: Cli, command: Iterable[str], options: Iterable[str], code: int, says: str
) -> None:
    ran = cli(*command, "--device", ONE, *options)
    assert (ran.code, says in ran.err) == (code, True), ran.err
    if code != 10:
        assert ran.out == ""


# ---------------------------------------------------------------- many findings


def whole_journal(path: Path, *, last: int) -> None:
    """A journal of all pairs, as a sweep writes it; the last pair has this code."""
    codec = CODECS[Generation.V2]
    with path.open("w", encoding="ascii") as out:
        out.write(
            '{"type":"journal","schema_version":1,"command":"sweep","plan":"sweep","digest":"","options":{},'
            '"target":"","address":"fake:bolt","generation":"v2","robot":"bolt","device":"SB-1","consent":[]}\n'
        )
        for number in range(1 << 16):
            did, cid = divmod(number, 256)
            code = last if number == 0xFFFF else 5 if number % 40 == 0 else 2
            frame = codec.encode_response(Response(number % 255, code, b"", did, cid, 0x11, flags=9)).hex()
            sent = codec.encode_command(Command(did, cid, bytes(11), 0x11), number % 255).hex()
            asked = f'"number":{number + 1},"target":17,"did":{did},"cid":{cid},"payload":"{"00" * 11}"'
            outcome = "absent" if code == 2 else "exists"
            out.write(f'{{"type":"intent",{asked},"risk":"probe"}}\n')
            out.write(
                f'{{"type":"finding",{asked},"outcome":"{outcome}","confidence":"certain","risk":"probe",'
                f'"attempts":1,"note":"","exchange":"answered","seq":{number % 255},"sent":"{sent}",'
                f'"received":"{frame}","seconds":0.03}}\n'
            )


@pytest.mark.slow
def test_runs_of_65536_findings_fit_in_100_mebibytes(tmp_path: Path) -> None:
    one, other, found = tmp_path / "one.jsonl", tmp_path / "other.jsonl", tmp_path / "found.txt"
    whole_journal(one, last=2)
    whole_journal(other, last=5)
    peak = spent("diff", str(one), str(other), "--format", "plain", "-o", str(found), code=1).mebibytes
    assert re.match(r"appeared\t1\t0xff\t0xff\t", found.read_text())
    if peak is None:
        pytest.skip("only Linux tells the peak memory of a process in /proc")
    assert peak <= 100
