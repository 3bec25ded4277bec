"""``decode`` and ``capture show`` on captures: packets with time, direction and robot, and summaries."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile

import pytest

from tests.support import capture_writers as writers
from tests.support.capture_conversation import (
    V1_FRAMES,
    V2_FRAMES,
    cached_v1,
    foreign,
    found_v2,
    notify,
    v2_answer,
    v2_command,
    woven,
    write,
)
from tests.support.captures import CAPTURES
from tests.support.cli import Cli, objects


@pytest.fixture
def recorded(tmp_path: Path) -> str:
    path = tmp_path / "btsnoop_hci.log"
    path.write_bytes(CAPTURES["btsnoop 1002"]())
    return str(path)


def test_decode_shows_time_direction_and_connection(cli: Cli, recorded: str) -> None:
    ran = cli("decode", recorded, "--format", "jsonl")
    assert ran.code == 0
    rows = [row for row in objects(ran.out) if row["connection"] == "1 BP-0000"]
    assert [row["raw"] for row in rows] == [frame.hex() for frame in V2_FRAMES]
    assert rows[0]["direction"] == "to robot"
    assert rows[1]["direction"] == "from robot"
    assert rows[0]["time"].startswith("2023-11-14T22:13:20.")
    assert rows[0]["kind"] == "command"
    assert rows[0]["name"] == "power.get_battery_percentage"
    assert f"{recorded}: btsnoop:" in ran.err


def test_v1_answers_are_named_by_their_commands(cli: Cli, recorded: str) -> None:
    ran = cli("decode", recorded, "--format", "jsonl")
    rows = [row for row in objects(ran.out) if row["generation"] == "v1"]
    assert len(rows) == 2 * len(V1_FRAMES)
    pairs = [(row["did"], row["cid"]) for row in rows if row["kind"] == "response"]
    assert sorted(pairs) == [(0, 0x20), (0, 0x20), (2, 0x20), (2, 0x20)]


def test_the_table_has_what_the_records_have(cli: Cli, recorded: str) -> None:
    table = cli("decode", recorded, "--format", "table").out
    assert "Time" in table
    assert "22:13:20." in table
    head = cli("decode", recorded, "--format", "csv").out.splitlines()[0]
    assert head.endswith("time,direction,connection")


def test_decode_reads_a_capture_from_a_pipe(recorded: str) -> None:
    command = [sys.executable, "-m", "sphero_probe", "decode", "-", "--format", "jsonl"]
    with Path(recorded).open("rb") as file:
        ran = subprocess.run(command, stdin=file, capture_output=True, text=True, check=True)
    assert len(ran.stdout.splitlines()) == len(V2_FRAMES) + 2 * len(V1_FRAMES)


def test_a_capture_without_a_robot_is_empty_and_says_what_is_in_it(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "other.pcap"
    path.write_bytes(writers.pcap(writers.as_raw(writers.hci(woven(foreign())), 201)))
    for command in (("decode",), ("capture", "show"), ("capture", "show", "--summary")):
        ran = cli(*command, str(path), "--format", "jsonl")
        assert (ran.code, ran.out) == (0, "")
        assert "no Sphero" in ran.err
        assert len(ran.err.splitlines()) == 1


@pytest.mark.parametrize("command", [("decode",), ("capture", "show")])
def test_a_link_type_that_is_not_read_is_an_error_with_a_way_out(
    cli: Cli, tmp_path: Path, command: tuple[str, ...]
) -> None:
    path = tmp_path / "net.pcap"
    path.write_bytes(writers.pcap([writers.Raw(0, 1, b"\x8d\x0a\x13\x10\x07\xcb\xd8" * 9)]))
    ran = cli(*command, str(path))
    assert ran.code == 8
    assert "link type 1" in ran.err
    assert "tshark" in ran.err


def test_a_cut_capture_is_read_and_said_to_be_cut(cli: Cli, recorded: str) -> None:
    whole = Path(recorded).read_bytes()
    Path(recorded).write_bytes(whole[:-3])
    ran = cli("decode", recorded, "--format", "jsonl")
    assert ran.code == 0
    assert ran.out
    assert "cut after" in ran.err


def test_a_name_that_looks_like_hex_is_a_file_if_it_exists(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("cafe").write_bytes(CAPTURES["pcap 201"]())
    assert "pcap:" in cli("decode", "cafe").err
    mixed = objects(cli("decode", "cafe", "8d0a131007cbd8", "--format", "jsonl").out)
    assert mixed[-1]["raw"] == "8d0a131007cbd8"
    assert "time" not in mixed[-1]


def heard(cli: Cli, *words: str) -> list[dict[str, Any]]:
    ran = cli("capture", "show", *words, "--summary", "--format", "jsonl")
    assert ran.code == 0, ran.err
    return objects(ran.out)


def test_the_summary_counts_payloads_answers_and_round_trips(cli: Cli, recorded: str) -> None:
    rows = heard(cli, recorded, "--robot", "BP-0000")
    kinds = [row["type"] for row in rows]
    assert kinds == ["heard"] * (len(kinds) - 1) + ["connection"]
    first = rows[0]
    assert (first["did"], first["cid"], first["known"]) == (0x77, 1, False)
    assert first["codes"] == {"0x02 bad command id": 1}
    assert all(row["known"] for row in rows[1:-1])
    lights = next(row for row in rows if (row.get("did"), row.get("cid")) == (0x1A, 0x1C))
    assert lights["lengths"] == [20]
    assert lights["first"] == bytes(range(20)).hex()
    robot = rows[-1]
    assert (robot["commands"], robot["answers"], robot["notifications"]) == (4, 4, 2)
    assert robot["most_in_flight"] == 1
    assert robot["out_of_order"] == 0
    assert set(robot["splits"]) == {"5", "11"}


def test_the_summary_tells_order_and_depth(cli: Cli, tmp_path: Path) -> None:
    talk = [
        write(0x1C, v2_command(1, 0x13, 0x10)),
        write(0x1C, v2_command(2, 0x11, 0x00)),
        notify(0x1C, v2_answer(2, 0x11, 0x00)),
        notify(0x1C, v2_answer(1, 0x13, 0x10)),
        notify(0x1C, v2_answer(9, 0x13, 0x10)),
    ]
    path = tmp_path / "one"
    path.write_bytes(writers.btsnoop(writers.hci(woven(talk, step=10_000))))
    robot = heard(cli, str(path))[-1]
    assert robot["most_in_flight"] == 2
    assert robot["out_of_order"] == 1
    assert robot["answers_to_none"] == 1
    assert robot["rtt_ms"] == [10, 10, 30]
    said = cli("capture", "show", str(path), "--summary").err
    assert "round trips 10 to 30 ms, median 10 ms" in said
    assert "at most 2 in flight" in said


def test_only_what_is_asked_for_is_shown(cli: Cli, recorded: str) -> None:
    unknown = heard(cli, recorded, "--unknown")
    assert [(row["did"], row["cid"]) for row in unknown if row["type"] == "heard"] == [(0x77, 1)]
    power = heard(cli, recorded, "--did", "power", "--robot", writers.PEERS[0].lower())
    assert {row["did"] for row in power if row["type"] == "heard"} == {0x13}
    shown = objects(cli("capture", "show", recorded, "--unknown", "--format", "jsonl").out)
    assert [row["raw"] for row in shown] == [frame.hex() for frame in V2_FRAMES[-2:]]
    by_number = objects(cli("capture", "show", recorded, "--robot", "1", "--format", "jsonl").out)
    assert [row["raw"] for row in by_number] == [frame.hex() for frame in V2_FRAMES]


def test_what_is_no_capture_is_said_to_be_none(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "text"
    path.write_text("8d 0a 13 10 07 cb d8")
    ran = cli("capture", "show", str(path))
    assert ran.code == 8
    assert "sphero-probe decode" in ran.err
    assert cli("capture", "show", str(tmp_path / "none")).code == 8


def test_a_robots_name_is_made_harmless(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "hostile"
    packets = writers.hci(woven(found_v2()))
    packets[0] = writers.advertised(packets[0].time, writers.PEERS[0], "BP\x1b[2J")
    path.write_bytes(writers.btsnoop(packets))
    for form in ("table", "plain", "jsonl"):
        ran = cli("capture", "show", str(path), "--format", form)
        assert "\x1b" not in ran.out + ran.err
    assert json.loads(cli("capture", "show", str(path), "--format", "jsonl").out.splitlines()[0])


def test_a_sweep_asks_what_the_app_was_seen_to_send(cli: Cli, recorded: str) -> None:
    asked = ("sweep", "--plan-from", recorded, "--device", "fake:bolt-plus", "--format", "jsonl")
    ran = cli(*asked, "--dry-run")
    assert ran.code == 0, ran.err
    planned = [row for row in objects(ran.out) if row["type"] == "planned"]
    assert [(row["did"], row["cid"], row["target"]) for row in planned] == [
        (0x13, 0x10, 0x12),
        (0x11, 0x00, 0x12),
        (0x1A, 0x1C, 0x12),
        (0x77, 0x01, 0x12),
    ]
    sent = [str(row["sent"]) for row in planned]
    assert v2_command(0, 0x13, 0x10)[1:6].hex() in sent[0]
    assert not any(bytes(range(20)).hex() in frame for frame in sent)
    swept = cli(*asked)
    assert swept.code == 0, swept.err
    outcomes = {
        (row["did"], row["cid"]): row["outcome"] for row in objects(swept.out) if row["type"] == "finding"
    }
    assert set(outcomes) == {(0x13, 0x10), (0x11, 0x00), (0x1A, 0x1C), (0x77, 0x01)}
    again = cli("sweep", "--resume", "last", "--device", "fake:bolt-plus")
    assert again.code == 2
    assert f"add --plan-from {recorded}" in again.err


def test_a_plan_from_a_capture_of_nothing_is_an_error(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "other"
    path.write_bytes(writers.btsnoop(writers.hci(woven(foreign()))))
    ran = cli("sweep", "--plan-from", str(path), "--device", "fake:bolt-plus")
    assert ran.code == 8
    assert "no v2 command to ask" in ran.err
    assert cli("sweep", "--plan-from", str(path), "--did", "1", "--device", "fake:bolt-plus").code == 2


def zipped(path: Path, members: dict[str, bytes]) -> str:
    with ZipFile(path, "w", ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return str(path)


def test_the_log_in_an_android_bug_report_is_read(cli: Cli, tmp_path: Path, recorded: str) -> None:
    log = Path(recorded).read_bytes()
    report = zipped(
        tmp_path / "bugreport.zip",
        {
            "main_entry.txt": b"x",
            "FS/data/misc/bluetooth/logs/btsnoop_hci.log": log,
            "btsnoop_hci.log.last": b"",
        },
    )
    assert cli("decode", report, "--format", "jsonl").out == cli("decode", recorded, "--format", "jsonl").out
    assert cli("capture", "show", report, "--summary").code == 0


def test_a_zip_without_a_log_and_a_damaged_one_are_said(cli: Cli, tmp_path: Path, recorded: str) -> None:
    other = zipped(tmp_path / "other.zip", {"text": b"x"})
    ran = cli("decode", other)
    assert ran.code == 8
    assert "a zip without a Bluetooth log" in ran.err
    whole = zipped(tmp_path / "report.zip", {"btsnoop_hci.log": Path(recorded).read_bytes()})
    data = bytearray(Path(whole).read_bytes())
    data[200:230] = bytes(30)
    Path(whole).write_bytes(data)
    ran = cli("decode", whole, "--format", "jsonl")
    assert ran.code in {0, 8}
    assert "Traceback" not in ran.err
    assert "zip" in ran.err
    Path(whole).write_bytes(data[:100])
    assert cli("decode", whole).code == 8


def test_a_doubtful_frame_says_so(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "doubtful"
    talk = [*cached_v1(), write(0x0E, b"\x01" + V1_FRAMES[0])]
    path.write_bytes(writers.btsnoop(writers.hci(woven(talk))))
    rows = objects(cli("decode", str(path), "--format", "jsonl").out)
    assert [row["raw"] for row in rows if row.get("doubt") == "next to damaged bytes"] == [V1_FRAMES[0].hex()]
    assert "(doubtful: next" in cli("decode", str(path), "--format", "table").out
    assert "doubt" in cli("decode", str(path), "--format", "csv").out.splitlines()[0].split(",")
