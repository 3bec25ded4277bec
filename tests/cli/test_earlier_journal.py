"""A journal that version 0.1.0 wrote, cut in the middle of a line: it is reported and resumed as ever.

``tests/data/journal_0_1_0.jsonl`` was written by that version: ``sweep --did 0x13 --device fake:bolt-plus``.
"""

import shutil
from pathlib import Path

import pytest

from tests.support.cli import Cli, objects

HELD = Path(__file__).parents[1] / "data" / "journal_0_1_0.jsonl"
FAKE = ("--device", "fake:bolt-plus")


@pytest.fixture
def journal(tmp_path: Path) -> Path:
    """A copy that may be written to."""
    return Path(shutil.copy(HELD, tmp_path / "run.jsonl"))


def test_it_is_reported(cli: Cli, journal: Path) -> None:
    ran = cli("report", str(journal), "--format", "jsonl")
    assert ran.code == 0, ran.err
    heading, *rows = objects(ran.out)
    assert heading["tool_version"] == "0.1.0"
    findings = {row["cid"]: row for row in rows if row["type"] == "finding"}
    assert findings[0x10]["fields"] == {"percentage": 49}
    assert findings[0x01]["outcome"] == "exists"
    assert len(findings) == 96


def test_it_is_resumed(cli: Cli, journal: Path) -> None:
    ran = cli("sweep", "--resume", str(journal), *FAKE, "--format", "jsonl")
    assert ran.code == 0, ran.err
    rows = objects(ran.out)
    findings = {row["number"]: row for row in rows if row["type"] == "finding"}
    assert len(findings) == 256
    assert rows[-1]["complete"] is True
    assert findings[2]["outcome"] == "exists", "what was settled then is not asked again"
    assert journal.read_bytes().startswith(HELD.read_bytes().rpartition(b"\n")[0])
