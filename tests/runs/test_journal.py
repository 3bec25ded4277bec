"""Journals: however a run is cut off, resuming it gives what an uninterrupted run gives."""

import json
import os
import random
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import BadInputFileError, BadLineError, InUseError, LinkLostError, OutputError
from sphero_probe.json_files import parse
from sphero_probe.link.link import Link
from sphero_probe.link.policy import Consent, Policy
from sphero_probe.probing.engine import Engine
from sphero_probe.probing.finding import Finding, Heading, Note, Outcome, Record, Summary
from sphero_probe.probing.plan import Plan, Probe, sweep
from sphero_probe.probing.recorder import PreviousResults
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command
from sphero_probe.runs.decode import Opening, decode, digest_of
from sphero_probe.runs.encode import encode
from sphero_probe.runs.fields import Fields
from sphero_probe.runs.interrupted import InterruptedRun
from sphero_probe.runs.journal import Journal
from sphero_probe.runs.reader import Recorded, read_journal
from sphero_probe.simulator import Executed, FakeRobot, parse_settings
from sphero_probe.transports.fake import FakeTransport
from tests.support.virtual_clock import run as run_on_virtual_clock

DEFAULT = Consent()
MOVING = Consent(frozenset({Risk.READ, Risk.PROBE, Risk.MOTION}))
PRIMARY, SECONDARY = 0x11, 0x12
SMALL = [list(sweep([0x13], range(0x20)))]
MOTORS = Command(0x16, 0x01, bytes(4), SECONDARY)
REPORTED = ("bolt", "bolt?loss=0.03&duplicate=0.1&seed=3", "mini?mask=1", "ollie", "rvr?strict=none")


class Ran(NamedTuple):
    records: list[Record]
    executed: list[Executed]

    @property
    def findings(self) -> dict[int, Finding]:
        return {record.number: record for record in self.records if isinstance(record, Finding)}


class KilledError(Exception):
    pass


def ask(
    settings: str,
    stages: Sequence[Any],
    path: Path | None,
    *,
    consent: Consent = DEFAULT,
    resume: bool = False,
    stop_after: int | None = None,
    kill_after: int | None = None,
    unplug_after: int | None = None,
) -> Ran:
    """Run a plan with a journal, from the start or from where the journal ends."""
    executed: list[Executed] = []
    records: list[Record] = []
    robot = FakeRobot(parse_settings(settings), on_execute=executed.append)
    codec = CODECS[robot.model.generation]
    plan = Plan("test", "", stages)
    target = PRIMARY if robot.model.addressed else None
    journal = None
    if path:
        journal = Journal.reopen(path) if resume else Journal.create(path)
        if journal.interrupted is None or journal.interrupted.opening is None:
            journal.open(opening_of(settings, plan, consent))

    async def work() -> None:
        pipe = FakeTransport(robot)
        policy = Policy(codec.generation, robot.model, consent, (robot.name,))
        async with Link(pipe, codec, policy) as link:
            run = Engine(plan, link, robot.name, target)
            if journal:
                earlier = journal.interrupted.earlier if journal.interrupted else PreviousResults()
                run = Engine(plan, link, robot.name, target, recorder=journal, earlier=earlier)
            async for record in run.records():
                records.append(record)
                findings = sum(isinstance(one, Finding) for one in records)
                if stop_after is not None and findings >= stop_after:
                    run.stop.set()
                if unplug_after is not None and findings >= unplug_after:
                    pipe.close()
                if kill_after is not None and len(records) >= kill_after:
                    raise KilledError

    try:
        run_on_virtual_clock(work())
    except (KilledError, LinkLostError):
        pass
    finally:
        if journal:
            journal.close()
    return Ran(records, executed)


def opening_of(settings: str, plan: Plan, consent: Consent) -> Opening:
    robot = FakeRobot(parse_settings(settings))
    generation = robot.model.generation
    words = consent.words
    address = f"fake:{settings}"
    return Opening(
        "sweep", "test", digest_of(plan), {}, "", address, generation, robot.model.key, robot.name, words
    )


def said(findings: Mapping[int, Finding]) -> dict[int, tuple[object, ...]]:
    """What findings say, apart from what differs from run to run: sequence numbers, times, repetitions."""
    return {
        number: (found.command, found.outcome, found.confidence, found.risk, found.code_name, found.note)
        for number, found in sorted(findings.items())
    }


def types(path: Path) -> list[str]:
    return [json.loads(line)["type"] for line in path.read_bytes().splitlines()]


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, Ran]:
    path = tmp_path_factory.mktemp("whole") / "run.jsonl"
    ran = ask("bolt?silent=0x13:0x10", SMALL, path)
    return path.read_bytes(), ran


def check_resumed(path: Path, held: bytes, whole: Ran, settings: str = "bolt?silent=0x13:0x10") -> None:
    path.write_bytes(held)
    before = read_journal(path)
    with closing(InterruptedRun(path.open("rb"), path)) as interrupted:
        answered = dict(interrupted.earlier.findings)
    resumed = ask(settings, SMALL, path, resume=True)
    after = read_journal(path)
    assert said(after.findings) == said(whole.findings)
    assert said(resumed.findings) == said(whole.findings)
    assert after.complete
    assert path.read_bytes().startswith(held[: before.valid_bytes])
    again = [
        entry["number"]
        for entry in map(json.loads, filter(None, path.read_bytes()[before.valid_bytes :].splitlines()))
        if entry["type"] == "intent"
    ]
    assert not answered.keys() & set(again)


def in_order(records: Iterable[Record]) -> list[Record]:
    """Records by kind and number: a run tells findings as they come, a journal by number."""
    return sorted(records, key=lambda one: (type(one).__name__, getattr(one, "number", 0), str(one[1:2])))


def test_a_journal_reads_as_the_run_it_recorded(tmp_path: Path) -> None:
    for settings in REPORTED:
        path = tmp_path / f"{settings[:3]}{len(settings)}.jsonl"
        ran = ask(settings, SMALL, path)
        assert in_order(read_journal(path).records()) == in_order(ran.records)


def test_an_intent_stands_before_each_finding_that_was_sent(
    recording: tuple[bytes, Ran], tmp_path: Path
) -> None:
    held, ran = recording
    path = tmp_path / "run.jsonl"
    path.write_bytes(held)
    assert types(path)[:2] == ["journal", "run"]
    assert types(path)[-1] == "summary"
    seen: set[int] = set()
    for entry in map(json.loads, held.splitlines()):
        if entry["type"] == "intent":
            seen.add(entry["number"])
        elif entry["type"] == "finding":
            assert (entry["number"] in seen) == (entry["outcome"] != "skipped")
    assert held.count(b'"type":"intent","number":17,') == ran.findings[17].attempts == 3


@pytest.mark.unmeasured
def test_cut_at_a_hundred_places_it_goes_on_to_the_same_end(
    recording: tuple[bytes, Ran], tmp_path: Path
) -> None:
    held, whole = recording
    places = random.Random(4).sample(range(len(held)), 100)
    for place in places:
        check_resumed(tmp_path / "run.jsonl", held[:place], whole)


@pytest.mark.unmeasured
def test_cut_at_every_line_it_goes_on_to_the_same_end(recording: tuple[bytes, Ran], tmp_path: Path) -> None:
    held, whole = recording
    place = 0
    for line in held.splitlines(keepends=True):
        place += len(line)
        check_resumed(tmp_path / "run.jsonl", held[:place], whole)


@pytest.mark.parametrize("last", ["summary", "finding"])
def test_cut_at_every_byte_of_the_last_line(tmp_path: Path, last: str) -> None:
    stages = [[Probe(Command(0x13, 0x10)), Probe(Command(0x13, 0x03))]]
    path = tmp_path / "run.jsonl"
    whole = ask("bolt", stages, path)
    lines = path.read_bytes().splitlines(keepends=True)
    while json.loads(lines[-1])["type"] != last:
        lines.pop()
    before = b"".join(lines[:-1])
    for cut in range(len(lines[-1]) + 1):
        path.write_bytes(before + lines[-1][:cut])
        with Journal.reopen(path) as journal:
            assert journal.interrupted
            earlier = journal.interrupted.earlier
        assert path.read_bytes() == before + (lines[-1] if cut >= len(lines[-1]) - 1 else b"")
        assert len(earlier.findings) == 2 - (last == "finding" and cut < len(lines[-1]) - 1)
        if cut % 12 and cut < len(lines[-1]) - 2:
            continue
        resumed = ask("bolt", stages, path, resume=True)
        assert said(resumed.findings) == said(whole.findings)
        assert said(read_journal(path).findings) == said(whole.findings)
        assert len(types(path)) >= len(lines)


@pytest.mark.parametrize("cut", ["stop_after", "kill_after", "unplug_after"])
@pytest.mark.parametrize("number", [1, 5, 8])
def test_stopped_killed_or_unplugged_it_goes_on(tmp_path: Path, cut: str, number: int) -> None:
    settings = "bolt?latency=20ms&silent=0x13:0x03"
    whole = ask(settings, SMALL, None)
    path = tmp_path / "run.jsonl"
    limits: dict[str, Any] = {cut: number}
    ask(settings, SMALL, path, **limits)
    assert not read_journal(path).complete
    resumed = ask(settings, SMALL, path, resume=True)
    assert said(resumed.findings) == said(whole.findings)
    assert said(read_journal(path).findings) == said(whole.findings)
    assert types(path).count("run") >= 1
    assert json.loads(path.read_bytes().splitlines()[1])["resumed"] is False
    assert b'"type":"run","resumed":true' in path.read_bytes()


def test_a_stage_made_from_findings_goes_on(tmp_path: Path) -> None:
    def follow(findings: Sequence[Finding]) -> list[Probe]:
        assert [found.number for found in findings] == sorted(found.number for found in findings)
        return [
            Probe(Command(0x11, found.command.cid)) for found in findings if found.outcome is Outcome.EXISTS
        ]

    whole = ask("bolt?busy=0.1", [*SMALL, follow], None)
    path = tmp_path / "run.jsonl"
    for number in (3, 30, 35, 38):
        ask("bolt?busy=0.1", [*SMALL, follow], path, kill_after=number)
        resumed = ask("bolt?busy=0.1", [*SMALL, follow], path, resume=True)
        assert said(resumed.findings) == said(whole.findings)
        path.unlink()


@pytest.mark.parametrize("silent", [False, True])
def test_what_may_have_been_executed_is_never_sent_again(tmp_path: Path, silent: bool) -> None:
    settings = "bolt?latency=50ms" + ("&silent=0x16:0x01" if silent else "")
    stages = [[Probe(Command(0x13, 0x03)), Probe(MOTORS, exact=True), Probe(Command(0x13, 0x10))]]
    path = tmp_path / "run.jsonl"
    whole = ask(settings, stages, path, consent=MOVING)
    assert len([one for one in whole.executed if one.did == 0x16]) == 1
    held = path.read_bytes()
    intent = held.index(b'"type":"intent","number":2')
    intent = held.index(b"\n", intent) + 1
    doubted = 0
    for place in sorted({*range(0, len(held) + 1, 97), *range(intent - 3, intent + 3)}):
        path.write_bytes(held[:place])
        resumed = ask(settings, stages, path, consent=MOVING, resume=True)
        moved = len([one for one in resumed.executed if one.did == 0x16])
        assert moved == (place < intent - 1)
        finding = resumed.findings[2]
        if moved or silent:
            assert finding.outcome is (Outcome.INCONCLUSIVE if silent else Outcome.EXISTS)
        elif "may have been executed" in finding.note:
            doubted += 1
            assert finding.outcome is Outcome.INCONCLUSIVE
            assert finding.risk is Risk.MOTION
    assert silent or doubted


def test_only_one_run_writes_a_journal(recording: tuple[bytes, Ran], tmp_path: Path) -> None:
    path = tmp_path / "run.jsonl"
    path.write_bytes(recording[0])
    with Journal.reopen(path), pytest.raises(InUseError, match="in use by "):
        Journal.reopen(path)
    with Journal.create(tmp_path / "new"), pytest.raises(InUseError, match="in use by "):
        Journal.create(tmp_path / "new")
    Journal.reopen(path).close()


def test_nothing_is_overwritten_and_nothing_empty_is_left(tmp_path: Path) -> None:
    full, empty = tmp_path / "full", tmp_path / "empty"
    full.write_text("mine")
    with pytest.raises(OutputError, match="is not empty"):
        Journal.create(full)
    assert full.read_text() == "mine"
    Journal.create(empty).close()
    assert not empty.exists()


def test_a_full_disk_ends_the_run_and_what_is_there_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = ask("bolt", SMALL, None)
    path = tmp_path / "run.jsonl"
    real, room = os.write, [6000]

    def write(descriptor: int, data: bytes) -> int:
        written = real(descriptor, data[: room[0]]) if room[0] else None
        room[0] -= written or 0
        if written is None:
            raise OSError(28, "No space left on device")
        return written

    monkeypatch.setattr(os, "write", write)
    with pytest.raises(OutputError, match="cannot write"):
        ask("bolt", SMALL, path)
    monkeypatch.undo()
    assert path.stat().st_size == 6000
    resumed = ask("bolt", SMALL, path, resume=True)
    assert said(resumed.findings) == said(whole.findings)


def test_another_robot_or_firmware_ends_the_run_before_a_probe_is_sent(tmp_path: Path) -> None:
    path = tmp_path / "run.jsonl"
    ask("bolt", SMALL, path, kill_after=9)
    held = path.read_bytes()
    for settings in ("bolt?seed=9", "mini"):
        with pytest.raises(BadInputFileError, match="another robot"):
            ask(settings, SMALL, path, resume=True)
    assert path.read_bytes() == held
    for version in read_journal(path).headings[0].firmware.values():
        path.write_bytes(held.replace(f'"{version}"'.encode(), b'"0.0.1"'))
    with pytest.raises(BadInputFileError, match=r"another robot or firmware: .* runs .*, not 0.0.1"):
        ask("bolt", SMALL, path, resume=True)
    assert path.read_bytes().count(b'"intent"') == held.count(b'"intent"')


@given(st.binary(max_size=300))
def test_random_bytes_are_no_journal(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = tmp_path_factory.getbasetemp() / "random.jsonl"
    path.write_bytes(data)
    try:
        recorded = read_journal(path)
    except BadInputFileError as error:
        said_of_it = str(error)
    else:
        assert recorded.opening is None
        assert b'{"type":"journal",'.startswith(data)
        return
    assert said_of_it.startswith(f"{path}:1: ")
    assert "\n" not in said_of_it


VALUES = st.recursive(
    st.one_of(
        st.none(),
        st.booleans(),
        st.integers(),
        st.floats(),
        st.text(max_size=5),
        st.sampled_from(["", "00", 300, -1]),
    ),
    lambda inner: st.one_of(
        st.lists(inner, max_size=2), st.dictionaries(st.text(max_size=3), inner, max_size=2)
    ),
    max_leaves=4,
)


@pytest.mark.unmeasured
@given(st.data())
def test_a_changed_field_is_told_or_harmless(recording: tuple[bytes, Ran], data: st.DataObject) -> None:
    from sphero_probe.cli.run import row_of
    from sphero_probe.reports import views
    from sphero_probe.reports.registry import FORMATS
    from tests.support.reports_by_hand import rendered

    lines = recording[0].splitlines()
    opening = decode(parse(lines[0]), None)
    assert isinstance(opening, Opening)
    fields = json.loads(data.draw(st.sampled_from(lines[1:])))
    key = data.draw(st.sampled_from(sorted(fields)))
    fields[key] = data.draw(VALUES)
    try:
        entry = decode(parse(json.dumps(fields).encode()), opening)
    except BadLineError:
        return
    assert encode(entry)
    if isinstance(entry, Heading | Finding | Note | Summary):
        for form in FORMATS:
            assert rendered(form, [row_of(entry)], views.FINDINGS) is not None


@pytest.mark.parametrize(
    ("change", "why"),
    [
        pytest.param(lambda line: {**line, "number": 0}, "number is not a number", id="number-0"),
        pytest.param(lambda line: {**line, "number": True}, "number is not a number", id="number-true"),
        pytest.param(lambda line: {**line, "did": 256}, "did is not a number", id="did-256"),
        pytest.param(lambda line: {**line, "payload": "0"}, "payload is not hexadecimal", id="odd-hex"),
        pytest.param(lambda line: {**line, "payload": "0 0"}, "payload is not hexadecimal", id="blanks"),
        pytest.param(
            lambda line: {**line, "received": "8d"}, "received is not one response", id="half-answer"
        ),
        pytest.param(lambda line: {**line, "outcome": "maybe"}, "outcome is not one of", id="outcome"),
        pytest.param(lambda line: {**line, "risk": "PROBE"}, "risk is not one of", id="risk"),
        pytest.param(lambda line: {**line, "seconds": -1}, "not a duration", id="negative-time"),
        pytest.param(lambda line: {**line, "note": "x" * 70000}, "note is not a text", id="long-note"),
        pytest.param(lambda line: {**line, "type": "eval"}, "unknown type", id="type"),
        pytest.param(lambda line: {**line, "exchange": {}}, "exchange is not one of", id="exchange"),
        pytest.param(lambda line: [line], "not a JSON object", id="list"),
    ],
)
def test_what_no_run_writes_is_told_with_its_line(
    recording: tuple[bytes, Ran], tmp_path: Path, change: Callable[[dict[str, Any]], object], why: str
) -> None:
    lines = recording[0].splitlines()
    at = next(at for at, line in enumerate(lines) if b'"exchange":"answered"' in line)
    lines[at] = json.dumps(change(json.loads(lines[at]))).encode()
    path = tmp_path / "run.jsonl"
    path.write_bytes(b"\n".join(lines) + b"\n")
    with pytest.raises(BadInputFileError) as caught:
        read_journal(path)
    assert str(caught.value).startswith(f"{path}:{at + 1}: ")
    assert why in str(caught.value)


@pytest.mark.parametrize(
    "line",
    [
        pytest.param(b"[" * 100000, id="deep"),
        pytest.param(b'{"a":NaN}', id="nan"),
        pytest.param(b'{"a":1e999}', id="infinite"),
        pytest.param(b'{"a":' + b"9" * 9999 + b"}", id="long-number"),
        pytest.param(b"\xff\xfe", id="no-text"),
        pytest.param(b"", id="empty"),
    ],
)
def test_lines_that_are_no_json(line: bytes, recording: tuple[bytes, Ran], tmp_path: Path) -> None:
    with pytest.raises(BadLineError):
        parse(line)
    path = tmp_path / "run.jsonl"
    path.write_bytes(recording[0] + line + b"\n" + recording[0].splitlines()[-1] + b"\n")
    with pytest.raises(BadInputFileError, match=r"run\.jsonl:\d+: not valid JSON"):
        read_journal(path)


@pytest.mark.parametrize(
    "details",
    [
        pytest.param({"type": "summary"}, id="own-key"),
        pytest.param({"n": 1 << 70}, id="long-number"),
        pytest.param(json.loads("[" * 12 + "]" * 12), id="not-an-object"),
        pytest.param({"a": json.loads("[" * 12 + "]" * 12)}, id="deep"),
        pytest.param({str(number): 0 for number in range(300)}, id="many"),
    ],
)
def test_details_of_notes_are_bounded(recording: tuple[bytes, Ran], details: object) -> None:
    opening = decode(parse(recording[0].splitlines()[0]), None)
    assert isinstance(opening, Opening)
    with pytest.raises(BadLineError):
        decode({"type": "note", "kind": "run", "text": "", "data": details}, opening)


def test_sizes_are_bounded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, recording: tuple[bytes, Ran]
) -> None:
    path = tmp_path / "run.jsonl"
    path.write_bytes(recording[0].splitlines(keepends=True)[0] + b"x" * (1 << 21))
    with pytest.raises(BadInputFileError, match=":2: a line of more than"):
        read_journal(path)
    monkeypatch.setattr("sphero_probe.runs.reader.MAX_FILE", 1000)
    with pytest.raises(BadInputFileError, match="larger than 1000 bytes"):
        read_journal(path)
    with pytest.raises(BadInputFileError, match="not a regular file"):
        read_journal(tmp_path)
    with pytest.raises(BadInputFileError, match="No such file"):
        read_journal(tmp_path / "none")


def test_a_note_too_long_for_a_line_loses_its_details() -> None:
    note = Note("malformed", "x" * 70000, {"raw": "00" * (1 << 20)})
    line = encode(note)
    assert len(line) < 1000
    assert parse(line)["data"] == {}


def test_hostile_names_come_back_as_they_were(tmp_path: Path) -> None:
    name = "BP\x1b]0;x\x07\u202e\ud800\n../../etc"
    opening = Opening(
        "sweep", name, "0", {name: name}, name, name, CODECS[next(iter(CODECS))].generation, "bolt", name, ()
    )
    heading = Heading("bolt", name, name, {name: name}, name, name, ("read",), {name: name}, name, name, 0x21)
    assert decode(parse(encode(opening)), None) == opening
    assert decode(parse(encode(heading)), opening) == heading
    note = Note(name, name, {name: name, "bytes": [1.5, float("nan")]})
    assert decode(parse(encode(note)), opening) == note._replace(data={name: name, "bytes": [1.5, "nan"]})


def test_digests_tell_plans_apart(tmp_path: Path) -> None:
    one = Plan("a", "", [[Probe(Command(1, 2))]])
    others = [
        Plan("b", "", one.stages),
        Plan("a", "", [[Probe(Command(1, 3))]]),
        Plan("a", "", [[Probe(Command(1, 2), exact=True)]]),
        Plan("a", "", [[Probe(Command(1, 2, b"\0"))]]),
        Plan("a", "", [[Probe(Command(1, 2, b"", 0x12))]]),
        Plan("a", "", [[], [Probe(Command(1, 2))]]),
    ]
    digests = {digest_of(plan) for plan in (one, *others)}
    assert len(digests) == 7
    assert digest_of(Plan("a", "else", [(Probe(Command(1, 2)),)])) == digest_of(one)
    with pytest.raises(BadInputFileError):
        digest_of(Plan("a", "", [], file=tmp_path / "gone.py"))


def test_an_empty_journal_is_started_again(tmp_path: Path) -> None:
    path = tmp_path / "run.jsonl"
    path.touch()
    assert read_journal(path) == Recorded(path, None, [], {}, {}, [], None, 0, False)
    ran = ask("bolt", SMALL, path, resume=True)
    assert in_order(read_journal(path).records()) == in_order(ran.records)


@pytest.mark.parametrize("consent", [[[]], [{}], ["read", None], ["read"] * 7, "read", None])
def test_risk_classes_are_checked_whatever_their_type(consent: object) -> None:
    with pytest.raises(BadLineError, match="not a list of risk classes"):
        Fields({"consent": consent}).risks("consent")
