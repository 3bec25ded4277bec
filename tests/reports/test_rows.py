"""Records to rows: the keys that scripts rely on, in their order."""

import json
from pathlib import Path

import pytest

from sphero_probe.catalogue import all_rows, lookup, rows_of
from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.exchange import Silent
from sphero_probe.probing.dry_run import PlannedProbe
from sphero_probe.probing.facts import Fact
from sphero_probe.probing.finding import Finding, Note
from sphero_probe.protocol.packets import Command, Response
from sphero_probe.reports.checks import Look, State, check_row
from sphero_probe.reports.rows import (
    code_row,
    command_row,
    fact_row,
    finding_row,
    heading_row,
    note_row,
    plan_row,
    planned_row,
    robot_row,
    summary_row,
)
from sphero_probe.transports.base import Seen
from tests.support.reports_by_hand import (
    BOLT,
    CODEC,
    FINDING_KEYS,
    HEADING,
    PRIMARY,
    V2,
    answered,
    found,
    refused,
    silent,
    summary,
)


def test_an_answered_finding() -> None:
    row = finding_row(answered(1, 0x13, 0x10, 0x00, b"\x57"))
    assert row.type == "finding"
    assert list(row.data) == FINDING_KEYS
    assert row.data == {
        "number": 1,
        "target": 0x11,
        "answered_by": 0x11,
        "did": 0x13,
        "cid": 0x10,
        "name": "power.get_battery_percentage",
        "risk": "probe",
        "outcome": "exists",
        "confidence": "certain",
        "code": 0,
        "code_name": "success",
        "payload": "57",
        "fields": {"percentage": 87},
        "units": {"percentage": "%"},
        "sent": CODEC.encode_command(Command(0x13, 0x10, bytes(11), 0x11), 1).hex(),
        "received": CODEC.encode_response(Response(1, 0, b"\x57", 0x13, 0x10, 0x11, flags=9)).hex(),
        "rtt_ms": 31.2,
        "attempts": 1,
        "note": "",
        "state": "exists",
        "request": "0000000000000000000000",
        "arguments": None,
    }


@pytest.mark.parametrize(
    "finding",
    [
        pytest.param(silent(2, 0x13, 0x99, target=None), id="silent"),
        pytest.param(refused(2, 0x13, 0x00, Risk.BRICK, "brick: x"), id="withheld"),
    ],
)
def test_without_an_answer_its_keys_are_null(finding: Finding) -> None:
    row = finding_row(finding)
    assert list(row.data) == FINDING_KEYS
    nulls = ("answered_by", "code", "code_name", "payload", "fields", "received", "rtt_ms")
    assert [row.data[key] for key in nulls] == [None] * 7
    assert row.data["units"] == {}


def test_sent_is_null_where_nothing_was_sent() -> None:
    assert finding_row(refused(1, 0x13, 0x00, Risk.BRICK, "brick: x")).data["sent"] is None
    lost = Command(0x13, 0x10)
    assert finding_row(found(1, lost, Silent(lost, 0, b"", 0.0))).data["sent"] is None
    assert str(finding_row(silent(1, 0x13, 0x99)).data["sent"]).startswith("8d")


def test_name_is_null_only_where_no_catalogue_knows_the_pair() -> None:
    assert finding_row(answered(1, 0x13, 0x99, 0x05)).data["name"] is None
    assert finding_row(answered(1, 0x13, 0x11, 0x05)).data["name"] == "power.awake_notify"


@pytest.mark.parametrize(
    ("finding", "fields", "note"),
    [
        pytest.param(answered(1, 0x13, 0x10, 0x05, b"\x57"), {}, "", id="an error is not decoded"),
        pytest.param(answered(1, 0x13, 0x99, 0x00, b"\x57"), {}, "", id="unknown command"),
        pytest.param(answered(1, 0x13, 0x21, 0x00, b"\x01"), {}, "", id="layout of a notification"),
        pytest.param(
            answered(1, 0x13, 0x10, 0x00, b"\x57\x01"),
            {},
            "1 byte more than the layout has",
            id="what does not fit is told",
        ),
        pytest.param(
            answered(1, 0x13, 0x99, 0x03), {}, "a stub or null handler", id="the engine's note stays"
        ),
    ],
)
def test_fields_and_note(finding: Finding, fields: dict[str, int], note: str) -> None:
    row = finding_row(finding)
    assert row.data["fields"] == fields
    assert row.data["note"] == note


def test_float_fields_that_json_does_not_know_are_texts() -> None:
    finding = answered(1, 0x13, 0x25, 0x00, bytes.fromhex("7fc00000"))
    assert finding_row(finding).data["fields"] == {"voltage": "nan"}


def test_heading() -> None:
    row = heading_row(HEADING)
    assert row.type == "run"
    assert list(row.data) == [
        "robot",
        "model",
        "device",
        "firmware",
        "plan",
        "tool_version",
        "consent",
        "strictness",
        "started",
        "line",
        "client",
        "client_means",
    ]
    assert (row.data["line"], row.data["client"], row.data["client_means"]) == (None, None, None)
    reached = heading_row(HEADING._replace(robot="rvr", line="UART", client=0x21)).data
    assert reached["client_means"] == "port 2, node 1: the client behind the robot's UART"
    assert row.data["consent"] == ["read", "probe"]
    assert row.data["firmware"] == {"primary": "5.0.2", "secondary": "4.1.7"}


def test_summary_counts_all_five_outcomes() -> None:
    row = summary_row(summary([answered(1, 0x13, 0x10, 0), silent(2, 0x13, 0x99)]))
    assert row.type == "summary"
    assert row.data == {
        "counts": {"exists": 1, "absent": 0, "silent": 1, "skipped": 0, "inconclusive": 0},
        "seconds": 1.234,
        "probes_sent": 2,
        "frames_sent": 2,
        "complete": True,
        "strictness": {},
    }


def test_note_has_its_details_beside_the_text() -> None:
    row = note_row(Note("malformed", "checksum", {"raw": "8d", "reason": "checksum"}))
    assert (row.type, list(row.data)) == ("note", ["kind", "text", "raw", "reason"])


def test_robots() -> None:
    assert robot_row(Seen("SB-1B2C", BOLT, "AA:BB", -61)).data == {
        "name": "SB-1B2C",
        "model": "Sphero BOLT",
        "generation": "v2",
        "address": "AA:BB",
        "rssi": -61,
    }
    assert robot_row(Seen("", None, "AA:BB", -61)).data["model"] is None
    assert robot_row(Seen("", None, "AA:BB", -61)).data["generation"] is None


def test_command() -> None:
    (known,) = rows_of(V2, 0x13, 0x10)
    row = command_row(known)
    ids = ["generation", "did", "cid", "name", "kind", "risk"]
    evidence = ["provenance", "firmware", "enabled_by", "since"]
    assert list(row.data) == [*ids, "request", "response", "robots", "sources", "aliases", "note", *evidence]
    assert row.data["request"] == ""
    assert row.data["response"] == "percentage:u8[%]~"
    assert row.data["robots"] == {key: list(nodes) for key, nodes in known.nodes.items()}
    assert row.data["robots"]["rvr"] == [1]
    assert row.data["kind"] == "command"


def test_commands_of_unknown_layout_have_null() -> None:
    (known,) = rows_of(V2, 0x13, 0x02)
    assert (command_row(known).data["request"], command_row(known).data["response"]) == (None, None)


def test_small_rows() -> None:
    command = Command(0x13, 0x10, b"", PRIMARY)
    known = lookup(V2, 0x13, 0x10, BOLT)
    assert planned_row(PlannedProbe(1, command, known, Risk.READ, b"\x8d\xd8", None))[:2] == (
        "planned",
        {
            "number": 1,
            "target": 17,
            "did": 19,
            "cid": 16,
            "name": "power.get_battery_percentage",
            "risk": "read",
            "payload": "",
            "sent": "8dd8",
            "withheld": None,
        },
    )
    assert planned_row(PlannedProbe(1, command, None, Risk.PERSIST, b"", "no")).data["name"] is None
    assert plan_row("power", "What", Path("a/b.py"), ("bolt",))[:2] == (
        "plan",
        {"name": "power", "summary": "What", "file": str(Path("a/b.py")), "robots": ["bolt"]},
    )
    assert plan_row("power", "What", None, ()).data["file"] is None
    assert code_row(V2, 5).data == {
        "generation": "v2",
        "code": 5,
        "name": "bad data length",
        "meaning": "exists, length refused",
        "proves": "the command exists and refuses this length, where only existing ones do",
    }
    assert fact_row(Fact("battery", 87, "%", "primary")).data == {
        "name": "battery",
        "value": 87,
        "unit": "%",
        "node": "primary",
    }
    assert fact_row(Fact("battery", 87, "%", "")).data["node"] is None
    assert check_row("adapter", Look(State.WARN, "off", "switch it on"))[:2] == (
        "check",
        {"name": "adapter", "state": "warn", "seen": "off", "fix": "switch it on"},
    )


def test_every_catalogue_row_and_finding_of_it_is_json() -> None:
    for known in all_rows(V2):
        assert json.loads(json.dumps(command_row(known).data))["cid"] == known.cid
        row = finding_row(answered(1, known.did, known.cid, 0, b"\x7f\xc0\x00\x00\xff"))
        assert json.loads(json.dumps(row.data, allow_nan=False)) == row.data
