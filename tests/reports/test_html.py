"""HTML pages: safe whatever a robot says, readable without script or colour, and true to the findings."""

import base64
import hashlib
import re
from collections import Counter
from collections.abc import Iterable
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sphero_probe.catalogue.risk import Risk
from sphero_probe.probing.finding import Finding, Note
from sphero_probe.probing.notes import EXECUTED
from sphero_probe.reports import views
from sphero_probe.reports.cell_states import STATES, CellState, node_maps
from sphero_probe.reports.finding_line import line_of
from sphero_probe.reports.html.maps import KEYS
from sphero_probe.reports.rows import finding_row, note_row
from tests.support.html_reader import Page, assert_safe
from tests.support.reports_by_hand import (
    ASKED,
    BOLT,
    HOSTILE,
    LISTS,
    RUN,
    SECONDARY,
    answered,
    hostile_rows,
    refused,
    rendered,
    run_of,
    silent,
)

MARKUP = (
    """<script>alert(1)</script><img src=x onerror=alert(1)>"'><a href=//x>&amp;</td></table>--> ]]> {{x}}"""
)
"""Text that would become elements, attributes, links, comments or templates."""
MAP = [
    *(answered(1 + cid, 0x13, cid, 0x02) for cid in range(256) if cid not in (0x10, 0x9A, 0x12, 0x13, 0x97)),
    answered(300, 0x13, 0x10, 0x00, b"\x57"),
    answered(301, 0x13, 0x9A, 0x00, b"\x01"),
    refused(302, 0x13, 0x12, Risk.PERSIST, "persist: unknown (--allow persist)"),
    answered(303, 0x13, 0x13, 0x05, masked=True),
    silent(304, 0x13, 0x97),
    answered(305, 0x18, 0x02, 0x02, target=SECONDARY),
    answered(306, 0x18, 0x0F, 0x00, target=SECONDARY),
]


def page_of(findings: Iterable[Finding]) -> Page:
    return Page(rendered("html", run_of(list(findings))))


def shape(page: Page) -> list[str]:
    """The elements with the names of their attributes, without the places where a name may be broken."""
    return [one for one in page.shape if one != "wbr "]


HARMLESS = shape(Page(rendered("html", hostile_rows("a" * 40)["run"][1])))


def test_a_page_is_safe_and_allows_only_its_own_script_and_style() -> None:
    page = Page(rendered("html", RUN))
    assert_safe(page)
    (policy,) = [
        one.attributes["content"]
        for one in page.all("meta")
        if one.attributes.get("http-equiv") == "Content-Security-Policy"
    ]

    def source(tag: str) -> str:
        digest = hashlib.sha256(page.one(tag).text.encode()).digest()
        return f"'sha256-{base64.b64encode(digest).decode()}'"

    assert policy.split("; ") == [
        "default-src 'none'",
        f"style-src {source('style')}",
        f"script-src {source('script')}",
        "base-uri 'none'",
        "form-action 'none'",
    ]


@pytest.mark.parametrize(
    "text", [HOSTILE, MARKUP, HOSTILE + MARKUP, "http://example.org javascript:alert(1)"]
)
def test_untrusted_text_changes_no_element(text: str) -> None:
    harmless = hostile_rows("a" * 40)
    for name, (view, rows) in hostile_rows(text).items():
        page = Page(rendered("html", rows, view))
        assert_safe(page)
        assert shape(page) == shape(Page(rendered("html", harmless[name][1], view))), name


@pytest.mark.unmeasured
@given(st.text(st.characters(exclude_characters="\0"), min_size=1, max_size=40))
@settings(max_examples=25)
def test_no_text_changes_an_element(text: str) -> None:
    view, rows = hostile_rows(f"a{text}")["run"]
    page = Page(rendered("html", rows, view))
    assert_safe(page)
    assert shape(page) == HARMLESS


def test_text_is_read_as_it_was_written() -> None:
    assert MARKUP in Page(rendered("html", [note_row(Note("run", MARKUP, {}))])).text


@pytest.mark.parametrize("name", LISTS)
def test_lists_are_pages_too(name: str) -> None:
    view, rows = LISTS[name]
    page = Page(rendered("html", rows, view))
    assert_safe(page)
    shown = sum(row.type == view.type for row in rows)
    assert len(page.all("tr")) == shown + 1 or len(page.all("dl")) == shown


def test_a_list_without_rows_says_so() -> None:
    assert "No robots found." in Page(rendered("html", [], views.ROBOTS)).text


def test_a_map_shows_each_command_in_its_state() -> None:
    page = page_of(MAP)
    assert_safe(page)
    by_map = [
        one for one in page.all("td") if one.classes & set(KEYS.values()) and not one.attributes.get("data-s")
    ]
    cells = by_map[:256]
    assert len(cells) == 256
    signs = {state.sign: state for state in STATES}
    assert [KEYS[signs[cell.text]] for cell in cells] == [cell.attributes["class"] for cell in cells]
    expected = {
        0x10: CellState.EXISTS,
        0x9A: CellState.NEW,
        0x12: CellState.BLOCKED,
        0x13: CellState.INCONCLUSIVE,
        0x97: CellState.SILENT,
        0x50: CellState.ABSENT,
        0x1B: CellState.MISSING,  # power.enable_battery_voltage_state_change_notify of BOLT
    }
    assert {cid: signs[cells[cid].text] for cid in expected} == expected


def test_signs_and_keys_are_different() -> None:
    assert len({state.sign for state in STATES}) == len(set(KEYS.values())) == len(STATES) == len(KEYS)


def test_documented_commands_that_were_not_asked_are_on_the_map() -> None:
    (node,) = node_maps([line_of(finding_row(ASKED[0]).data, BOLT)], BOLT)
    assert node.state(0x13, 0x10) is CellState.EXISTS
    assert node.state(0x13, 0x04) is CellState.NOT_ASKED
    assert node.state(0x11, 0x01) is CellState.DOCUMENTED


def test_the_overview_shows_the_same_as_the_maps() -> None:
    """The paths are painted by a second reader, a rectangle at a time."""
    painted: dict[tuple[int, int], str] = {}
    page = page_of(MAP)
    first = next(at for at, one in enumerate(page.elements) if one.tag == "svg")
    for path in (one for one in page.elements[:first] if one.tag == "path"):
        for x, y, width, back in re.findall(r"M(\d+) (\d+)h(\d+)v1h-(\d+)z", path.attributes["d"]):
            assert width == back
            for cid in range(int(x), int(x) + int(width)):
                assert (int(y), cid) not in painted
                painted[int(y), cid] = path.attributes["class"]
    lines = [line_of(finding_row(finding).data, BOLT) for finding in MAP]
    node = node_maps(lines, BOLT)[0]
    for did in range(256):
        for cid in range(256):
            state = node.state(did, cid)
            wanted = None if state is CellState.NOT_ASKED else KEYS[state]
            assert painted.get((did, cid)) == wanted


def test_each_finding_of_interest_can_be_reached_from_its_cell() -> None:
    page = page_of(MAP)
    links = {one.attributes["href"] for one in page.all("a")}
    for ids in ("11-13-10", "11-13-9a", "11-13-12", "11-13-97", "11-13-1b"):
        assert f"#f-{ids}" in links
    rows = {one.attributes.get("id"): one for one in page.all("tr")}
    row = rows["f-11-13-10"]
    assert row.attributes["data-s"] == "e"
    for text in ("0x13:0x10", "power.get_battery_percentage", "success: percentage 87 %", "31.2", "8d "):
        assert text in row.text


def test_findings_that_are_alike_share_a_row() -> None:
    many = [refused(1 + cid, 0x20, cid, Risk.PERSIST, "persist: unknown") for cid in range(200)]
    page = page_of([*ASKED, *many, answered(500, 0x20, 0xFF, 0x02)])
    assert_safe(page)
    (row,) = [one for one in page.all("tr") if "0x20:0x00-0xc7" in one.text]
    assert "200" in row.text
    assert sum(one.attributes["href"] == f"#{row.attributes['id']}" for one in page.all("a")) == 200


def test_the_summary_counts_every_command() -> None:
    page = page_of(MAP)
    rows = [re.fullmatch(r"(.)(\D+)(\d+)", row.text) for row in page.all("tr")]
    words = {match[2]: int(match[3]) for match in rows if match}
    counts = Counter({state: words[state.word] for state in STATES})
    assert counts.total() == 2 * 65_536
    assert counts[CellState.EXISTS] == 2
    assert counts[CellState.SILENT] == 1


def test_trouble_is_said_first() -> None:
    executed = note_row(Note(EXECUTED, "0x13:0x99 was executed", {"target": 0x11}))
    page = Page(rendered("html", run_of(ASKED, [executed], complete=False)))
    first, second = page.all("p", "alert")
    assert "0x13:0x99 was executed" in first.text
    assert "Incomplete" in second.text


def test_a_page_can_be_used_without_a_mouse_and_without_seeing_it() -> None:
    page = page_of(MAP)
    assert "lang" in page.one("html").attributes
    assert page.all("a")[0].classes == {"skip"}
    for landmark in ("header", "nav", "main", "h1"):
        page.one(landmark)
    assert page.one("nav").attributes["aria-label"]
    for section in page.all("section"):
        assert section.attributes["aria-labelledby"]
    assert len(page.all("caption")) == len(page.all("table"))
    for head in page.all("th"):
        assert head.attributes["scope"] in ("col", "row")
    for label in page.all("label"):
        assert label.text.strip()
    for svg in page.all("svg"):
        assert svg.attributes["aria-hidden"] == "true"
    levels = [int(one.split()[0][1:]) for one in page.shape if re.match(r"h[1-4] ?", one)]
    assert all(after <= before + 1 for before, after in pairwise(levels))


def colours(style: str, *, dark: bool) -> dict[str, str]:
    """The variables of a colour scheme; dark ones override light ones."""
    light_text, dark_text = style.split("@media screen and (prefers-color-scheme: dark)")
    found = dict(re.findall(r"--([a-z-]+): (#[0-9a-f]{6})", light_text))
    if dark:
        found |= dict(re.findall(r"--([a-z-]+): (#[0-9a-f]{6})", dark_text))
    return found


def luminance(colour: str) -> float:
    """Relative luminance by WCAG 2.2."""
    channels = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    red, green, blue = (one / 12.92 if one <= 0.04045 else ((one + 0.055) / 1.055) ** 2.4 for one in channels)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(one: str, other: str) -> float:
    """Contrast ratio by WCAG 2.2: from 1 to 21."""
    high, low = sorted((luminance(one), luminance(other)), reverse=True)
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_text_has_contrast(dark: bool) -> None:
    assert contrast("#000000", "#ffffff") == pytest.approx(21)
    held = colours(Page(rendered("html", RUN)).one("style").text, dark=dark)
    pairs = [(f"{key}-sign", key) for key in KEYS.values()]
    pairs += [(text, ground) for text in ("text", "quiet", "link") for ground in ("page", "card")]
    pairs.append(("alert-text", "alert"))
    for text, ground in pairs:
        assert contrast(held[text], held[ground]) >= 4.5, (text, ground)
    assert contrast(held["focus"], held["page"]) >= 3


def test_a_page_prints_and_fits_both_schemes() -> None:
    style = Page(rendered("html", RUN)).one("style").text
    for part in ("@media print", "prefers-color-scheme: dark", ":focus-visible", "max-width"):
        assert part in style
