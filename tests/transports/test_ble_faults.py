"""What radio and robot do wrong, through the whole tool and unpatched bleak: no finding is ever wrong."""

import json
import threading
from pathlib import Path
from typing import Any

import pytest

from tests.support.fake_bluez import V2_API, V2_GATE, Adapter, BusFaults, FakeBlueZ, Faults
from tests.support.fake_bluez_stage import ADDRESS, Stage, never_wrong, rows_of, said

CIDS = 0x30
SWEEP = ("sweep", "--did", "0x13", "--cid", f"0x00-0x{CIDS - 1:02x}", "--format", "jsonl", "-d", ADDRESS)
INFO = ("info", "-d", ADDRESS)
QUICK = ("--connect-timeout", "0.3")
PHRASE_SIZE = 18


@pytest.mark.parametrize(
    ("faults", "mtu", "connects"),
    [
        pytest.param(Faults(), 23, 1, id="smallest-mtu"),
        pytest.param(Faults(split=1), 247, 1, id="one-byte-notifications"),
        pytest.param(Faults(double_every=1), 247, 1, id="each-notification-twice"),
        pytest.param(Faults(lose_every=7), 247, 1, id="every-seventh-notification-lost"),
        pytest.param(Faults(drop_at_write=25), 247, 3, id="drop-during-a-write"),
        pytest.param(Faults(drop_at_write=40, double_every=3), 247, 2, id="doubled-after-reconnect"),
        pytest.param(Faults(lose_every=30, drop_when_idle=0.05), 247, 2, id="drop-while-idle"),
        pytest.param(Faults(drops_in_discovery=1), 247, 2, id="drop-during-discovery"),
        pytest.param(Faults(connect_errors=("Connection refused",) * 2), 247, 3, id="refuses-twice"),
        pytest.param(
            Faults(connect_errors=("le-connection-abort-by-local",) * 2), 247, 3, id="bleak-retries"
        ),
    ],
)
def test_a_sweep_is_complete_and_true(stage: Stage, faults: Faults, mtu: int, connects: int) -> None:
    robot = stage.robot(faults=faults, mtu=mtu)
    patience = ("--timeout", "0.2") if faults.lose_every else ()
    ran = stage.run([robot], *SWEEP, *patience, *QUICK)
    assert ran.code == 0, ran.err
    outcomes = never_wrong(ran, robot, stage)
    assert sorted(outcomes) == list(range(CIDS))
    assert "exists" in outcomes.values()
    assert rows_of(ran, "summary")[0]["complete"] is True
    assert len(stage.bluez.called("Connect")) >= connects


@pytest.mark.parametrize(
    ("profile", "faults", "code", "text"),
    [
        pytest.param({}, {"never_resolves": True}, 4, "services: ", id="services-never-resolve"),
        pytest.param(
            {}, {"drops_in_discovery": 9}, 4, "services: the robot dropped", id="drops-in-discovery"
        ),
        pytest.param({}, {"connect_hangs": True}, 4, "connect: no answer in time", id="connect-hangs"),
        pytest.param({}, {"connect_errors": ("Host is down",) * 9}, 4, "connect: ", id="never-connects"),
        pytest.param(
            {}, {"gone_after_scan": True}, 3, "connect: the robot is not there any more", id="gone-after-scan"
        ),
        pytest.param(
            {}, {"gone_at_connect": True}, 3, "connect: the robot is not there any more", id="gone-at-connect"
        ),
        pytest.param({"gate": True}, {"drop_at_write": 1}, 4, "handshake: the robot dropped", id="handshake"),
    ],
)
def test_what_passes_is_tried_three_times(
    stage: Stage, profile: dict[str, Any], faults: dict[str, Any], code: int, text: str
) -> None:
    robot = stage.robot("bolt", faults=Faults(**faults), **profile)
    ran = stage.run([robot], *INFO, *QUICK)
    said(ran, text, code=code)
    said(ran, "(3 attempts in ", code=code)
    if not faults.get("gone_after_scan"):
        assert len(stage.bluez.called("Connect")) == 3
    assert stage.executed == []


@pytest.mark.parametrize(
    ("profile", "faults", "texts"),
    [
        pytest.param(
            {"gate": True},
            {"missing": frozenset({V2_API})},
            ("services: ", "no Sphero API", "it has: Sphero V2 gate, Sphero V2 API"),
            id="characteristic-missing",
        ),
        *(
            pytest.param(
                {"gate": True},
                {"write_error": code},
                ("handshake: ", words, "it has: Sphero V2 gate, Sphero V2 API"),
                id=f"att-{code:02x}",
            )
            for code, words in (
                (0x03, "ATT error 0x03, write not permitted"),
                (0x05, "pairing (insufficient authentication"),
                (0x08, "ATT error 0x08, insufficient authorization"),
                (0x0E, "ATT error 0x0e, unlikely error"),
                (0x80, "ATT error 0x80"),
            )
        ),
    ],
)
def test_what_cannot_end_otherwise_is_tried_once(
    stage: Stage, profile: dict[str, Any], faults: dict[str, Any], texts: tuple[str, ...]
) -> None:
    ran = stage.run([stage.robot("bolt", faults=Faults(**faults), **profile)], *INFO, *QUICK)
    for text in texts:
        said(ran, text, code=4)
    assert len(stage.bluez.called("Connect")) == 1


def test_a_failing_subscription_names_the_step_and_the_services(stage: Stage) -> None:
    refused = BusFaults(
        errors={"StartNotify": ("org.bluez.Error.Failed", "Operation failed with ATT error: 0x11")}
    )
    ran = stage.run([stage.robot()], *INFO, *QUICK, faults=refused)
    said(ran, "notify: the robot refuses with ATT error 0x11, insufficient resource", code=4)
    said(ran, "it has: Sphero V2 API", code=4)


def test_verbose_tells_each_step_and_why_it_is_repeated(stage: Stage) -> None:
    robot = stage.robot(
        "bolt", gate=True, faults=Faults(connect_errors=("Page Timeout",), drops_in_discovery=1)
    )
    ran = stage.run([robot], *INFO, "-v", "--connect-timeout", "1")
    assert ran.code == 0, ran.err
    assert isinstance(robot.name, str)
    steps = [line.split(" s  ", 1)[1] for line in ran.err.splitlines()]
    assert steps[:3] == ["scan", "connect", "connect, attempt 2: connect: no answer in time"]
    assert "connect, attempt 3: services: the robot dropped the link" in steps
    assert steps[-6:-2] == ["services", "handshake", "notify", f"connected to {robot.name}"]
    assert steps[-2:] == ["wake", "first answer"]


def test_services_that_come_slowly_are_told_from_a_connection_that_does(stage: Stage) -> None:
    ran = stage.run([stage.robot(faults=Faults(never_resolves=True))], *INFO, "-v", *QUICK)
    steps = [line.split(" s  ", 1)[1] for line in ran.err.splitlines()[:-2]]
    again = "services: the robot is connected and does not tell which it has"
    assert steps == [
        *("scan", "connect", "services"),
        *(f"connect, attempt 2: {again}", "services"),
        *(f"connect, attempt 3: {again}", "services"),
    ]


def test_a_robot_that_drops_the_link_ends_listening(stage: Stage) -> None:
    robot = stage.robot(faults=Faults(drop_when_idle=0.1))
    ran = stage.run([robot], "listen", "-d", ADDRESS, "--seconds", "9", *QUICK)
    said(ran, "the robot closed the connection", code=4, hint=False)


def test_a_link_that_drops_under_a_single_command_ends_it(stage: Stage) -> None:
    ran = stage.run(
        [stage.robot(faults=Faults(drop_at_write=1))], "send", "0x13", "0x10", "-d", ADDRESS, *QUICK
    )
    said(ran, "the link to the robot is lost (write: the robot dropped the link)", code=4)
    assert stage.executed == []


@pytest.mark.parametrize(
    "faults",
    [
        pytest.param({"most_connections": 1}, id="does-not-let-connect-again"),
        pytest.param({"gone_after_drop": True}, id="out-of-range"),
    ],
)
def test_a_link_lost_for_good_keeps_what_was_found(
    stage: Stage, monkeypatch: pytest.MonkeyPatch, faults: dict[str, Any], tmp_path: Path
) -> None:
    monkeypatch.setattr("sphero_probe.session.reconnect.PAUSES", (0.0, 0.0))
    robot = stage.robot(faults=Faults(drop_at_write=40, **faults))
    journal = tmp_path / "run.jsonl"
    ran = stage.run([robot], *SWEEP, "--journal", str(journal), *QUICK)
    said(ran, "did not come back", code=4)
    assert "resume: sphero-probe sweep --resume" in ran.err
    outcomes = never_wrong(ran, robot, stage)
    assert 0 < len(outcomes) < CIDS
    assert "exists" in outcomes.values()
    assert rows_of(ran, "summary")[0]["complete"] is False
    kept = [json.loads(line) for line in Path(journal).read_text().splitlines()]
    assert {line["cid"] for line in kept if line.get("type") == "finding"} == set(outcomes)


def test_a_bus_that_dies_in_a_sweep_ends_it(stage: Stage) -> None:
    robot = stage.robot()
    ran = stage.run([robot], *SWEEP, *QUICK, faults=BusFaults(hangs_up_at="WriteValue"))
    said(ran, "did not come back", code=4)
    never_wrong(ran, robot, stage)
    assert rows_of(ran, "summary")[0]["complete"] is False


def test_a_robot_that_is_never_heard_makes_no_finding_wrong(stage: Stage) -> None:
    robot = stage.robot(faults=Faults(lose_every=1))
    cids = ("sweep", "--did", "0x13", "--cid", "0x03-0x05", "--format", "jsonl", "-d", ADDRESS)
    ran = stage.run([robot], *cids, "--timeout", "0.02", *QUICK)
    outcomes = never_wrong(ran, robot, stage)
    assert not {"exists", "absent"} & set(outcomes.values())
    assert ran.code != 70


@pytest.mark.parametrize("mtu", [23, 100, 247])
def test_a_long_frame_goes_out_in_slices_that_fit(stage: Stage, mtu: int) -> None:
    robot = stage.robot("bolt-plus?strict=none", mtu=mtu)
    payload = bytes(range(1, 0x8D)) + bytes(range(1, 105))
    assert len(payload) == 244
    ran = stage.run([robot], "send", "0x10", "0x00", payload.hex(), "-d", ADDRESS, "--json", *QUICK)
    assert ran.code == 0, ran.err
    assert [command.payload for command in stage.executed] == [payload]
    slices = [data for uuid, data in robot.written if uuid == V2_API]
    assert {len(data) for data in slices[:-1]} == {mtu - 3}
    assert 0 < len(slices[-1]) <= mtu - 3
    assert payload in b"".join(slices)


@pytest.mark.parametrize(
    ("chosen", "used"), [((), {"hci0", "hci1"}), (("--adapter", "hci1"), {"hci1"})], ids=["any", "hci1"]
)
def test_the_adapter_that_was_chosen_is_used(stage: Stage, chosen: tuple[str, str], used: set[str]) -> None:
    robot = stage.robot()
    two = (Adapter("hci0"), Adapter("hci1", address="00:1A:7D:DA:71:14"))
    ran = stage.run([robot], "send", "0x13", "0x10", "-d", ADDRESS, *chosen, *QUICK, adapters=two)
    assert ran.code == 0, ran.err
    calls = [call for member in ("StartDiscovery", "Connect") for call in stage.bluez.called(member)]
    assert {call.path.split("/")[3] for call in calls} <= used
    assert len(calls) == 2


def test_what_bleak_repeats_by_itself_is_no_lost_link(stage: Stage) -> None:
    robot = stage.robot(faults=Faults(connect_errors=("le-connection-abort-by-local",) * 2))
    ran = stage.run([robot], "send", "0x13", "0x10", "-d", ADDRESS, *QUICK)
    assert ran.code == 0, ran.err
    assert len(stage.bluez.called("Connect")) == 3


def test_a_robot_that_vanished_is_not_replaced_by_another(stage: Stage) -> None:
    lost = stage.robot(faults=Faults(gone_at_connect=True, gone_after_drop=True))
    other = stage.robot("bolt", "AA:BB:CC:DD:EE:02", gate=True)

    def bring_another(bluez: FakeBlueZ) -> None:
        look = threading.Event()
        while not bluez.called("Connect") and not look.wait(0.002):
            pass
        bluez.add(other)

    ran = stage.run([lost], "info", *QUICK, meanwhile=bring_another)
    said(ran, f"no robot '{ADDRESS}' was heard", code=3)
    assert other.written == []


def test_the_phrase_goes_out_whole(stage: Stage) -> None:
    robot = stage.robot("bolt", gate=True, mtu=23)
    ran = stage.run([robot], "send", "0x13", "0x03", "-d", ADDRESS, *QUICK)
    assert ran.code == 0, ran.err
    assert [len(data) for uuid, data in robot.written if uuid == V2_GATE] == [PHRASE_SIZE]
