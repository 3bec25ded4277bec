"""JUnit XML: read by another parser, its elements compared with the schema that CI viewers follow."""

from collections.abc import Sequence
from xml.etree import ElementTree as ET

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.probing.finding import Note
from sphero_probe.reports import views
from sphero_probe.reports.checks import CHECKS, Look, State, check_row
from sphero_probe.reports.diff_rows import DIFFERENCES, diff_rows
from sphero_probe.reports.rows import Row, note_row
from sphero_probe.runs.diff import compare
from tests.runs.test_diff import side
from tests.support.reports_by_hand import (
    ASKED,
    HOSTILE,
    PRIMARY,
    RUN,
    answered,
    hostile_rows,
    rendered,
    run_of,
    silent,
)

SCHEMA = {
    "testsuites": ({"name", "time", "tests", "failures", "errors"}, {"testsuite"}),
    "testsuite": (
        {"name", "tests", "failures", "errors", "skipped", "time", "timestamp"},
        {"properties", "testcase"},
    ),
    "properties": (set(), {"property"}),
    "property": ({"name", "value"}, set()),
    "testcase": ({"name", "classname", "time"}, {"skipped", "failure", "system-out"}),
    "skipped": ({"message"}, set()),
    "failure": ({"type", "message"}, set()),
    "system-out": (set(), set()),
}
"""Element -> attributes and children that junit-10.xsd of pytest's sources allows and this tool uses."""


def read(rows: Sequence[Row], view: views.View = views.FINDINGS, *, unicode: bool = True) -> ET.Element:
    """The one suite of a document, which follows the schema and counts its cases rightly."""
    root = ET.fromstring(rendered("junit", rows, view, unicode=unicode).encode("utf-8"))
    for element in root.iter():
        attributes, children = SCHEMA[element.tag]
        assert set(element.keys()) <= attributes
        assert {child.tag for child in element} <= children
    (suite,) = root
    cases = suite.findall("testcase")
    assert suite.get("tests") == root.get("tests") == str(len(cases))
    assert (
        suite.get("failures")
        == root.get("failures")
        == str(sum(bool(case.findall("failure")) for case in cases))
    )
    assert suite.get("skipped") == str(sum(bool(case.findall("skipped")) for case in cases))
    names = [(case.get("classname"), case.get("name")) for case in cases]
    assert len(set(names)) == len(names)
    return suite


def case(suite: ET.Element, name: str) -> ET.Element:
    (found,) = [case for case in suite.findall("testcase") if str(case.get("name")).startswith(name)]
    return found


def test_a_run_has_a_case_for_each_finding_and_one_for_itself() -> None:
    suite = read(RUN)
    assert len(suite.findall("testcase")) == len(ASKED) + 1
    assert (suite.get("failures"), suite.get("name")) == ("0", "sweep")
    assert (suite.get("time"), suite.get("timestamp")) == ("1.234", "2025-11-21T22:31:00")
    battery = case(suite, "0x13:0x10 power.get_battery_percentage")
    assert (battery.get("classname"), battery.get("time")) == ("sphero-probe.primary.0x13", "0.031")
    assert battery.findtext("system-out") == "exists: success: percentage 87 %"
    blocked = case(suite, "0x13:0x00").find("skipped")
    assert blocked is not None
    assert str(blocked.get("message")).startswith("skipped: brick: power.enter_deep_sleep")
    assert list(case(suite, "0x13:0x98")) == []
    assert case(suite, "0x13:0x97").findtext("system-out") == "silent: no answer, asked 3 times"
    assert list(case(suite, "the run is complete")) == []
    properties = {one.get("name"): one.get("value") for one in suite.iter("property")}
    assert properties["firmware"] == "primary 5.0.2, secondary 4.1.7"


def test_what_is_wrong_fails() -> None:
    data: dict[str, object] = {"target": PRIMARY, "did": 0x13, "cid": 0x99}
    note = note_row(Note("executed", "0x13:0x99 was executed", data))
    suite = read(run_of(ASKED, [note], complete=False))
    assert case(suite, "0x13:0x99").findtext("failure") == "0x13:0x99 was executed"
    assert "a wrong length was executed" in str(case(suite, "the run is complete").findtext("failure"))
    assert suite.get("failures") == "2"


def test_differences_from_a_baseline_fail_in_the_case_of_their_finding() -> None:
    gone = [answered(number, 0x19, 0xF0 + number, 0x01) for number in range(10, 13)]
    before = [answered(1, 0x13, 0x98, 0x05), answered(2, 0x13, 0x97, 0x05), answered(3, 0x19, 0x04, 0x05)]
    now = [*ASKED, *gone]
    suite = read([*run_of(now), *diff_rows(compare(side(before), side(now)))])
    assert {case.get("name") for case in suite.findall("testcase") if case.findall("failure")} == {
        "0x13:0x98 unknown",
        "0x13:0x97 unknown",
        "0x19:0x04 connection.get_bluetooth_name",  # not asked: its device is gone
    }
    failure = case(suite, "0x13:0x98").find("failure")
    assert failure is not None
    assert failure.get("type") == "disappeared"
    assert failure.text == (
        "disappeared: primary 0x13:0x98 unknown: exists: 0x05 bad data length -> absent: 0x02 bad command id"
    )


def test_a_comparison_has_a_case_for_each_difference_and_one_for_itself() -> None:
    before, after = side([answered(1, 0x13, 0x98, 0x05)]), side([silent(1, 0x13, 0x98)])
    suite = read(diff_rows(compare(before, after)), DIFFERENCES)
    assert [case.get("name") for case in suite.findall("testcase")] == [
        "0x13:0x98 unknown",
        "1 difference in 1 command",
    ]
    same = read(diff_rows(compare(before, before)), DIFFERENCES)
    assert (same.get("tests"), same.get("failures")) == ("1", "0")
    uncertain = read(diff_rows(compare(before, side([]))), DIFFERENCES)
    assert (uncertain.get("failures"), uncertain.get("skipped")) == ("0", "1")


def test_checks_fail_and_are_skipped() -> None:
    rows = [check_row(state.value, Look(state, "seen", "fix it")) for state in State]
    suite = read(rows, CHECKS)
    assert (suite.get("tests"), suite.get("failures"), suite.get("skipped")) == ("4", "1", "1")
    assert case(suite, "fail").findtext("failure") == "seen -> fix it"


def test_commands_that_were_asked_several_times_have_a_case_each() -> None:
    twice = [answered(1, 0x13, 0x10, 0x00), answered(2, 0x13, 0x10, 0x05)]
    names = [case.get("name") for case in read(run_of(twice)).findall("testcase")]
    name = "0x13:0x10 power.get_battery_percentage"
    assert names[:2] == [name, f"{name} (2)"]


@pytest.mark.unmeasured
@given(st.text(st.characters(), max_size=30) | st.just(HOSTILE), st.booleans())
def test_any_text_makes_a_document_that_others_read(text: str, unicode: bool) -> None:
    for view, rows in hostile_rows(text).values():
        read(rows, view, unicode=unicode)
