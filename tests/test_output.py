"""Where reports go: files and standard output, at once where a command is live, and what hinders that."""

import io
import json
from pathlib import Path

import pytest

from sphero_probe.cli.output import FORMATS, Output
from sphero_probe.errors import OutputError
from sphero_probe.reports.rows import fact_row
from sphero_probe.reports.views import FACTS

STREAMING = ("sphero.set_data_streaming 0028000100006000 00", "--allow", "write", "--device", "fake:bb8")
AT_ONCE = [name for name in FORMATS if name != "table"]
"""The formats that write row by row; a table is as wide as its widest row."""


def value_of(number: int) -> str:
    return f"value-{number}"


@pytest.mark.parametrize("name", AT_ONCE)
def test_a_live_report_can_be_read_while_it_grows(tmp_path, name):
    file = tmp_path / "facts"
    with Output(name, str(file), "auto").report(FACTS, live=True) as report:
        for number in range(3):
            report.add(fact_row("fact", value_of(number)))
            assert value_of(number) in file.read_text("utf-8")
            assert value_of(number + 1) not in file.read_text("utf-8")
    assert value_of(2) in file.read_text("utf-8")


@pytest.mark.parametrize("name", AT_ONCE)
def test_so_it_is_on_standard_output(monkeypatch, name):
    raw = io.BytesIO()
    monkeypatch.setattr("sys.stdout", io.TextIOWrapper(raw, "utf-8", write_through=False))
    with Output(name, None, "auto").report(FACTS, live=True) as report:
        report.add(fact_row("fact", value_of(1)))
        assert value_of(1).encode() in raw.getvalue()


def test_a_report_of_many_rows_is_not_flushed_row_by_row(tmp_path):
    file = tmp_path / "facts"
    with Output("jsonl", str(file), "auto").report(FACTS) as report:
        report.add(fact_row("fact", value_of(1)))
        assert file.read_text("utf-8") == ""
    assert value_of(1) in file.read_text("utf-8")


@pytest.mark.parametrize("name", FORMATS)
def test_live_or_not_the_report_is_the_same(tmp_path, name):
    written = []
    for live in (False, True):
        file = tmp_path / str(live)
        with Output(name, str(file), "auto").report(FACTS, live=live) as report:
            for number in range(2):
                report.add(fact_row("fact", value_of(number)))
        written.append(file.read_bytes())
    assert written[0] == written[1]


def test_listen_writes_each_packet_as_it_comes(cli, monkeypatch):
    raw = io.BytesIO()
    seen: list[int] = []

    class Watched(io.TextIOWrapper):
        def flush(self) -> None:
            super().flush()
            seen.append(raw.getvalue().count(b"\n"))

    monkeypatch.setattr("sys.stdout", Watched(raw, "utf-8"))
    ran = cli("listen", "--count", "3", "--format", "jsonl", "--send", *STREAMING)
    assert ran.code == 0, ran.err
    assert {1, 2, 3} <= set(seen)
    assert [json.loads(line)["kind"] for line in raw.getvalue().splitlines()] == ["notification"] * 3


FULL = Path("/dev/full")


@pytest.mark.skipif(not FULL.exists(), reason="no disk that is always full")
def test_listen_to_a_full_disk_is_no_lost_link(cli):
    ran = cli("listen", "--seconds", "20", "--format", "jsonl", "-o", str(FULL), "--send", *STREAMING)
    assert ran.code == OutputError.exit_code
    assert "cannot write /dev/full" in ran.err


def test_listen_to_a_reader_that_is_gone_ends_quietly(cli, monkeypatch):
    class Gone(io.StringIO):
        def flush(self) -> None:
            if self.getvalue():
                raise BrokenPipeError

    monkeypatch.setattr("sys.stdout", Gone())
    ran = cli("listen", "--seconds", "20", "--format", "jsonl", "--send", *STREAMING)
    assert (ran.code, ran.err) == (OutputError.exit_code, "")
