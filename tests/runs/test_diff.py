"""Comparisons, made by hand and by chance; an independent rule in this file decides what a difference is."""

import random
from collections.abc import Iterable, Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue import ROBOTS, all_rows
from sphero_probe.catalogue.model import Kind
from sphero_probe.catalogue.risk import Risk
from sphero_probe.probing.finding import Confidence, Finding, Heading, Outcome
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Generation
from sphero_probe.runs.diff import UNCERTAIN, Change, Diff, Values, compare
from sphero_probe.runs.listed_sides import catalogue_side
from sphero_probe.runs.sides import Side, Standing, observation_of, run_side
from tests.probing.test_oracle import ask
from tests.support.reports_by_hand import CODEC, HEADING, SECONDARY, answered, refused, silent

OTHER_ROBOT = HEADING._replace(device="SB-FFFF")
NEW_FIRMWARE = HEADING._replace(firmware={"primary": "6.0.0", "secondary": "4.1.7"})


def side(findings: Iterable[Finding], heading: Heading | None = HEADING) -> Side:
    return run_side("x", "run", CODEC, heading, map(observation_of, findings), complete=True)


def changes(before: Sequence[Finding], after: Sequence[Finding], **keys: bool) -> list[Change]:
    diff = compare(side(before), side(after), **keys)
    return [one.change for one in (*diff.differences, *diff.uncertain)]


def inconclusive(did: int, cid: int) -> Finding:
    return answered(1, did, cid, 0x05, masked=True)


def asked_with(finding: Finding, payload: bytes) -> Finding:
    return finding._replace(command=finding.command._replace(payload=payload))


ABSENT = answered(1, 0x13, 0x55, 0x02)
EXISTS = answered(1, 0x13, 0x55, 0x05)
SILENT = silent(1, 0x13, 0x55)
WITHHELD = refused(1, 0x13, 0x55, Risk.PERSIST, "persist: unknown (--allow persist)")
DOUBTED = inconclusive(0x13, 0x55)
MAYBE = EXISTS._replace(confidence=Confidence.MAYBE)
VERSION = answered(1, 0x11, 0x00, 0x00, bytes.fromhex("000500010002"))
BOOTLOADER = answered(1, 0x11, 0x01, 0x00, bytes.fromhex("000500010002"))
BATTERY = answered(1, 0x13, 0x17, 0x00, b"\x01")
NAME = answered(1, 0x19, 0x04, 0x00, b"SB-1B2C\0")
OLD = {"name": "SB-1B2C"}
UNKNOWN = answered(1, 0x13, 0x55, 0x00, b"\1")


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        pytest.param(ABSENT, EXISTS, [Change.APPEARED], id="appeared"),
        pytest.param(EXISTS, ABSENT, [Change.DISAPPEARED], id="disappeared"),
        pytest.param(EXISTS, EXISTS, [], id="same"),
        pytest.param(ABSENT, answered(1, 0x13, 0x55, 0x01), [], id="absent-for-another-reason"),
        pytest.param(EXISTS, SILENT, [Change.ANSWER], id="silent-now"),
        pytest.param(SILENT, ABSENT, [Change.ANSWER], id="silent-before"),
        pytest.param(EXISTS, answered(1, 0x13, 0x55, 0x07), [Change.LAYOUT], id="accepts-the-length"),
        pytest.param(
            answered(1, 0x13, 0x55, 0x04), answered(1, 0x13, 0x55, 0x07), [Change.ANSWER], id="another-code"
        ),
        pytest.param(
            answered(1, 0x13, 0x55, 0x00, b"\1"),
            answered(1, 0x13, 0x55, 0x00, b"\1\2"),
            [Change.LAYOUT],
            id="longer-answer",
        ),
        pytest.param(
            EXISTS, asked_with(answered(1, 0x13, 0x55, 0x00), b""), [], id="other-arguments-are-not-compared"
        ),
        pytest.param(EXISTS, DOUBTED, [Change.NO_LONGER_CERTAIN], id="inconclusive-now"),
        pytest.param(DOUBTED, ABSENT, [Change.NEWLY_CERTAIN], id="inconclusive-before"),
        pytest.param(MAYBE, EXISTS, [Change.NEWLY_CERTAIN], id="maybe-before"),
        pytest.param(EXISTS, WITHHELD, [Change.NOT_COMPARABLE], id="withheld-now"),
        pytest.param(WITHHELD, SILENT, [Change.NOT_COMPARABLE], id="withheld-before"),
        pytest.param(ABSENT, WITHHELD, [], id="absent-and-withheld"),
        pytest.param(WITHHELD, DOUBTED, [], id="nothing-known"),
        pytest.param(
            answered(1, 0x13, 0x2A, 0x00)._replace(risk=Risk.WRITE),
            answered(1, 0x13, 0x2A, 0x00)._replace(risk=Risk.MOTION),
            [Change.RISK],
            id="risk",
        ),
        pytest.param(EXISTS, EXISTS._replace(knowledge=BATTERY.knowledge), [Change.NAME], id="named-since"),
    ],
)
def test_kinds(before: Finding, after: Finding, expected: list[Change]) -> None:
    assert changes([before], [after]) == expected


def test_what_was_not_asked_is_not_missing() -> None:
    assert changes([EXISTS], []) == [Change.NOT_COMPARABLE]
    assert changes([], [EXISTS]) == [Change.NOT_COMPARABLE]
    assert changes([ABSENT], []) == []


def test_all_commands_of_a_device_disappear_with_it() -> None:
    gone = [answered(number, 0x13, 0xF0 + number, 0x01) for number in range(1, 4)]
    assert changes([EXISTS], gone) == [Change.DISAPPEARED]
    assert changes(gone, [EXISTS]) == [Change.APPEARED]
    assert changes([EXISTS], [*gone, answered(4, 0x13, 0xE0, 0x02)]) == [Change.NOT_COMPARABLE]


def test_all_commands_of_a_node_disappear_with_it() -> None:
    on_other = answered(1, 0x13, 0x55, 0x05, target=SECONDARY)
    assert changes([on_other], [answered(1, 0x10, 0x00, 0x09, target=SECONDARY)]) == [Change.DISAPPEARED]


def test_the_port_does_not_matter_and_the_node_does() -> None:
    assert changes([EXISTS], [answered(1, 0x13, 0x55, 0x05, target=0x01)]) == []
    assert changes([EXISTS], [answered(1, 0x13, 0x55, 0x05, target=SECONDARY)]) == [Change.NOT_COMPARABLE] * 2


def test_a_robot_without_addresses_is_compared_with_the_primary_node() -> None:
    bare = [EXISTS._replace(command=EXISTS.command._replace(target=None))]
    assert changes(bare, [ABSENT]) == [Change.DISAPPEARED]
    assert changes([ABSENT], bare) == [Change.APPEARED]
    assert changes(bare, [answered(1, 0x13, 0x55, 0x05, target=SECONDARY)]) == [Change.NOT_COMPARABLE] * 2


@pytest.mark.parametrize(
    ("before", "after", "heading", "values", "expected"),
    [
        pytest.param(BATTERY, b"\x02", HEADING, False, [], id="volatile"),
        pytest.param(BATTERY, b"\x02", HEADING, True, [({"state": "ok"}, {"state": "low"})], id="asked-for"),
        pytest.param(NAME, b"SB-2\0\0\0\0", HEADING, False, [(OLD, {"name": "SB-2"})], id="stable"),
        pytest.param(NAME, b"Bo\0", HEADING, False, [(OLD, {"name": "Bo"})], id="a-text-of-any-length"),
        pytest.param(NAME, b"SB-FFFF\0", OTHER_ROBOT, False, [], id="two-robots"),
        pytest.param(NAME, b"B\0", OTHER_ROBOT, True, [(OLD, {"name": "B"})], id="two-robots-all"),
        pytest.param(VERSION, bytes(6), NEW_FIRMWARE, False, [], id="firmware-is-said-first"),
        pytest.param(
            BOOTLOADER,
            bytes.fromhex("000500010003"),
            NEW_FIRMWARE,
            False,
            [({"revision": 2}, {"revision": 3})],
            id="only-what-differs",
        ),
        pytest.param(UNKNOWN, b"\2", HEADING, False, [], id="of-no-layout"),
        pytest.param(UNKNOWN, b"\2", HEADING, True, [({}, {})], id="of-no-layout-all"),
        pytest.param(answered(1, 0x13, 0x10, 0x05, b"\1"), b"\2", HEADING, False, [], id="of-an-error"),
    ],
)
def test_values(
    before: Finding,
    after: bytes,
    heading: Heading,
    values: bool,
    expected: list[tuple[dict[str, object], dict[str, object]]],
) -> None:
    code = before.code
    assert code is not None
    later = answered(1, before.command.did, before.command.cid, code, after)
    diff = compare(side([before]), side([later], heading), values=values)
    assert [(dict(one.was), dict(one.now)) for one in diff.differences] == expected
    assert {one.change for one in diff.differences} <= {Change.VALUE}


def test_robots_and_firmwares_are_compared_first() -> None:
    assert compare(side([]), side([])).same_robot
    other = compare(side([]), side([], OTHER_ROBOT))
    assert (other.same_robot, other.values, other.other_firmware) == (False, Values.NONE, {})
    assert compare(side([]), side([], NEW_FIRMWARE)).other_firmware == {"primary": ("5.0.2", "6.0.0")}
    assert not compare(side([], None), side([], None)).same_robot


# ---------------------------------------------------------------- by chance

CELLS = st.tuples(st.sampled_from((0x11, 0x12)), st.sampled_from((0x13, 0x19)), st.integers(0, 3))
RESULTS = st.sampled_from(("exists", "absent", "silent", "withheld", "inconclusive"))
RUNS = st.dictionaries(CELLS, RESULTS, max_size=14)
MADE = {
    "exists": lambda number, place: answered(number, place[1], place[2], 0x05, target=place[0]),
    "absent": lambda number, place: answered(number, place[1], place[2], 0x02, target=place[0]),
    "silent": lambda number, place: silent(number, place[1], place[2], target=place[0]),
    "withheld": lambda number, place: refused(number, place[1], place[2], Risk.WRITE, "no", target=place[0]),
    "inconclusive": lambda number, place: answered(
        number, place[1], place[2], 0x05, target=place[0], masked=True
    ),
}


def findings_of(run: dict[tuple[int, int, int], str]) -> list[Finding]:
    return [MADE[result](number, place) for number, (place, result) in enumerate(sorted(run.items()), 1)]


def places(diff: Diff) -> dict[tuple[int, int, int], Change]:
    return {(0x10 | (one.key[0] or 0), *one.key[1:]): one.change for one in diff.differences}


@given(RUNS, RUNS)
def test_differences_are_those_of_a_rule_without_cleverness(
    one: dict[tuple[int, int, int], str], other: dict[tuple[int, int, int], str]
) -> None:
    expected = {}
    for place in one.keys() & other.keys():
        pair = one[place], other[place]
        if set(pair) <= {"exists", "absent", "silent"} and pair[0] != pair[1]:
            expected[place] = {
                ("absent", "exists"): Change.APPEARED,
                ("exists", "absent"): Change.DISAPPEARED,
            }.get(pair, Change.ANSWER)
    diff = compare(side(findings_of(one)), side(findings_of(other)))
    assert places(diff) == expected
    settled = {"exists", "absent", "silent"}
    both = [place for place in one if one[place] in settled and other.get(place) in settled]
    assert diff.compared == len(both)
    assert diff.compared + diff.not_compared == len(one.keys() | other.keys())
    assert {change.change for change in diff.uncertain} <= UNCERTAIN


@given(RUNS, st.randoms(use_true_random=False), st.integers(0, 14))
def test_a_run_does_not_differ_from_itself_in_any_order_with_losses_and_repetitions(
    run: dict[tuple[int, int, int], str], chance: random.Random, losses: int
) -> None:
    whole = findings_of(run)
    twice = [*whole, *chance.sample(whole, len(whole) // 2)]
    chance.shuffle(twice)
    assert side(twice).entries == side(whole).entries
    same = compare(side(whole), side(twice))
    assert (same.differences, same.uncertain) == ((), ())
    kept = twice[losses:]
    for diff in (compare(side(whole), side(kept)), compare(side(kept), side(whole))):
        assert not diff.differences
        assert {one.change for one in diff.uncertain} <= {Change.NOT_COMPARABLE}


# ---------------------------------------------------------------- the catalogue


@pytest.mark.parametrize("key", ROBOTS)
def test_the_catalogue_of_a_robot_lists_its_commands_and_nothing_else(key: str) -> None:
    robot = ROBOTS[key]
    listed = catalogue_side(robot)
    rows = [row for row in all_rows(robot.generation) if key in row.nodes and row.kind is Kind.COMMAND]
    assert {place[1:] for place in listed.entries} == {(row.did, row.cid) for row in rows}
    usual = 1 if robot.addressed else None
    assert listed.entry((usual, 0x77, 0x77)).standing is Standing.ABSENT
    assert listed.entry((None if robot.addressed else 1, 0x77, 0x77)).standing is Standing.NOT_ASKED


def test_readings_are_volatile_and_limits_are_not() -> None:
    """Fields in units of what a sensor measures change by themselves; thresholds are settings."""
    limits = ("threshold", "hysteresis", "trip", "linear_acceleration")
    for row in (*all_rows(Generation.V2), *all_rows(Generation.V1)):
        if row.kind is Kind.COMMAND and row.risk is Risk.READ and row.response:
            for field in (field for variant in row.response.variants for field in variant.fields):
                if field.unit in ("V", "A", "°C", "lx", "%", "cm"):
                    assert field.volatile is not any(word in field.name for word in limits), row.name


def test_outcomes_all_have_a_standing() -> None:
    for outcome in Outcome:
        run = side([EXISTS._replace(outcome=outcome)])
        assert run.entry((1, 0x13, 0x55)).standing in Standing


# ---------------------------------------------------------------- two runs of one robot


def asked(settings: str) -> Side:
    robot, records, _ = ask(settings)
    findings = [record for record in records if isinstance(record, Finding)]
    heading = next(record for record in records if isinstance(record, Heading))
    codec = CODECS[robot.model.generation]
    return run_side(settings, "run", codec, heading, map(observation_of, findings), complete=True)


TROUBLES = (
    "loss=0.05",
    "duplicate=0.2&reorder=0.3",
    "loss=0.03&duplicate=0.1&reorder=0.2&latency=40ms&split=1",
    "busy=0.1&corrupt=0.02",
)


@pytest.mark.parametrize("trouble", TROUBLES)
@pytest.mark.parametrize("model", ["bolt?hidden=5&seed=3", "bb8?hidden=3&seed=3"])
def test_the_line_to_a_robot_is_no_difference(model: str, trouble: str) -> None:
    diff = compare(asked(model), asked(f"{model}&{trouble}"))
    assert diff.same_robot
    assert not diff.differences
    assert diff.compared > 50
