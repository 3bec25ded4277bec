"""One notification has one JSON shape: in ``listen``, the notes of a sweep, its report, and ``decode``."""

from pathlib import Path

import pytest

from tests.support.cli import Cli, objects

STREAMING = bytes.fromhex("000A000000E000")
"""Every 10 ms, without end, the sensors of bits 15 to 13: the accelerometer."""
PLAN = f"""
from sphero_probe.probing.plan import Plan, Probe
from sphero_probe.protocol.packets import Command

ask = Command(0x18, 0x00, bytes.fromhex("{STREAMING.hex()}"), 0x12)
rest = [Probe(Command(0x13, cid)) for cid in range(0x20, 0x50)]
PLAN = Plan("stream", "switch on a sensor stream", [[Probe(ask, exact=True)], rest])
"""
ACCELEROMETER = {"accelerometer_x", "accelerometer_y", "accelerometer_z"}


def packet_keys(row: dict[str, object]) -> dict[str, object]:
    """What listen and sweep say of a packet, without what tells their rows apart and without the time."""
    return {key: row[key] for key in row if key not in ("type", "text", "time", "schema_version")}


def notes(text: str, kind: str) -> list[dict[str, object]]:
    return [row for row in objects(text) if row["type"] == "note" and row["kind"] == kind]


def test_listen_and_sweep_show_a_notification_alike(cli: Cli) -> None:
    where = ("--device", "fake:r2d2", "--format", "jsonl")
    heard = cli(
        "listen", "--send", "0x13 0x01", "--allow", "motion", "--count", "1", "--seconds", "20", *where
    )
    swept = cli("sweep", "--did", "0x13", "--cid", "0x01", "--allow", "motion", *where)
    (packet,) = objects(heard.out)
    note = notes(swept.out, "notification")[0]
    assert packet_keys(note) == packet_keys(packet)
    assert packet_keys(packet) == {
        "generation": "v2",
        "kind": "notification",
        "did": 0x13,
        "cid": 0x1A,
        "seq": 0xFF,
        "name": "power.did_sleep_notify",
        "flags": ["is_activity"],
        "fields": {},
        "payload": "",
        "raw": "8d08131affcbd8",
    }
    assert all(str(row["time"]).endswith("Z") for row in (note, packet))
    reported = cli("report", "last", "--format", "jsonl")
    assert note in notes(reported.out, "notification")


def test_listen_sweep_and_decode_read_a_sensor_stream_alike(cli: Cli, tmp_path: Path) -> None:
    plan = tmp_path / "stream.py"
    plan.write_text(PLAN, encoding="utf-8")
    where = ("--device", "fake:bolt?latency=5ms", "--allow", "write", "--format", "jsonl")
    heard = cli("listen", "--send", f"0x18 0x00 {STREAMING.hex()}", "--count", "2", "--seconds", "20", *where)
    swept = cli("sweep", "--plan", str(plan), *where)
    packets, streamed = objects(heard.out), notes(swept.out, "notification")
    assert len(packets) == 2, heard.err
    assert streamed, swept.err
    for row in (*packets, *streamed):
        assert (row["did"], row["cid"], row["source"]) == (0x18, 0x02, 2)
        assert set(row["fields"]) == ACCELEROMETER
        assert row["units"] == dict.fromkeys(row["fields"], "g")
    assert packet_keys(packets[0]) == packet_keys(streamed[0])

    (finding,) = (row for row in objects(swept.out) if row["type"] == "finding" and row["number"] == 1)
    traffic = [str(finding["sent"]), str(finding["received"]), *(str(row["raw"]) for row in streamed)]
    decoded = objects(cli("decode", "".join(traffic), "--robot", "bolt", "--format", "jsonl").out)
    assert [row["kind"] for row in decoded[:2]] == ["command", "response"]
    assert [packet_keys(row) for row in decoded[2:]] == [packet_keys(note) for note in streamed]
    unknown = objects(cli("decode", "".join(traffic[2:]), "--format", "jsonl").out)
    assert all(not ACCELEROMETER & set(row.get("fields") or ()) for row in unknown)


def test_a_stream_that_the_robot_refused_is_not_decoded(cli: Cli) -> None:
    ran = cli(
        "listen", "--send", "0x18 0x00 00", "--seconds", "5", "--allow", "write", "--device", "fake:bolt"
    )
    assert ran.code == 7
    assert "bad data length" in ran.err


@pytest.mark.parametrize(("count", "seconds"), [("2", "20"), ("1000", "0.4")])
def test_listen_ends_after_so_many_packets_or_so_much_time(cli: Cli, count: str, seconds: str) -> None:
    ran = cli(
        *("listen", "--send", f"0x18 0x00 {STREAMING.hex()}", "--count", count, "--seconds", seconds),
        *("--allow", "write", "--device", "fake:bolt", "--format", "jsonl"),
    )
    assert ran.code == 0, ran.err
    heard = len(objects(ran.out))
    assert heard == 2 if count == "2" else 1 <= heard < 1000
