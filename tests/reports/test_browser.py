"""The page of a run in headless Chromium: its script searches, and its policy lets no other script run."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from sphero_probe.catalogue.risk import Risk
from sphero_probe.probing.finding import Note
from sphero_probe.reports.rows import Row, note_row
from tests.support.html_reader import Page
from tests.support.reports_by_hand import ASKED, answered, refused, rendered, run_of

pytestmark = pytest.mark.slow

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
ATTACK = '<img src=x onerror="document.title=1"><script>document.title=1</script>'
MANY = [refused(100 + cid, 0x20, cid, Risk.PERSIST, "persist: unknown") for cid in range(200)]
FINDINGS = [*ASKED, *MANY, answered(400, 0x13, 0x03, 0x00, b"\x01\x86")]


@pytest.fixture(scope="module")
def chromium() -> str:
    found = next(filter(None, map(shutil.which, NAMES)), None)
    if found is None:
        pytest.skip("no Chromium is installed here; on Debian: apt-get install chromium")
    return found


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("page") / "map.html"
    path.write_text(rendered("html", rows()), "utf-8")
    return path


def rows() -> list[Row]:
    return run_of(FINDINGS, [note_row(Note("run", ATTACK, {}))])


def opened(chromium: str, file: Path, fragment: str = "") -> Page:
    """Open the page in the browser and return what it is then."""
    flags = ("--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={file.parent / 'profile'}")
    ran = subprocess.run(
        [chromium, *flags, "--dump-dom", file.as_uri() + fragment],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert ran.returncode == 0, ran.stderr
    return Page(re.sub(r"^.*?(?=<!DOCTYPE)", "", ran.stdout, flags=re.DOTALL))


def shown(page: Page) -> list[str]:
    """The rows of results that can be seen: their first id."""
    found = (
        re.search(r"0x\w\w(-0x\w\w)?:0x\w\w", row.text)
        for row in page.all("tr")
        if "data-s" in row.attributes and "hidden" not in row.attributes
    )
    return [match[0] for match in found if match]


def test_the_page_opens_and_shows_everything(chromium: str, file: Path) -> None:
    page = opened(chromium, file)
    assert "hidden" not in page.one("search").attributes
    count = sum("data-s" in row.attributes for row in page.all("tr"))
    assert page.one("output").text == f"{count} of {count} shown"
    assert len(shown(page)) == count
    assert ATTACK in page.text
    assert page.all("title")[0].text == "Commands of Sphero BOLT SB-1B2C"
    assert len(page.all("script")) == 1


@pytest.mark.parametrize(
    ("fragment", "expected"),
    [
        pytest.param("#q=battery%20voltage", ["0x13:0x03", "0x13:0x25"], id="words"),
        pytest.param("#q=0x20:0x55", ["0x20:0x00"], id="within-a-range"),
        pytest.param("#q=13&s=n", ["0x13:0x99"], id="word-and-state"),
        pytest.param("#q=nothing-like-it", [], id="nothing"),
    ],
)
def test_it_is_searched(chromium: str, file: Path, fragment: str, expected: list[str]) -> None:
    page = opened(chromium, file, fragment)
    assert shown(page) == expected
    assert page.one("output").text.startswith(f"{len(expected)} of ")
