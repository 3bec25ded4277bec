"""Commands that are only assumed to be absent: what is sent to a robot that has one after all."""

from pathlib import Path

import pytest

from sphero_probe.catalogue.risk import Risk
from sphero_probe.simulator.firmware import Firmware, FirmwareCommand, Lengths
from tests.support.cli import Cli, objects

ASSUMED = [
    pytest.param(0x13, 0xFD, id="a command id far from any"),
    pytest.param(0x10, 0xFB, id="another"),
    pytest.param(0xEE, 0x00, id="a device id far from any"),
]


@pytest.fixture
def ledger(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A robot that has the command, without arguments; what it executes is in the file."""
    did, cid = request.node.callspec.params["did"], request.node.callspec.params["cid"]
    real = Firmware.find

    def find(firmware: Firmware, node: int, did_: int, cid_: int) -> FirmwareCommand | None:
        if (did_, cid_) == (did, cid):
            return FirmwareCommand(node, did, cid, Lengths(0, 0), Risk.BRICK)
        return real(firmware, node, did_, cid_)

    monkeypatch.setattr(Firmware, "find", find)
    monkeypatch.setattr(Firmware, "has_device", lambda *_: True)
    return tmp_path / "ledger"


def executed(ledger: Path) -> list[tuple[int, int, str]]:
    ran = objects(ledger.read_text()) if ledger.exists() else []
    return [(one["did"], one["cid"], one["risk"]) for one in ran if one["risk"] != "read"]


@pytest.mark.parametrize(("did", "cid"), ASSUMED)
def test_send_does_not_run_it_without_consent(cli: Cli, ledger: Path, did: int, cid: int) -> None:
    pair, device = (hex(did), hex(cid)), ("--device", f"fake:bolt?ledger={ledger}")
    for more in ((), ("--dry-run",)):
        ran = cli("send", *pair, *device, *more)
        assert ran.code == (0 if more else 6)
        assert "unknown command without payload, which may run it" in ran.out + ran.err
    assert executed(ledger) == []


@pytest.mark.parametrize(("did", "cid"), ASSUMED)
def test_consent_allows_it(cli: Cli, ledger: Path, did: int, cid: int) -> None:
    allow = ("--allow", "persist", "--allow", "brick", "--confirm", "SB-DE8E")
    cli("send", hex(did), hex(cid), "--device", f"fake:bolt?ledger={ledger}", *allow)
    assert executed(ledger) == [(did, cid, "brick")]


@pytest.mark.parametrize(("did", "cid"), ASSUMED)
def test_a_run_that_meets_it_does_not_run_it(cli: Cli, ledger: Path, did: int, cid: int) -> None:
    ran = cli("sweep", "--did", hex(did), "--cid", "0xf0-0xff,0x00", "--device", f"fake:bolt?ledger={ledger}")
    assert ran.code in (0, 5)
    assert executed(ledger) == []


def test_an_exact_plan_of_nothing_else_sends_none(cli: Cli, tmp_path: Path) -> None:
    (tmp_path / "plan.py").write_text(
        "from sphero_probe import Command, Plan, Probe\n\n"
        'PLAN = Plan("far", "", [[Probe(Command(0x13, cid), exact=True) for cid in (0xFB, 0xFC, 0xFD)]])\n'
    )
    run = ("sweep", "--plan", str(tmp_path / "plan.py"), "--device", "fake:bolt", "--format", "jsonl")
    findings = [row for row in objects(cli(*run).out) if row["type"] == "finding"]
    assert [row["outcome"] for row in findings] == ["skipped"] * 3
    assert all(row["withheld"] for row in objects(cli(*run, "--dry-run").out))


@pytest.mark.parametrize("did", ["0x11", "0x1a"])
def test_a_device_whose_empty_commands_erase_is_still_found_strict(cli: Cli, did: str) -> None:
    rows = objects(cli("sweep", "--did", did, "--device", "fake:bolt", "--format", "jsonl").out)
    assert rows[-1]["strictness"] == {"primary": "strict"}


def test_a_dry_run_of_the_evidence_shows_each_pair_at_a_wrong_length_first(cli: Cli) -> None:
    out = cli("evidence", "--device", "fake:bolt", "--dry-run").out
    rows = [line.split("\t") for line in out.splitlines()]
    for pair in (["0xee", "0x00"], ["0x10", "0xfd"]):
        assert [row[6] for row in rows if row[2:4] == pair] == ["00 " * 10 + "00", ""]
    assert {row[5] for row in rows} == {"read", "probe"}
