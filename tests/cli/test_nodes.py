"""Nodes, addresses and flags from the command line."""

import csv
import io
from pathlib import Path

import pytest

from sphero_probe.protocol.packets import Response, Role
from sphero_probe.protocol.v2 import V2
from sphero_probe.simulator import FakeRobot, parse_settings
from sphero_probe.transports.fake import FakeTransport
from tests.cli.test_cli_bluez import NEW, probe
from tests.support.cli import Cli, objects
from tests.support.fake_bluez import FakeBlueZ, Peripheral, sphero_v2

BATTERY = ("send", "power.get_battery_percentage", "--device")
DRIVE_SERVED = {"did": 0x16, "cid": 0x44, "name": "drive.get_active_control_system_id", "node": 2}


def test_nodes_of_an_rvr_as_json(cli: Cli) -> None:
    ran = cli("nodes", "--device", "fake:rvr", "--format", "jsonl")
    assert ran.code == 0, ran.err
    system, *nodes = objects(ran.out)
    assert (system["type"], system["line"], system["addressing"]) == ("system", "BLE", "swapped")
    assert (system["client"], system["port"]) == (0x11, 1)
    assert system["client_means"].startswith("port 1, node 1: the client behind the robot's Bluetooth")
    by_address = {node["address"]: node for node in nodes}
    assert len(nodes) == len(by_address) == 33
    assert [node["address"] for node in nodes if node["state"] == "answers"] == [
        *(0x11, 0x12, 0x01, 0x02, 0x10, 0x00, None)
    ]
    assert by_address[0x12]["devices"] == ["api_and_shell", "system_info", "drive", "sensor"]
    assert by_address[0x12]["devices_from"] == "the node"
    assert DRIVE_SERVED in by_address[0x10]["serves"]
    absent = by_address[0x1F]
    assert (absent["state"], absent["code"], absent["code_name"]) == ("absent", 9, "bad target id")


def test_nodes_as_records_and_as_a_table(cli: Cli) -> None:
    head, *records = csv.reader(
        io.StringIO(cli("nodes", "-d", "fake:rvr", "--format", "csv").out, newline="")
    )
    named = dict(zip(head, records[1], strict=True))
    assert (named["address"], named["name"], named["state"]) == ("0x12", "secondary", "answers")
    assert named["dids"] == "0x10 0x11 0x16 0x18"
    table = cli("nodes", "-d", "fake:rvr", "--format", "table").out
    assert "Addresses in its answers: swapped" in table
    assert "0x13-0x1f  13 nodes" in table
    assert "0x16:0x44 drive.get_active_control_system_id by node 2" in table


def test_the_node_stage_of_discover_tells_what_nodes_tells(cli: Cli) -> None:
    device = ("--device", "fake:rvr?unavailable=2")
    ran = cli("discover", *device, "--did", "0x13", "--format", "jsonl")
    assert ran.code == 5
    assert "the run is incomplete: a node was unavailable" in ran.err
    rows = objects(ran.out)
    system, *nodes = objects(cli("nodes", *device, "--format", "jsonl").out)
    (surveyed,) = [row for row in rows if row["type"] == "note" and row["kind"] == "nodes"]
    assert {"type": "system", "schema_version": system["schema_version"], **surveyed["system"]} == system
    assert [{"type": "node", **node} for node in surveyed["nodes"]] == nodes
    assert surveyed["text"].startswith("primary answers, secondary unavailable")
    (ended,) = [row for row in rows if row["type"] == "note" and row["kind"] == "run"]
    assert (ended["target"], ended["devices_not_asked"]) == (0x12, [0x10, 0x11, 0x16, 0x18])
    table = cli("report", "last", "--format", "table").out
    assert "Sphero RVR RV-B9D8 over BLE, firmware: primary" in table
    assert "\nNodes\nThe robot sees this client as 0x11: port 1, node 1: " in table
    assert "unavailable: 0x0a" in table


def test_discover_asks_a_robot_without_addresses_for_no_nodes(cli: Cli) -> None:
    rows = objects(cli("discover", "--device", "fake:mini", "--did", "0x13", "--format", "jsonl").out)
    assert not [row for row in rows if row["type"] == "note" and row["kind"] == "nodes"]


@pytest.mark.parametrize(
    ("device", "line", "client", "words"),
    [
        ("fake:rvr?line=uart", "UART", 0x21, "0x21: port 2, node 1: the client behind the robot's UART"),
        ("fake:bolt-plus", "BLE", 0x11, "0x11: port 1, node 1: the client behind the robot's Bluetooth"),
        ("fake:bolt", "BLE", None, None),
        ("fake:bb8", "BLE", None, None),
    ],
)
def test_a_run_tells_how_the_robot_is_reached(
    cli: Cli, device: str, line: str, client: int | None, words: str | None
) -> None:
    run, *_ = objects(cli("sweep", "--did", "0x00", "--cid", "0x01", "-d", device, "--format", "jsonl").out)
    assert (run["line"], run["client"]) == (line, client)
    facts = {row["name"]: row["value"] for row in objects(cli("info", "-d", device, "--format", "jsonl").out)}
    assert (facts["reached_over"], facts.get("sees_client_as")) == (line, words)


@pytest.mark.parametrize("form", ["table", "plain", "json"])
def test_a_robot_without_nodes_is_told_in_one_line(cli: Cli, form: str) -> None:
    ran = cli("nodes", "--device", "fake:bb8", "--format", form)
    assert ran.code == 0
    assert "BB-8 has no nodes to ask: V1 packets carry no addresses." in ran.out + ran.err


def test_nodes_through_the_bus() -> None:
    robot = FakeRobot(parse_settings("bolt-plus"))
    with FakeBlueZ(
        [Peripheral(robot.name, NEW, robot=robot, services=sphero_v2(gate=False), mtu=247)]
    ) as air:
        ran = probe(air, "nodes", "--device", robot.name, "--format", "jsonl")
    assert ran.returncode == 0, ran.stderr
    system, *nodes = objects(ran.stdout)
    assert (system["line"], system["addressing"]) == ("BLE", "swapped")
    states = {node["address"]: node["state"] for node in nodes}
    assert [address for address, state in states.items() if state == "answers"] == [0x11, 1, 0x10, 0, None]
    assert {states[address] for address in range(0x12, 0x20)} == {"absent"}


@pytest.mark.parametrize("what", ["16:41", "0x16:0x41", "drive.get_stop_controller_state"])
def test_the_trace_of_a_command(cli: Cli, what: str) -> None:
    ran = cli("nodes", "--trace", what, "--device", "fake:rvr", "--format", "jsonl")
    assert ran.code == 0
    assert "as documented; only the last step is visible on a wire" in ran.err
    hops = objects(ran.out)
    keys = ("target_before", "source_before", "target_after", "source_after")
    assert [tuple(hop[key] for key in keys) for hop in hops] == [
        (0x12, 0x01, 0x12, 0x01),
        (0x12, 0x01, 0x02, 0x11),
        (0x02, 0x11, 0x02, 0x11),
        (0x02, 0x11, 0x11, 0x02),
        (0x11, 0x02, 0x11, 0x02),
        (0x11, 0x02, 0x01, 0x12),
    ]
    assert cli("nodes", "--trace", what, "--device", "fake:bb8").code == 2


def test_an_address_is_explained(cli: Cli) -> None:
    ran = cli("explain", "--address", "0x21", "--format", "jsonl")
    words = {said["use"]: said["words"] for said in objects(ran.out)}
    assert words["target of an answer"] == "port 2, node 1: the client behind the robot's UART"
    for wrong in (("--address", "0x121"), ("0x05", "--address", "0x21"), (), ("0x05", "--robot", "rvr")):
        assert cli("explain", *wrong).code == 2


FLAGS = [
    # options, flags byte, TID and SID on the wire, the outcome, exit code
    pytest.param((), "3a1101", "exists", 0, id="usual"),
    pytest.param(("--no-answer",), "381101", "sent", 0, id="no answer"),
    pytest.param(("--only-errors",), "3e1101", "sent", 0, id="only errors"),
    # bit 2 without bit 1 is refused with 0x06 [vendor]
    pytest.param(("--no-answer", "--only-errors"), "3c1101", "exists", 7, id="bit 2 alone"),
    pytest.param(("--no-activity",), "321101", "exists", 0, id="no activity"),
    pytest.param(("--source", "none"), "1a11", "exists", 0, id="TID alone, as the official SDK"),
    pytest.param(("--target", "none", "--source", "0x05"), "2a05", "exists", 0, id="SID alone"),
    pytest.param(("--target", "none"), "0a", "exists", 0, id="no addresses"),
    pytest.param(("--target", "0x01", "--source", "0x21"), "3a0121", "exists", 0, id="both named"),
]


@pytest.mark.parametrize(("options", "header", "outcome", "code"), FLAGS)
def test_flags_and_addresses_are_sent(
    cli: Cli, options: tuple[str, ...], header: str, outcome: str, code: int
) -> None:
    ran = cli(*BATTERY, "fake:bolt-plus", *options, "--format", "jsonl")
    assert ran.code == code, ran.err
    (finding,) = objects(ran.out)
    assert finding["sent"].startswith(f"8d{header}1310")
    assert (finding["outcome"], finding["attempts"]) == (outcome, 1)
    (planned,) = objects(cli(*BATTERY, "fake:bolt-plus", *options, "--dry-run", "--format", "jsonl").out)
    assert planned["sent"] == finding["sent"]


@pytest.mark.parametrize(
    ("options", "start"),
    [((), "ffff"), (("--no-answer",), "fffe"), (("--no-answer", "--no-activity"), "fffc")],
)
def test_the_bits_of_a_v1_command(cli: Cli, options: tuple[str, ...], start: str) -> None:
    (finding,) = objects(cli("send", "core.ping", "--device", "fake:bb8", *options, "--format", "jsonl").out)
    assert finding["sent"].startswith(start)
    for wrong in (("--only-errors",), ("--source", "0x01")):
        assert cli("send", "core.ping", "--device", "fake:bb8", *wrong).code == 2


def test_a_command_without_an_answer_passes_the_policy_all_the_same(cli: Cli) -> None:
    assert cli("send", "power.sleep", "--device", "fake:bolt-plus", "--no-answer").code == 6


def test_a_sent_command_survives_its_journal(cli: Cli, tmp_path: Path) -> None:
    journal = tmp_path / "sent.jsonl"
    cli(*BATTERY, "fake:bolt-plus", "--no-answer", "--source", "0x05", "--journal", str(journal))
    ran = cli("report", str(journal), "--format", "jsonl")
    assert ran.code == 0, ran.err
    (finding,) = [row for row in objects(ran.out) if row["type"] == "finding"]
    assert (finding["outcome"], finding["note"]) == ("sent", "no answer was asked for")
    assert '"options":{"answer":false' in journal.read_text()


def test_flags_by_name_in_both_generations(cli: Cli) -> None:
    frames = ("8d3911011a1c00007ed8", "8d0a131007cbd8", "fffe00015201ab")
    rows = objects(cli("decode", *frames, "--format", "jsonl").out)
    assert [row.get("flags") for row in rows] == [
        ["is_response", "is_activity", "has_target_id", "has_source_id"],
        ["requests_response", "is_activity"],
        ["resets_timeout"],
    ]
    assert rows[0]["source_means"] == "port 0, node 1: node 1 of the robot, which answers"


def test_a_packet_byte_by_byte(cli: Cli) -> None:
    frame = "8d3a11011a1c003fff0000ff000040d8"  # the worked example of the BOLT+ reference, step 3
    rows = objects(cli("decode", "--explain", frame, "--format", "jsonl").out)
    assert "".join(row["raw"] for row in rows) == frame
    assert [row["meaning"] for row in rows if row["field"] == "CHK"] == ["sum 0x2bf; 0xff - 0xbf = 0x40"]
    bad = objects(cli("decode", "--explain", "8d3911011a1c00007fd8", frame, "--format", "jsonl").out)
    assert bad[0]["meaning"] == "checksum 0x7f, expected 0x7e"
    assert [row["packet"] for row in bad] == [1] * 10 + [2] * 16


STEP_4 = """
 0 8d SOP   start of packet
 1 39 FLAGS is_response, is_activity, has_target_id, has_source_id
 2 11 TID   port 1, node 1: the client behind the robot's Bluetooth
 3 01 SID   port 0, node 1: node 1 (primary) of the robot, which answers
 4 1a DID   user_io
 5 1c CID   user_io.set_all_leds_with_8_bit_mask
 6 00 SEQ   of the command
 7 00 ERR   success
 8 7e CHK   sum 0x81; 0xff - 0x81 = 0x7e
 9 d8 EOP   end of packet
"""
"""Step 4 of the worked example of the BOLT+ reference, byte by byte; the words are this tool's."""


def test_the_answer_of_the_worked_example_byte_by_byte(cli: Cli) -> None:
    ran = cli("decode", "--explain", "8d3911011a1c00007ed8", "--robot", "bolt-plus", "--format", "jsonl")
    keys = ("offset", "raw", "field", "meaning")
    told = [tuple(str(row[key]) for key in keys) for row in objects(ran.out)]
    assert told == [tuple(line.split(maxsplit=3)) for line in STEP_4.strip().splitlines()]


def answers_come_from(monkeypatch: pytest.MonkeyPatch, node: int) -> None:
    """Have every answer name another node as its source."""
    read = FakeTransport.read
    decoder = V2.decoder(Role.HOST)

    async def intercepted(line: FakeTransport) -> bytes:
        while data := await read(line):
            if packets := decoder.feed(data):
                return b"".join(
                    V2.frame_of(packet._replace(source=node) if isinstance(packet, Response) else packet)
                    for packet in packets
                )
        return b""

    monkeypatch.setattr(FakeTransport, "read", intercepted)


def test_a_foreign_source_is_told_and_can_be_tolerated(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    answers_come_from(monkeypatch, 5)
    what = ("sweep", "--did", "0x13", "--cid", "0x10-0x14", "--device", "fake:bolt-plus")
    sweep = (*what, "--format", "jsonl")
    refused = cli(*sweep, "--timeout", "200ms")
    assert refused.code == 4
    assert "answers come from node 5, but node 1 was asked" in refused.err
    assert "--tolerate source" in refused.err
    ran = cli(*sweep, "--tolerate", "source", "--tolerate", "seq")
    assert ran.code == 0, ran.err
    rows = objects(ran.out)
    assert {row["answered_by"] for row in rows if row["type"] == "finding" and row["code"] is not None} == {5}
    (note,) = [row for row in rows if row["type"] == "note" and row["kind"] == "run"]
    assert note["text"] == "answers were accepted although they come from node 5"
    table = cli(*what, "--format", "table", "--tolerate", "source").out
    assert "answered by node 0x05" in " ".join(table.split())
    sent = cli(*BATTERY, "fake:bolt-plus", "--tolerate", "source", "--format", "table")
    assert sent.code == 0
    assert "Answered by  0x05: port 0, node 5" in sent.out
    assert "answers were accepted although they come from node 5" in sent.err
