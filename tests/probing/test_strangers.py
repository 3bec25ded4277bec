"""Robots that the project does not model: a run is harmless, true, and ends, or is a known failure."""

import ast
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sphero_probe.catalogue import ROBOTS, lookup, rows_of
from sphero_probe.errors import SpheroProbeError
from sphero_probe.link.exchange import Silent
from sphero_probe.probing.finding import Note, Outcome, Summary
from sphero_probe.protocol.packets import Generation
from tests.support import strangers
from tests.support.strangers.commands import BOLT, R2, RVR, Effect, Row
from tests.support.strangers.firmware import Firmware, Moment, Voice
from tests.support.strangers.frames import (
    Answer,
    EarV1,
    EarV2,
    Request,
    answer_v1,
    answer_v2,
    notification_v1,
    notification_v2,
)
from tests.support.strangers.habits import STRANGERS, Expect, Stranger
from tests.support.strangers.judge import errors, judge
from tests.support.strangers.robot import Executed, Robot
from tests.support.strangers.runs import KINDS, Ran, run, triple_of
from tests.support.strangers.shown import check_shown_and_kept
from tests.support.strangers.transport import TooManyWritesError

SLOW = pytest.mark.slow
"""The controls go through all the code there is for robots without a habit; the others take long."""
BY_NAME = {stranger.name: stranger for stranger in STRANGERS}


def _case(stranger: Stranger) -> object:
    is_control = stranger.name.startswith("plain")
    return pytest.param(stranger, id=stranger.name, marks=[] if is_control else [SLOW])


@pytest.mark.parametrize("stranger", [_case(stranger) for stranger in STRANGERS])
def test_a_run_on_a_stranger_is_harmless_and_true_and_ends(stranger: Stranger) -> None:
    offences = {name: found for name, found in judge(run(stranger, kind) for kind in KINDS).items() if found}
    assert {name: found[:5] for name, found in offences.items()} == {}


def test_the_family_is_large_and_each_has_a_name_and_a_habit() -> None:
    assert len(STRANGERS) == len(BY_NAME) >= 40
    assert all(stranger.habit for stranger in STRANGERS)


_JUNK = st.tuples(st.binary(max_size=24), st.integers(0, 12), st.integers(0, 12))


@SLOW
@settings(max_examples=25)
@given(
    junk=st.lists(_JUNK, min_size=1), begins=st.sampled_from([0, 2, 10, 40]), every=st.sampled_from([1, 3, 7])
)
def test_no_bytes_that_a_robot_may_say_break_a_run(
    junk: list[tuple[bytes, int, int]], begins: int, every: int
) -> None:
    """From some moment on, every so many answers have a part replaced by anything."""

    def pieces(frame: bytes, moment: Moment) -> list[bytes]:
        if moment.number < begins or moment.number % every:
            return [frame]
        said, begin, end = junk[moment.number % len(junk)]
        spoilt = frame[:begin] + said + frame[begin + end :]
        return [spoilt] if spoilt else []

    ran = run(_junk(Voice(pieces=pieces)), "sweep")
    assert not list(errors(ran))
    assert not isinstance(ran.error, TimeoutError | TooManyWritesError)
    assert not any(done.unallowed for done in ran.robot.ledger)
    check_shown_and_kept(ran)


_LIE = st.tuples(
    st.integers(0, 255),
    st.sampled_from([0, 5, 2, 1, 9, 10]) | st.integers(0, 255),
    st.binary(max_size=40) | st.integers(2030, 2060).map(bytes),
    st.sampled_from([None, 0x01, 0x11, 0xFF]),
)


@SLOW
@settings(max_examples=25)
@given(lies=st.lists(_LIE, min_size=1), begins=st.sampled_from([0, 2, 10, 40]), every=st.sampled_from([1, 3]))
def test_no_sound_answer_with_any_content_breaks_a_run(
    lies: list[tuple[int, int, bytes, int | None]], begins: int, every: int
) -> None:
    """Checksums are right, and flags, code, data and source are anything."""

    def alter(answer: Answer, moment: Moment) -> Answer:
        if moment.number < begins or moment.number % every:
            return answer
        flags, code, data, source = lies[moment.number % len(lies)]
        flags = answer.flags if flags < 128 else flags & ~0x30 | answer.flags & 0x30
        sid = source if source is not None and answer.sid is not None else answer.sid
        return answer._replace(flags=flags, code=code, data=data, sid=sid)

    ran = run(_junk(Voice(alter=alter)), "sweep")
    assert not list(errors(ran))
    assert not isinstance(ran.error, TimeoutError | TooManyWritesError)
    check_shown_and_kept(ran)


def _junk(voice: Voice) -> Stranger:
    return Stranger(name="junk", habit="", firmware=Firmware(rows=R2), model="r2d2", voice=voice, few=True)


# --- the robot is its own ----------------------------------------------------------------------------------


@pytest.mark.parametrize("module", ["commands", "firmware", "frames", "habits", "robot"])
def test_the_robot_shares_no_code_with_the_project(module: str) -> None:
    tree = ast.parse((Path(strangers.__file__).parent / f"{module}.py").read_text())
    imported = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    imported |= {name.name for node in ast.walk(tree) if isinstance(node, ast.Import) for name in node.names}
    foreign = {name for name in imported if name and name.split(".")[0] not in sys.stdlib_module_names}
    assert all(name.startswith("tests.support.strangers.") for name in foreign)


@pytest.mark.parametrize("rows", [BOLT, RVR, R2], ids=["bolt", "rvr", "r2"])
def test_named_commands_are_published_and_the_others_are_not(rows: tuple[Row, ...]) -> None:
    for row in rows:
        known = rows_of(Generation.V2, row.did, row.cid)
        assert bool(known) == bool(row.name), row
        assert not known or row.name in {one.name.split(".")[-1] for one in known}


def test_frames_are_those_of_real_robots() -> None:
    """Bytes seen on a robot [golden_vectors A1, A9, C1, D3, D4, H1] and computed by hand [X2, X18]."""
    assert EarV2().feed(bytes.fromhex("8d3a0101130d01a2d8")) == [Request(0x3A, 1, 0x13, 0x0D, 1, b"")]
    assert EarV2().feed(bytes.fromhex("8d0a170d0201ced8")) == [Request(0x0A, None, 0x17, 0x0D, 2, b"\x01")]
    version = Answer(0x39, 0x21, 1, 0x11, 0, 9, 0, bytes.fromhex("0009000101ce"))
    assert answer_v2(version).hex() == "8d392101110009000009000101ceb1d8"
    assert answer_v2(Answer(0x29, None, 1, 0x13, 0x0D, 0, 0, b"")).hex() == "8d2901130d0000b5d8"
    assert answer_v2(Answer(0x09, None, None, 0x13, 0x0D, 0, 0, b"")).hex() == "8d09130d0000d6d8"
    mac = Answer(0x21, None, 1, 0x11, 6, 0xFF, 0, b"dec954aed0f6")
    assert answer_v2(mac).hex() == "8d21011106ff0064656339353461656430663603d8"
    special = Answer(0x09, None, None, 0x10, 0, 0x8D, 0, bytes([0x8D, 0xAB, 0xD8]))
    assert answer_v2(special).hex() == "8d091000ab0500ab05ab23ab5049d8"
    assert notification_v2(0x13, 0x11, b"").hex() == "8d081311ffd4d8"
    assert EarV1().feed(bytes.fromhex("75 3e ffff00015501a8")) == [Request(0xFF, None, 0, 1, 0x55, b"")]
    assert answer_v1(Answer(0, None, None, 0, 1, 0x55, 0, b"")).hex() == "ffff005501a9"
    assert notification_v1(3, bytes.fromhex("0001fff8"))[:5].hex() == "fffe030005"


def test_what_is_damaged_is_not_heard() -> None:
    assert EarV2().feed(bytes.fromhex("8d3a0101130d01a3d8")) == []
    assert EarV1().feed(bytes.fromhex("ffff00015501a9")) == []
    ear = EarV2()
    assert ear.feed(b"\x8d\x3a\x01") == []
    assert len(ear.feed(bytes.fromhex("8d0a130d00d5d8"))) == 1


# --- the judge sees ---------------------------------------------------------------------------------------


def _say(ran: Ran, triple: tuple[int, int, int], outcome: Outcome) -> None:
    old = next(finding for finding in ran.findings if triple_of(finding) == triple)
    ran.records.append(old._replace(outcome=outcome))


def _is_absent(ran: Ran) -> None:
    _say(ran, (1, 0x13, 0x33), Outcome.ABSENT)


def _is_silent(ran: Ran) -> None:
    _say(ran, (1, 0x14, 0x05), Outcome.SILENT)


def _is_skipped(ran: Ran) -> None:
    _say(ran, (2, 0x18, 0x01), Outcome.SKIPPED)


def _exists(ran: Ran) -> None:
    _say(ran, (1, 0x14, 0x05), Outcome.EXISTS)


def _is_unsure(ran: Ran) -> None:
    for cid in range(8):
        _say(ran, (1, 0x14, cid), Outcome.INCONCLUSIVE)


def _is_unknown(ran: Ran) -> None:
    pairs = [{"target": 0x11, "did": 0x14, "cid": 0}]
    ran.records.insert(1, Note("comparison", "", {"hidden": [], "ghost": [], "unknown": pairs}))


def _executed(ran: Ran, row: Row, data: bytes = b"") -> None:
    ran.robot.ledger.append(Executed(1.0, 1.0, row, data))


def _slept(ran: Ran) -> None:
    _executed(ran, next(row for row in BOLT if row.name == "sleep"))


def _drove(ran: Ran) -> None:
    _executed(ran, next(row for row in BOLT if row.did == 0x16 and not row.name), bytes(11))


def _lit_twice(ran: Ran) -> None:
    for _ in range(2):
        _executed(ran, next(row for row in BOLT if row.did == 0x1A and not row.name), bytes(11))


def _hangs(ran: Ran) -> None:
    ran.error = TimeoutError()


def _breaks(ran: Ran) -> None:
    ran.error = ValueError("a payload of 2048 bytes")


def _ends_early(ran: Ran) -> None:
    ran.error = SpheroProbeError("no reason")


def _has_no_summary(ran: Ran) -> None:
    del ran.records[-1]


@pytest.mark.parametrize(
    ("harm", "checks"),
    [
        (lambda _: None, set()),
        (_is_absent, {"lost", "doubt"}),
        (_is_silent, {"lost"}),
        (_is_skipped, {"lost"}),
        (_exists, {"invented"}),
        (_is_unsure, {"doubt"}),
        (_is_unknown, {"invented"}),
        (_slept, {"harmless", "reported"}),
        (_drove, {"harmless", "reported", "stops"}),
        (_lit_twice, {"harmless", "reported", "stops"}),
        (_hangs, {"ends"}),
        (_breaks, {"errors"}),
        (_ends_early, {"ends"}),
        (_has_no_summary, {"ends"}),
    ],
)
def test_the_judge_sees_what_is_wrong(harm: Callable[[Ran], None], checks: set[str]) -> None:
    ran = run(BY_NAME["plain bolt"], "sweep")
    summary = ran.records[-1]
    harm(ran)
    if not isinstance(ran.records[-1], Summary) and harm is not _has_no_summary:
        ran.records.append(summary)
    assert {name for name, found in judge([ran]).items() if found} == checks


def test_a_report_of_what_ran_is_enough_where_nothing_could_warn() -> None:
    ran = run(BY_NAME["plain bolt"], "sweep")
    row = next(row for row in BOLT if row.did == 0x13 and not row.name and row.effect > Effect.READ)
    ran.robot.ledger.append(Executed(ran.seconds, ran.seconds, row, bytes(11)))
    summary = ran.records.pop()
    assert isinstance(summary, Summary)
    ran.records += [Note("run", "executed 0x13:0x2e with 11 bytes", {}), summary._replace(complete=False)]
    assert not {name for name, found in judge([ran]).items() if found}


@SLOW
def test_every_command_of_a_control_is_named() -> None:
    for name in ("plain bolt", "plain rvr", "plain r2"):
        ran = run(BY_NAME[name], "discovery")
        named = {f.command[:2] for f in ran.findings if f.outcome in (Outcome.EXISTS, Outcome.SKIPPED)}
        assert {row.pair for row in ran.robot.firmware.rows if row.cid < 0x40} <= named
        assert not ran.robot.asleep
        assert not [f for f in ran.findings if isinstance(f.exchange, Silent)]


def test_what_a_stranger_expects_is_spelt_out() -> None:
    for stranger in STRANGERS:
        assert (Expect.MUTE in stranger.expect) == bool(stranger.oddity), stranger.name
        assert stranger.model in ROBOTS
        assert isinstance(Robot(stranger.firmware, stranger.voice).truth, set)
    assert lookup(Generation.V2, 0x13, 0x2E, ROBOTS["bolt"]) is None
