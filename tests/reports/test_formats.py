"""Every format over the same rows: what it writes, to the byte where scripts rely on it."""

import csv
import io
import json
import re
import subprocess
import sys
from typing import Any

import pytest

from sphero_probe.errors import UsageError
from sphero_probe.probing.facts import Fact
from sphero_probe.reports import views
from sphero_probe.reports.registry import FORMATS, PAGES, Style, open_report
from sphero_probe.reports.rows import (
    fact_row,
    finding_row,
    heading_row,
    robot_row,
)
from sphero_probe.transports.base import Seen
from tests.support.reports_by_hand import (
    ASKED,
    BOLT,
    FINDING_KEYS,
    HEADING,
    HOSTILE,
    LISTS,
    RUN,
    answered,
    rendered,
)

TABULAR = ("table", "plain", "csv")


@pytest.mark.parametrize("form", FORMATS)
def test_every_row_is_told_in_every_format(form: str) -> None:
    shown = rendered(form, RUN, width=120, detail=True)
    for pair in ((0x13, 0x10), (0x13, 0x99), (0x13, 0x97), (0x13, 0x00), (0x13, 0x25), (0x10, 0x00)):
        if "json" in form:
            assert any(
                row.get("did") == pair[0] and row.get("cid") == pair[1] for row in objects(form, shown)
            )
        elif form in PAGES:
            assert f"0x{pair[0]:02x}:0x{pair[1]:02x}" in shown
        else:
            assert any(
                {f"0x{pair[0]:02x}", f"0x{pair[1]:02x}"} <= set(re.split("[\t,]", line))
                for line in shown.splitlines()
            )


def objects(form: str, shown: str) -> list[dict[str, Any]]:
    if form == "json":
        held: list[dict[str, Any]] = json.loads(shown)
        return held
    return [json.loads(line) for line in shown.splitlines()]


@pytest.mark.parametrize("form", ["json", "jsonl"])
def test_json_formats_hold_the_rows_as_they_are(form: str) -> None:
    held = objects(form, rendered(form, RUN))
    assert list(held[0])[:2] == ["type", "schema_version"]
    assert held[0].pop("schema_version") == 2
    assert held == [{"type": row.type, **row.data} for row in RUN]
    assert [list(one) for one in held] == [["type", *row.data] for row in RUN]


def test_both_json_formats_hold_the_same_objects() -> None:
    assert objects("json", rendered("json", RUN)) == objects("jsonl", rendered("jsonl", RUN))


@pytest.mark.parametrize("form", ["json", "jsonl"])
def test_json_keeps_hostile_text_whole(form: str) -> None:
    seen = Seen(HOSTILE + "\x7f", None, "AA", 0)
    shown = rendered(form, [robot_row(seen)], views.ROBOTS)
    assert shown.isascii()
    assert "\x7f" not in shown
    assert objects(form, shown)[0]["name"] == HOSTILE + "\x7f"


@pytest.mark.parametrize("form", ["json", "jsonl"])
def test_numbers_that_json_does_not_know_are_texts(form: str) -> None:
    rows = [
        fact_row(Fact("a", float("nan"))),
        fact_row(Fact("b", [float("inf"), 1.5])),
        fact_row(Fact("c", {"d": float("-inf")})),
    ]
    held = objects(form, rendered(form, rows, views.FACTS))
    assert [one["value"] for one in held] == ["nan", ["inf", 1.5], {"d": "-inf"}]


def test_jsonl_is_written_as_it_comes() -> None:
    out = io.StringIO()
    report = open_report("jsonl", out, view=views.FINDINGS, style=Style())
    for number, row in enumerate(RUN, 1):
        report.add(row)
        assert out.getvalue().count("\n") == number
    before = out.getvalue()
    report.close()
    assert out.getvalue() == before


@pytest.mark.parametrize(
    ("form", "expected"),
    [
        pytest.param("json", "[]\n", id="json"),
        pytest.param("jsonl", "", id="jsonl"),
        pytest.param("plain", "", id="plain"),
        pytest.param("csv", "name,model,generation,address,rssi\n", id="csv"),
        pytest.param("table", "No robots found.\n", id="table"),
        pytest.param("md", "No robots found.\n\n", id="md"),
    ],
)
def test_no_rows_at_all(form: str, expected: str) -> None:
    assert rendered(form, [], views.ROBOTS) == expected


def test_plain_is_one_record_a_line() -> None:
    lines = rendered("plain", RUN).split("\n")
    assert lines.pop() == ""
    assert len(lines) == len(ASKED)
    assert lines[0].split("\t") == [
        "1",
        "0x11",
        "0x11",
        "0x13",
        "0x10",
        "power.get_battery_percentage",
        "probe",
        "exists",
        "certain",
        "0x00",
        "success",
        "57",
        "percentage 87 %",
        "8d 3a 11 01 13 10 01 00 00 00 00 00 00 00 00 00 00 00 8f d8",
        "8d 29 11 13 10 01 00 57 4a d8",
        "31.2",
        "1",
        "",
        "exists",
        "00 00 00 00 00 00 00 00 00 00 00",
        "",
    ]
    assert {line.count("\t") for line in lines} == {len(views.FINDINGS.record_columns) - 1}


def test_plain_has_a_header_if_it_is_asked_for() -> None:
    head, *lines = rendered("plain", RUN, header=True).splitlines()
    assert head.split("\t") == rendered("csv", RUN).splitlines()[0].split(",")
    assert lines == rendered("plain", RUN).splitlines()


def test_plain_is_never_cut() -> None:
    long = bytes(range(256)) * 4
    (line,) = rendered("plain", [finding_row(answered(1, 0x13, 0x99, 0, long))]).splitlines()
    assert long.hex(" ") in line


def test_csv_is_a_table_with_a_header() -> None:
    head, *records = csv.reader(io.StringIO(rendered("csv", RUN), newline=""))
    assert head == [key for key in FINDING_KEYS if key != "units"]
    assert len(records) == len(ASKED)
    assert dict(zip(head, records[0], strict=True))["payload"] == "57"
    assert dict(zip(head, records[4], strict=True))["note"] == "brick: power.enter_deep_sleep (--allow brick)"


def test_csv_holds_no_formula_and_ends_lines_with_lf() -> None:
    shown = rendered("csv", [robot_row(Seen('=HYPERLINK("x")', None, "@A,B", -61))], views.ROBOTS)
    assert shown == 'name,model,generation,address,rssi\n"\'=HYPERLINK(""x"")",,,"\'@A,B",-61\n'


@pytest.mark.parametrize("form", ["plain", "csv"])
@pytest.mark.parametrize("name", LISTS)
def test_record_columns_are_keys_of_the_rows_in_their_order(name: str, form: str) -> None:
    view, rows = LISTS[name]
    keys = [column.key for column in view.record_columns]
    order = list(dict.fromkeys(key for row in rows if row.type == view.type for key in row.data))
    named = [key for key in keys if key in order]
    assert len(set(keys)) == len(keys)
    if name in ("packets", "notes"):  # their rows differ in keys
        assert set(named) >= set(order) - {"units", "BP-1234 ready"}
    else:
        assert named == keys == sorted(keys, key=order.index)
        assert set(order) - set(keys) <= {"units"}
    assert "BP-1234 ready" in rendered(form, rows, view)


def test_other_rows_are_left_out_of_tabular_formats() -> None:
    for form in TABULAR:
        shown = rendered(
            form, [heading_row(HEADING), robot_row(Seen("SB-1B2C", BOLT, "AA", 0))], views.ROBOTS
        )
        assert "SB-1B2C" in shown
        assert "sweep" not in shown


def test_an_unknown_format_is_a_usage_error() -> None:
    with pytest.raises(UsageError, match="no format 'xml'"):
        rendered("xml", [])


def test_nothing_heavy_is_imported_before_a_table_is_chosen() -> None:
    code = (
        "import io, sys\n"
        "from sphero_probe.reports import rows, views\n"
        "from sphero_probe.reports.registry import Style, open_report\n"
        "for form in ('plain', 'csv', 'json', 'jsonl'):\n"
        "    open_report(form, io.StringIO(), view=views.ROBOTS, style=Style())\n"
        "print(*sorted({'rich', 'asyncio', 'bleak', 'click'} & set(sys.modules)))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []
