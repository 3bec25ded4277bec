"""Markdown pages, read by markdown-it-py, a parser that follows CommonMark and knows the tables of GitHub."""

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from markdown_it import MarkdownIt
from markdown_it.token import Token

from sphero_probe.catalogue import commands_of
from sphero_probe.catalogue.risk import Risk
from sphero_probe.probing.finding import Note
from sphero_probe.probing.notes import EXECUTED
from sphero_probe.reports import views
from sphero_probe.reports.markdown_text import code, safe
from sphero_probe.reports.rows import command_row, finding_row, note_row
from tests.support.html_reader import Page
from tests.support.reports_by_hand import (
    ASKED,
    BOLT,
    HOSTILE,
    LISTS,
    RUN,
    answered,
    expanded,
    hostile_rows,
    refused,
    rendered,
    run_of,
)

PARSER = MarkdownIt("commonmark").enable("table")
MARKUP = (
    "| `a` ``b`` \\| \\` <script>x</script> <!-- --> [l](http://x) ![i](//x) **b** _i_ ~~s~~ # h @you #12 "
    "www.x.org a@b.org &lt; $x$ :smile: \\"
)
"""Text that would become markup, also that of GitHub."""
INLINE = frozenset(("text", "code_inline", "strong_open", "strong_close", "html_inline"))
FOREIGN = frozenset(("html_block", "fence", "code_block", "hr", "blockquote_open", "ordered_list_open"))
CODE = {"<code>": True, "</code>": False}


def tokens(markdown: str) -> list[Token]:
    return PARSER.parse(markdown)


def inlines(markdown: str) -> list[Token]:
    return [child for token in tokens(markdown) for child in token.children or ()]


def assert_plain(markdown: str) -> None:
    """Check that a page has only the markup that the tool writes."""
    for token in tokens(markdown):
        assert token.type not in (
            "html_block",
            "fence",
            "code_block",
            "hr",
            "blockquote_open",
            "ordered_list_open",
        )
    in_code = False
    for token in inlines(markdown):
        assert token.type in INLINE, token
        if token.type == "html_inline":
            in_code = CODE[token.content]
        elif token.type == "text" and not in_code:
            assert not re.search(r"@|#\d|www\.|://|:[a-z_]+:|\$", token.content), token.content


def table_shapes(markdown: str) -> list[list[int]]:
    """The number of cells in each row of each table."""
    tables: list[list[int]] = []
    for token in tokens(markdown):
        if token.type == "table_open":
            tables.append([])
        elif token.type == "tr_open":
            tables[-1].append(0)
        elif token.type in ("td_open", "th_open"):
            tables[-1][-1] += 1
    return tables


def shown(markdown: str) -> str:
    """The text that a reader sees."""
    return Page(f"<main>{PARSER.render(markdown)}</main>").text


@pytest.mark.parametrize("text", [HOSTILE, MARKUP, "`", "|", "\\", "``|", "a|b", "www.a.b", "1. x", "x @y"])
def test_untrusted_text_is_plain(text: str) -> None:
    for view, rows in hostile_rows(text).values():
        page = rendered("md", rows, view)
        assert_plain(page)
        for table in table_shapes(page):
            assert len(set(table)) == 1


@pytest.mark.unmeasured
@given(st.text(st.characters(), max_size=30))
@settings(max_examples=25)
def test_no_text_becomes_markup(text: str) -> None:
    view, rows = hostile_rows(text)["run"]
    assert_plain(rendered("md", rows, view))
    assert_plain(rendered("md", rows, views.PROTOCOL))


@pytest.mark.unmeasured
@given(st.text(st.sampled_from("`|\\ a<&_*1.:@#[]!~$"), min_size=1, max_size=12))
def test_text_is_read_as_it_was_written(text: str) -> None:
    for written in (safe(text), code(text)):
        (cell,) = (one for one in Page(PARSER.render(f"| x |\n| --- |\n| {written} |\n")).all("td"))
        assert cell.text.split() == safe_words(text)


def safe_words(text: str) -> list[str]:
    r"""The words that are shown: a backslash that could start an escape is doubled, as everywhere."""
    return re.sub(r"\\(?=[\\tnrxuU])", r"\\\\", text).split()


@pytest.mark.parametrize(
    "text",
    [
        "success: voltage 4.11 V",
        "Started 2026-11-26T00:01:12Z, sphero-probe 0.1.0",
        "2 \u00d7 persist: unknown, next to power.prepare_for_shutdown (--allow persist)",
        "0x13:0x10 power.get_battery_percentage",
    ],
)
def test_plain_words_stay_as_they_are(text: str) -> None:
    assert safe(text) == text
    assert shown(text).strip() == text


def test_a_run_is_a_page_for_an_issue() -> None:
    executed = note_row(Note(EXECUTED, "0x13:0x99 accepted 11 zero bytes", {"target": 0x11}))
    many = [refused(100 + cid, 0x20, cid, Risk.PERSIST, "persist: unknown") for cid in range(200)]
    page = rendered("md", run_of([*ASKED, *many], [executed], complete=False))
    assert_plain(page)
    lines = page.splitlines()
    assert (
        lines[0] == "# Commands of Sphero BOLT `SB-1B2C`" or lines[0] == "# Commands of Sphero BOLT SB-1B2C"
    )
    assert "**Executed:** 0x13:0x99 accepted 11 zero bytes" in lines
    assert "| `0x13:0x10` | `get_battery_percentage` | exists: percentage 87 % | 31.2 |" in page
    assert expanded(page) >= {(one.command.did, one.command.cid) for one in ASKED if one.outcome != "absent"}
    assert "`0x20:0x00-0xc7`" in page
    assert any(line.startswith("- Incomplete:") for line in lines)


@pytest.mark.parametrize("name", LISTS)
def test_lists_are_tables(name: str) -> None:
    view, rows = LISTS[name]
    page = rendered("md", rows, view)
    shapes = table_shapes(page)
    shown_rows = sum(row.type == view.type for row in rows)
    if view.upright:
        assert len(shapes) == shown_rows
    else:
        assert sum(len(shape) - 1 for shape in shapes) == shown_rows


def test_the_catalogue_is_a_reference_of_all_commands() -> None:
    rows = commands_of(BOLT)
    page = rendered("md", map(command_row, rows), views.COMMANDS)
    assert_plain(page)
    assert page.count("\n## ") == len({row.did for row in rows})
    assert sum(len(shape) - 1 for shape in table_shapes(page)) == len(rows)
    for row in rows:
        assert f"| `0x{row.did:02x}:0x{row.cid:02x}` | `{row.name}` | " in page


def test_the_protocol_says_what_is_known_and_what_is_not() -> None:
    page = rendered("md", [*RUN[:-1], finding_row(answered(9, 0x13, 0x99, 0x05)), RUN[-1]], views.PROTOCOL)
    assert_plain(page)
    sections = dict(re.findall(r"^### (\S+) .*\n\n((?:- .*\n)+)", page, re.MULTILINE))
    known = sections["0x13:0x10"]
    for line in (
        "- Node: primary (0x11)",
        "- Evidence: exists: code 0x00 success after 31.2 ms on firmware 5.0.2",
        "- Risk: read",
        "- Request: nothing",
        "- Response: `percentage:u8[%]`",
        f"- Sent: `{ASKED[0].exchange.sent.hex(' ')}`",  # type: ignore[union-attr]
        f"- Received: `{ASKED[0].exchange.received.hex(' ')}`",  # type: ignore[union-attr]
        "- Decoded: percentage 87 %",
        "- Sources: none for this robot; the name is that of the same command on other robots",
    ):
        assert line in known
    unknown = sections["0x13:0x99"]
    for line in (
        "- Risk: unknown, asked as probe",
        "- Request: unknown",
        "- Response: unknown",
        "- Sources: none",
    ):
        assert line in unknown
    assert "- Evidence: silent: no answer, asked 3 times on firmware 5.0.2" in sections["0x13:0x97"]
    assert "- Evidence: documented, not confirmed: it was blocked" in sections["0x13:0x00"]
    assert "- Evidence: documented, not asked" in sections["0x13:0x04"] if "0x13:0x04" in sections else True
    assert "## What is not known" in page
    assert "name and layout unknown: `0x13:0x99" in page
