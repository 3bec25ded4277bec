"""What strangers wrote, in every place of every row, through every format: nothing invisible comes out."""

import re
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.probing.finding import Note
from sphero_probe.reports import views
from sphero_probe.reports.registry import FORMATS
from sphero_probe.reports.rows import note_row, robot_row
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


def test_markup_emoji_and_links_stay_text() -> None:
    text = "[bold]b[/bold] [link=http://x]l[/] :smile: http://example.org 'q' 127.0.0.1"
    shown = rendered("table", [robot_row(Seen(text, None, "AA", 0))], views.ROBOTS, width=200, color=True)
    assert text in shown
    assert "\x1b]8" not in shown
