"""The output boundary: nothing that is not plainly visible passes it, and what it writes can be read back."""

import re
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.reports.printable import LIMIT, csv_cell, visible

INVISIBLE = {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"}
ANY_TEXT = st.text(st.characters(), max_size=300)
"""Every code point, lone surrogates too."""
NASTY = st.text(
    st.sampled_from(
        "\\\\xunUtrN0123abef "
        "\x1b\x07\x7f\x85\x9b\n\r\t\0"
        "\u200b\u200f\u202e\u2028\ud800\udfff\ue000\u0301\ufe0f\U000e0041é漢"
    ),
    max_size=40,
)


def read_back(shown: str) -> str:
    """What a person who knows the spellings reads."""
    spelling = re.compile(r"\\(\\|t|n|r|x[0-9a-f]{2}|u[0-9a-f]{4}|U[0-9a-f]{8})")
    short = {"\\": "\\", "t": "\t", "n": "\n", "r": "\r"}
    return spelling.sub(lambda found: short.get(found[1]) or chr(int(found[1][1:], 16)), shown)


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        pytest.param("BP-1234", "BP-1234", id="plain"),
        pytest.param("Zoé 漢字 😀", "Zoé 漢字 😀", id="letters of all scripts"),
        pytest.param("\x1b[31m", r"\x1b[31m", id="escape sequence"),
        pytest.param("a\tb\nc\rd", r"a\tb\nc\rd", id="tab and line ends"),
        pytest.param("\x00\x7f\x9b", r"\x00\x7f\x9b", id="nul, delete, C1"),
        pytest.param("\u202egpj", r"\u202egpj", id="bidi override"),
        pytest.param("a\u200bb\u2060c\ufeff", r"a\u200bb\u2060c\ufeff", id="zero width"),
        pytest.param("\U000e0041\U000e007f", r"\U000e0041\U000e007f", id="tags"),
        pytest.param(
            "\u2028\u2029\xa0\u3000", r"\u2028\u2029\xa0\u3000", id="separators other than the blank"
        ),
        pytest.param("\ud800", r"\ud800", id="lone surrogate"),
        pytest.param("\ue000\U0010ffff\u0378", r"\ue000\U0010ffff\u0378", id="private, unassigned"),
        pytest.param(
            "\u3164\u2800\u034f\ufe0f\U000e0100", r"\u3164\u2800\u034f\ufe0f\U000e0100", id="blank letters"
        ),
        pytest.param("e\u0301", "e\u0301", id="one accent"),
        pytest.param("e" + "\u0301" * 4, "e\u0301\u0301\\u0301\\u0301", id="a tower of accents"),
        pytest.param("C:\\plans\\a.py", "C:\\plans\\a.py", id="harmless backslashes"),
        pytest.param("\\x1b", "\\\\x1b", id="a backslash that reads like a spelling"),
        pytest.param("\\\x1b", "\\\\\\x1b", id="a backslash before a spelling"),
        pytest.param("end\\", "end\\", id="a last backslash"),
        pytest.param("", "", id="empty"),
    ],
)
def test_spells_out(text: str, shown: str) -> None:
    assert visible(text) == shown


def test_ascii_only_spells_out_everything_else() -> None:
    assert visible("Zoé 漢", unicode=False) == r"Zo\xe9 \u6f22"
    assert visible("x" * 300, unicode=False).endswith("x...")


@pytest.mark.parametrize("limit", [1, 2, 5, 12, LIMIT])
def test_long_text_ends_in_an_ellipsis_within_the_limit(limit: int) -> None:
    assert visible("x" * 1000, limit=limit) == "x" * (limit - 1) + "…"
    assert visible("x" * limit, limit=limit) == "x" * limit


def test_no_spelling_is_cut() -> None:
    for limit in range(1, 20):
        assert re.fullmatch(r"(\\x1b)*…", visible("\x1b" * 99, limit=limit))


def test_without_limit_nothing_is_cut() -> None:
    assert visible("x" * 5000, limit=None) == "x" * 5000
    assert visible("\n" * 5000, limit=None) == r"\n" * 5000


@given(ANY_TEXT | NASTY, st.none() | st.integers(1, 300), st.booleans())
def test_nothing_invisible_comes_out(text: str, limit: int | None, unicode: bool) -> None:
    shown = visible(text, limit=limit, unicode=unicode)
    assert not INVISIBLE.intersection(map(unicodedata.category, shown))
    assert shown.isprintable()
    assert unicode or shown.isascii()
    assert limit is None or len(shown) <= limit
    assert len(shown.splitlines()) <= 1


@given(NASTY | ANY_TEXT)
def test_reads_back_in_one_way(text: str) -> None:
    assert read_back(visible(text, limit=None)) == text
    assert read_back(visible(text, limit=None, unicode=False)) == text


@pytest.mark.parametrize(
    ("text", "cell"),
    [
        pytest.param("=1+1", "'=1+1", id="formula"),
        pytest.param("+cmd|'/c calc'!A0", "'+cmd|'/c calc'!A0", id="plus"),
        pytest.param("-2+3", "'-2+3", id="minus"),
        pytest.param("@SUM(A1)", "'@SUM(A1)", id="at"),
        pytest.param("\t=1", "'\\t=1", id="tab"),
        pytest.param("\r\n=1", "'\\r\\n=1", id="line end"),
        pytest.param("  =1", "'  =1", id="blanks first"),
        pytest.param("\uff1d1", "'\uff1d1", id="full-width equals sign"),
        pytest.param("-61", "-61", id="negative number"),
        pytest.param("+1.5e-3", "+1.5e-3", id="number with exponent"),
        pytest.param("-1\n", "'-1\\n", id="number with a line end"),
        pytest.param("BP-1234", "BP-1234", id="inner minus"),
        pytest.param("a\x1b", "a\\x1b", id="escape"),
        pytest.param("", "", id="empty"),
    ],
)
def test_csv_cell(text: str, cell: str) -> None:
    assert csv_cell(text) == cell


def test_csv_cell_is_never_cut() -> None:
    assert csv_cell("x" * 5000) == "x" * 5000


@given(NASTY | ANY_TEXT | st.text(st.sampled_from("=+-@\t 1.eE"), max_size=8))
def test_csv_cell_is_no_formula_and_visible(text: str) -> None:
    cell = csv_cell(text)
    assert cell.isprintable()
    assert cell[:1] not in {"=", "@", "\t"}
    if cell[:1] in {"+", "-"}:
        assert isinstance(float(cell), float)
