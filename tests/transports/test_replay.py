"""What ``replay:FILE`` reads: journals, reports and captures, and files that are none of these."""

import json
import os
from pathlib import Path
from typing import Any, Final

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sphero_probe.catalogue import ROBOTS
from sphero_probe.errors import BadInputFileError, UsageError
from sphero_probe.protocol.packets import Command, Generation
from sphero_probe.simulator.recorded import Unknown
from sphero_probe.transports.recordings import read_recording
from sphero_probe.transports.replay import ReplaySettings, parse_replay, recorded_behind, recorded_port
from tests.support import capture_writers as writers
from tests.support.capture_conversation import cached_v1, found_v1, found_v2, woven
from tests.support.captures import CAPTURES

SENT: Final = "8d3a11011310246cd8"
"""Command 0x13:0x10 to node 1, sequence number 0x24, as the journal of a run has it."""
RECEIVED: Final = "8d39110113102400313cd8"
FINDING: Final[dict[str, Any]] = {"type": "finding", "sent": SENT, "received": RECEIVED, "rtt_ms": 12.5}
RUN: Final[dict[str, Any]] = {"type": "run", "robot": "bolt-plus", "device": "BP-1234"}


def written(folder: Path, *entries: object, array: bool = False) -> str:
    path = folder / "run.jsonl"
    path.write_text(json.dumps(entries) if array else "".join(f"{json.dumps(entry)}\n" for entry in entries))
    return str(path)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("run.jsonl", ReplaySettings("run.jsonl")),
        ("a/b.pcapng?unknown=0x02&speed=0", ReplaySettings("a/b.pcapng", 2, 0.0)),
        ("x?unknown=silent", ReplaySettings("x", Unknown.SILENT)),
        ("x?unknown=error&speed=2.5", ReplaySettings("x", Unknown.ERROR, 2.5)),
        ("x?robot=bolt&connection=2", ReplaySettings("x", robot=ROBOTS["bolt"], connection=2)),
    ],
)
def test_settings_are_read(text: str, expected: ReplaySettings) -> None:
    assert parse_replay(text) == expected


@pytest.mark.parametrize(
    ("text", "words"),
    [
        pytest.param("?speed=1", "names no file", id="no-file"),
        pytest.param("x?sped=1", "did you mean speed", id="key"),
        pytest.param("x?speed=1&speed=2", "twice", id="twice"),
        pytest.param("x?speed=fast", "0 answers at once", id="speed"),
        pytest.param("x?speed=nan", "0 answers at once", id="nan"),
        pytest.param("x?speed=-1", "0 answers at once", id="negative"),
        pytest.param("x?unknown=absent", "one of silent, error", id="unknown"),
        pytest.param("x?unknown=256", "one of silent, error", id="code"),
        pytest.param("x?connection=0", "from 1 up", id="connection"),
        pytest.param("x?robot=blot", "no robot 'blot'", id="robot"),
    ],
)
def test_other_settings_are_usage_errors(text: str, words: str) -> None:
    with pytest.raises(UsageError) as caught:
        parse_replay(text)
    assert words in f"{caught.value} {caught.value.hint}"


@pytest.mark.parametrize("array", [True, False])
def test_a_report_holds_what_was_on_the_wire(tmp_path: Path, array: bool) -> None:
    silent = {**FINDING, "received": None, "sent": SENT}
    blocked = {"type": "finding", "sent": None, "received": None}
    note = {"type": "note", "kind": "exchanges", "exchanges": [{"sent": SENT, "received": RECEIVED}, 7, {}]}
    odd = [{"type": "note", "kind": "exchanges", "exchanges": 5}, {"type": "note", "sent": "zz"}, 7]
    path = written(tmp_path, RUN, note, FINDING, silent, blocked, *odd, array=array)
    found = read_recording(path)
    assert (found.generation, found.robot, found.name) == (Generation.V2, ROBOTS["bolt-plus"], "BP-1234")
    early, answered, unanswered = found.exchanges
    assert early == answered._replace(delay=0.0)
    assert answered.command == Command(0x13, 0x10, b"", 0x11)
    assert answered.response
    assert (answered.response.code, answered.response.payload, answered.delay) == (0, b"\x31", 0.0125)
    assert unanswered == (answered.command, None, 0.0)
    assert recorded_port(found) == 1


def test_a_journal_that_was_cut_off_is_read_as_far_as_it_goes(tmp_path: Path) -> None:
    note = {"type": "note", "kind": "exchanges", "data": {"exchanges": [{**FINDING, "rtt_ms": 500}]}}
    path = Path(written(tmp_path, RUN, note))
    path.write_bytes(path.read_bytes() + b'{"type":"finding","se')
    (only,) = read_recording(str(path)).exchanges
    assert only.delay == 0.5


def test_a_file_that_has_changed_is_read_again(tmp_path: Path) -> None:
    path = written(tmp_path, RUN, FINDING)
    assert len(read_recording(path).exchanges) == 1
    written(tmp_path, RUN, FINDING, FINDING)
    assert len(read_recording(path).exchanges) == 2


def test_the_address_may_name_the_model_of_the_same_generation(tmp_path: Path) -> None:
    path = written(tmp_path, FINDING)
    assert recorded_behind(path).robot is None
    assert recorded_behind(f"{path}?robot=mini").robot is ROBOTS["mini"]
    with pytest.raises(UsageError, match="holds v2 packets; bb8 sends v1"):
        recorded_behind(f"{path}?robot=bb8")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        pytest.param(b"", "not a journal, a JSON report", id="empty"),
        pytest.param(b"hello\n", "not a journal, a JSON report", id="text"),
        pytest.param(b"{\n", ":1: not valid JSON", id="no-json"),
        pytest.param(b"[1,", "not valid JSON", id="half-an-array"),
        pytest.param(b"[" * 100_000, "not valid JSON", id="deep"),
        pytest.param(b"{}\n", "no command and its answer", id="nothing"),
        pytest.param(b'{"a":1}\n{\n{}\n', ":2: not valid JSON", id="line-2"),
        pytest.param(b"{" + b" " * (1 << 20), "a line of more than", id="long-line"),
    ],
)
def test_other_files_are_told_in_one_line(tmp_path: Path, text: bytes, words: str) -> None:
    path = tmp_path / "run.jsonl"
    path.write_bytes(text)
    with pytest.raises(BadInputFileError) as caught:
        read_recording(str(path))
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"sent": "8d"}, "entry 1: sent is not one command"),
        ({"sent": "xx"}, "entry 1: non-hex"),
        ({"sent": [1]}, "entry 1: bytes that are no text"),
        ({"sent": SENT * 2}, "entry 1: sent is not one command"),
        ({"received": SENT}, "entry 1: received is not one response"),
        ({"received": 5}, "entry 1: bytes that are no text"),
    ],
)
def test_entries_that_no_run_writes_are_told(tmp_path: Path, change: dict[str, object], words: str) -> None:
    with pytest.raises(BadInputFileError, match=words):
        read_recording(written(tmp_path, {**FINDING, **change}))


@pytest.mark.parametrize("value", [None, True, "x", -1, 1e300, 10**400, float("inf"), float("nan"), [], {}])
def test_a_senseless_time_is_bounded(tmp_path: Path, value: object) -> None:
    (only,) = read_recording(written(tmp_path, {**FINDING, "rtt_ms": value})).exchanges
    assert 0 <= only.delay <= 600


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes")
def test_nothing_is_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(BadInputFileError, match="not a regular file"):
        read_recording(str(tmp_path / "pipe"))
    with pytest.raises(BadInputFileError, match="cannot read"):
        read_recording(str(tmp_path / "none"))
    with pytest.raises(BadInputFileError, match="cannot read"):
        read_recording("\0")


JSON: Final = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8) | st.just(SENT),
    lambda inner: st.lists(inner, max_size=3),
    max_leaves=4,
)
ENTRIES: Final = st.fixed_dictionaries(
    {"type": st.sampled_from(["finding", "exchange", "run", "journal"]) | JSON},
    optional=dict.fromkeys(("sent", "received", "rtt_ms", "seconds", "robot", "device"), JSON),
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60)
@given(
    st.lists(ENTRIES.map(lambda entry: {**FINDING, **entry}) | ENTRIES, max_size=4), st.binary(max_size=20)
)
def test_hostile_entries_are_read_or_told(tmp_path: Path, entries: list[object], tail: bytes) -> None:
    path = Path(written(tmp_path, *entries))
    path.write_bytes(path.read_bytes() + tail)
    try:
        found = read_recording(str(path))
    except BadInputFileError:
        return
    assert found.exchanges
    assert len(found.name) <= 64


def captured(folder: Path, data: bytes) -> str:
    path = folder / "capture.btsnoop"
    path.write_bytes(data)
    return str(path)


def test_a_capture_holds_the_pairs_of_one_robot(tmp_path: Path) -> None:
    found = read_recording(captured(tmp_path, writers.btsnoop(writers.hci(woven(found_v2())))))
    assert found.generation is Generation.V2
    assert any(exchange.response for exchange in found.exchanges)
    for exchange in found.exchanges:
        if exchange.response:
            assert (exchange.response.did, exchange.response.cid) == exchange.command[:2]


@pytest.mark.parametrize("form", [form for form in CAPTURES if "H4" in form or "btsnoop" in form])
def test_of_several_robots_one_is_chosen(tmp_path: Path, form: str) -> None:
    path = captured(tmp_path, CAPTURES[form]())
    with pytest.raises(UsageError, match=r"several robots; choose one with \?connection=N") as caught:
        read_recording(path)
    for label in caught.value.hint.removeprefix("connections: ").split(", "):
        assert read_recording(path, int(label.split()[0])).exchanges
    with pytest.raises(UsageError, match="no robot on connection 99"):
        read_recording(path, 99)


def test_v1_in_a_capture(tmp_path: Path) -> None:
    for talk in (cached_v1(), found_v1()):
        found = read_recording(captured(tmp_path, writers.btsnoop(writers.hci(woven(talk)))))
        assert found.generation is Generation.V1
        assert {exchange.response.code for exchange in found.exchanges if exchange.response} <= set(range(64))


def test_a_command_at_the_end_of_a_capture_may_have_been_answered_later(tmp_path: Path) -> None:
    path = captured(tmp_path, writers.btsnoop(writers.hci(woven(found_v2()))))
    assert read_recording(path).exchanges[-1].response is not None
