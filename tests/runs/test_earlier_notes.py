"""Journals written before notes had the keys of a packet are read and reported unchanged."""

import json
from pathlib import Path
from typing import Any

from sphero_probe.runs.reader import read_journal
from sphero_probe.runs.store import runs_folder
from tests.support.cli import Cli

EARLIER: list[dict[str, Any]] = [
    {
        "type": "note",
        "kind": "notification",
        "text": "0x13:0x1a power.did_sleep_notify",
        "data": {
            "did": 19,
            "cid": 26,
            "source": None,
            "name": "power.did_sleep_notify",
            "payload": "",
            "fields": {},
        },
    },
    {
        "type": "note",
        "kind": "late",
        "text": "late or repeated answer to 0x13:0x10 seq 3",
        "data": {"did": 19, "cid": 16, "seq": 3, "code": 0, "received": "8d0913100300d0d8"},
    },
    {
        "type": "note",
        "kind": "malformed",
        "text": "checksum 0xd7, expected 0xd6",
        "data": {"raw": "8d09130d0000d7d8", "reason": "checksum 0xd7, expected 0xd6"},
    },
]


def test_notes_of_an_earlier_version(cli: Cli, tmp_path: Path) -> None:
    swept = cli("sweep", "--did", "0x13", "--cid", "0x10", "--device", "fake:bolt", "--format", "jsonl")
    assert swept.code == 0, swept.err
    (journal,) = runs_folder().glob("*.jsonl")
    lines = journal.read_text("ascii").splitlines()
    lines[2:2] = [json.dumps(note) for note in EARLIER]
    earlier = tmp_path / "earlier.jsonl"
    earlier.write_text("\n".join(lines) + "\n", "ascii")
    read_journal(earlier)
    reported = cli("report", str(earlier), "--format", "jsonl")
    assert reported.code == 0, reported.err
    rows = [json.loads(line) for line in reported.out.splitlines()]
    notes = [row for row in rows if row["type"] == "note" and row["kind"] not in ("calibration", "exchanges")]
    for note, row in zip(EARLIER, notes, strict=True):
        assert row == {"type": "note", "kind": note["kind"], "text": note["text"], **note["data"]}
    table = cli("report", str(earlier), "--format", "table")
    assert table.code == 0, table.err
    for word in ("1 notification", "1 late or unmatched response", "1 malformed frame"):
        assert word in table.out
