"""What strangers wrote, in every place of every row, through every format: nothing invisible comes out."""

import csv
import re
import sqlite3
import unicodedata
from contextlib import closing

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.exchange import Blocked
from sphero_probe.probing.finding import Confidence, Finding, Heading, Note, Outcome
from sphero_probe.protocol.packets import Command, Generation
from sphero_probe.reports import views
from sphero_probe.reports.matrix import Matrix, column_title
from sphero_probe.reports.registry import FORMATS
from sphero_probe.reports.rows import note_row, robot_row
from sphero_probe.reports.sqlite_file import runs_file
from sphero_probe.runs.decode import Opening
from sphero_probe.transports.base import Seen
from tests.support.reports_by_hand import HOSTILE, hostile_rows, rendered, survey_of

INVISIBLE = {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"}
COLOUR = re.compile(r"\x1b\[[0-9;]*m")


def assert_harmless(shown: str, form: str, *, color: bool) -> None:
    plain = COLOUR.sub("", shown) if color else shown
    plain = plain.replace("\n", "")
    if form == "plain":
        plain = plain.replace("\t", "")
    assert not INVISIBLE.intersection(map(unicodedata.category, plain))


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("color", [False, True], ids=["without colour", "in colour"])
@pytest.mark.parametrize("unicode", [False, True], ids=["ascii", "unicode"])
def test_hostile_text_is_harmless(form: str, color: bool, unicode: bool) -> None:
    for view, rows in hostile_rows(HOSTILE).values():
        shown = rendered(form, rows, view, color=color, unicode=unicode)
        assert_harmless(shown, form, color=color)
        assert unicode or shown.isascii()
        assert "pwn" in shown
        shown.encode("utf-8")


@pytest.mark.unmeasured
@given(st.text(st.characters(), max_size=30), st.sampled_from(sorted(FORMATS)), st.booleans(), st.booleans())
def test_no_text_gets_anything_invisible_out(text: str, form: str, color: bool, unicode: bool) -> None:
    for view, rows in hostile_rows(text).values():
        shown = rendered(form, rows, view, color=color, unicode=unicode)
        assert_harmless(shown, form, color=color)
        assert unicode or shown.isascii()


@pytest.mark.unmeasured
@given(
    st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=9),
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=9), inner, max_size=3),
        max_leaves=5,
    )
)
def test_any_survey_of_nodes_in_a_journal_is_shown_without_raising(value: object) -> None:
    assert "Nodes\n" in rendered("table", [note_row(Note("nodes", "", survey_of(value)))])
    assert_harmless(
        rendered("table", [note_row(Note("nodes", "", {"system": value, "nodes": [value]}))]),
        "table",
        color=False,
    )


@pytest.mark.unmeasured
@settings(max_examples=15)
@given(st.text(st.characters(), max_size=30) | st.just(HOSTILE))
def test_nothing_invisible_gets_into_an_sqlite_file(
    tmp_path_factory: pytest.TempPathFactory, text: str
) -> None:
    file = tmp_path_factory.getbasetemp() / "runs.db"
    opening = Opening(text, text, "", {}, "", text, Generation.V2, "bolt", text, ("read",))
    records = (
        Heading("bolt", text, text, {text: text, "primary": "1.0"}, text, text, (), {text: text}, text),
        Note(text, text, {text: [text, {text: 1 << 70}]}),
        Finding(
            1,
            Command(0x13, 0x10),
            Outcome.SKIPPED,
            Confidence.CERTAIN,
            Risk.READ,
            Blocked(Command(0x13, 0x10), Risk.READ, text),
            None,
            "",
            0,
            text,
        ),
    )
    with runs_file(file) as exported:
        exported.add(text, opening, records, (text,), complete=True)
    with closing(sqlite3.connect(file)) as database:
        for table in ("runs", "nodes", "findings", "notes"):
            rows = database.execute(f"SELECT * FROM {table}").fetchall()
            assert rows
            for value in (value for row in rows for value in row if isinstance(value, str)):
                assert_harmless(value.replace("\n", "\x00"), "sqlite", color=False)


@pytest.mark.parametrize("form", FORMATS)
def test_a_matrix_of_strangers_is_harmless(form: str) -> None:
    matrix = Matrix()
    for robot in (HOSTILE, f'{HOSTILE},"', "bolt"):
        matrix.add(
            column_title(robot, {HOSTILE: HOSTILE}),
            [{"did": 0x13, "cid": 0x10, "state": HOSTILE, "name": HOSTILE}],
        )
    shown = rendered(form, matrix.rows(), matrix.view)
    assert_harmless(shown, form, color=False)
    assert "pwn" in shown
    if form == "csv":
        assert len({len(row) for row in csv.reader(shown.splitlines())}) == 1


def test_markup_emoji_and_links_stay_text() -> None:
    text = "[bold]b[/bold] [link=http://x]l[/] :smile: http://example.org 'q' 127.0.0.1"
    shown = rendered("table", [robot_row(Seen(text, None, "AA", 0))], views.ROBOTS, width=200, color=True)
    assert text in shown
    assert "\x1b]8" not in shown
