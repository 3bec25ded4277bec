"""Values in words: what people read of fields, answers, layouts, whatever a row holds."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.reports import address_phrases, phrases, views
from sphero_probe.reports.registry import FORMATS
from sphero_probe.reports.rows import Row
from tests.support.reports_by_hand import rendered

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
    max_leaves=6,
)
KEYS = sorted(
    {
        column.key
        for view in (views.FINDINGS, views.PACKETS, views.NOTES, views.COMMANDS)
        for column in view.columns
    }
    | {
        "counts",
        "seconds",
        "complete",
        "firmware",
        "strictness",
        "consent",
        "value",
        "unit",
        "robot",
        "device",
    }
)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        pytest.param(
            {"fields": {"percentage": 87}, "units": {"percentage": "%"}}, "percentage 87 %", id="unit"
        ),
        pytest.param({"fields": {"a": 1, "b": True}}, "a 1, b yes", id="several"),
        pytest.param({"fields": {"voltage": 3.700000047683716}}, "voltage 3.7", id="float"),
        pytest.param({"fields": {"counts": [1, -2]}}, "counts 1 -2", id="list"),
        pytest.param({"fields": {"flags": []}}, "flags none", id="empty list"),
        pytest.param({"fields": {"dids": [16, 17, 18, 24]}}, "dids 0x10-0x12 0x18", id="rising ids"),
        pytest.param({"fields": {"cids": [3, 1, 1]}}, "cids 0x03 0x01 0x01", id="ids in another order"),
        pytest.param({"fields": {"did": 19}}, "did 0x13", id="one id"),
        pytest.param({"fields": {"name": "Rob 1, my"}}, 'name "Rob 1, my"', id="text with blanks"),
        pytest.param({"fields": {"name": ""}}, 'name ""', id="empty text"),
        pytest.param(
            {"fields": {"data": "5370"}, "payload": "005370"}, "data 53 70", id="bytes of the payload"
        ),
        pytest.param(
            {"fields": {"sku": "5370"}, "payload": "35333730"}, "sku 5370", id="text that looks like bytes"
        ),
        pytest.param({"fields": {"sku": "37"}, "payload": "0370"}, "sku 37", id="not at a byte's border"),
        pytest.param({"fields": {}}, "", id="no fields"),
        pytest.param({"fields": None}, "", id="no answer"),
    ],
)
def test_fields(data: dict[str, Any], words: str) -> None:
    assert phrases.fields(data) == words


@pytest.mark.parametrize(
    ("data", "words"),
    [
        pytest.param({"code": 5, "code_name": "bad data length"}, "bad data length", id="name only"),
        pytest.param(
            {"code": 6, "code_name": "command failed", "payload": "0102"},
            "command failed: 01 02",
            id="payload",
        ),
        pytest.param(
            {"code": 0x42, "code_name": "unlisted", "payload": "01"}, "0x42 unlisted: 01", id="unlisted"
        ),
        pytest.param({"code": 0x42, "code_name": ""}, "0x42", id="no name"),
        pytest.param({"code": None, "attempts": 3}, "no answer, asked 3 times", id="silent"),
        pytest.param({"code": None, "attempts": 1}, "no answer", id="silent at once"),
    ],
)
def test_how_asking_ended(data: dict[str, Any], words: str) -> None:
    assert phrases.outcome(data) == words


@pytest.mark.parametrize(
    ("data", "words"),
    [
        pytest.param({"request": "", "response": "a:u8{Names}[%]"}, "nothing -> a:u8[%]", id="both"),
        pytest.param({"request": None, "response": "a:u8"}, "unknown -> a:u8", id="one unknown"),
        pytest.param({"request": None, "response": None}, "unknown", id="both unknown"),
        pytest.param(
            {"kind": "notification", "request": None, "response": "a:u8"}, "-> a:u8", id="notification"
        ),
    ],
)
def test_layouts(data: dict[str, str | None], words: str) -> None:
    assert phrases.exchanged(data) == words


@pytest.mark.parametrize(
    ("data", "words"),
    [
        pytest.param({"source": 0x12, "target": 0x01}, "0x12 to 0x01", id="both"),
        pytest.param({"source": 0x12}, "from 0x12", id="source"),
        pytest.param({"target": 0x12}, "to 0x12", id="target"),
        pytest.param({}, "", id="none"),
    ],
)
def test_addresses(data: dict[str, int], words: str) -> None:
    assert address_phrases.addresses(data) == words


def test_robots() -> None:
    assert phrases.robots({"bolt": [1, 2], "mini": [1], "bb9e": []}) == "bolt:1,2 mini:1 bb9e"


@pytest.mark.unmeasured
@given(
    st.lists(
        st.tuples(
            st.sampled_from(["run", "finding", "note", "summary", "packet", "command", "planned", "fact"]),
            st.dictionaries(st.sampled_from(KEYS), JSON, max_size=12),
            st.sampled_from(["exists", "absent", "silent", "skipped", "inconclusive", "?"]),
        ),
        max_size=8,
    ),
    st.sampled_from(sorted(FORMATS)),
)
def test_rows_of_an_untrusted_file_are_shown_whatever_they_hold(
    made: list[tuple[str, dict[str, Any], str]], form: str
) -> None:
    rows = [Row(type_, data | {"outcome": outcome}) for type_, data, outcome in made]
    for view in (
        views.FINDINGS,
        views.PROTOCOL,
        views.FINDING,
        views.PACKETS,
        views.NOTES,
        views.COMMANDS,
        views.PLANNED,
        views.FACTS,
    ):
        assert isinstance(rendered(form, rows, view), str)
