"""``fleet sweep`` with plans that differ for each robot: what a library claims, and what a capture holds."""

from pathlib import Path
from typing import Any

import pytest

from sphero_probe.cli.actions.sweep import SweepOptions
from sphero_probe.cli.fleet_plans import ANY, sweep_plans
from sphero_probe.fleet.plans import PlanAction
from sphero_probe.protocol.packets import Generation
from tests.support.captures import CAPTURES
from tests.support.cli import Cli, objects

ONE, OTHER, OLD = "fake:bolt?seed=1", "fake:rvr?seed=3", "fake:bb8?seed=2"


def devices(*addresses: str) -> tuple[str, ...]:
    return tuple(word for address in addresses for word in ("--device", address))


def asked_of_each(cli: Cli, *arguments: str) -> dict[str, set[tuple[int, int]]]:
    """Run ``fleet sweep``; device -> the pairs in its journal."""
    ran = cli("fleet", "sweep", *arguments, "--format", "jsonl")
    assert ran.code == 0, ran.err
    rows = [row for row in objects(ran.out) if row["type"] == "fleet_robot"]
    return {row["device"]: _findings(row["journal"]) for row in rows}


def asked_alone(cli: Cli, device: str, journal: Path, *arguments: str) -> set[tuple[int, int]]:
    ran = cli("sweep", *arguments, "--device", device, "--journal", str(journal))
    assert ran.code == 0, ran.err
    return _findings(str(journal))


def _findings(journal: str) -> set[tuple[int, int]]:
    lines: list[dict[str, Any]] = objects(Path(journal).read_text(encoding="utf-8"))
    return {(line["did"], line["cid"]) for line in lines if line["type"] == "finding"}


@pytest.fixture
def capture(tmp_path: Path) -> str:
    """What apps were seen to send, to robots of both protocols."""
    path = tmp_path / "btsnoop_hci.log"
    path.write_bytes(CAPTURES["btsnoop 1002"]())
    return str(path)


def test_each_robot_is_asked_what_the_library_claims_for_its_model(cli: Cli, tmp_path: Path) -> None:
    plan = ("--plan", "spherov2-claims")
    asked = asked_of_each(cli, *plan, *devices(ONE, OTHER, OLD))
    assert asked == {
        device: asked_alone(cli, device, tmp_path / f"{number}.jsonl", *plan)
        for number, device in enumerate((ONE, OTHER, OLD))
    }
    assert len(set(map(frozenset, asked.values()))) == 3


def test_each_robot_is_asked_what_the_capture_holds_of_its_protocol(
    cli: Cli, capture: str, tmp_path: Path
) -> None:
    plan = ("--plan-from", capture)
    asked = asked_of_each(cli, *plan, *devices(ONE, OTHER, OLD))
    assert asked[ONE] == asked[OTHER] == asked_alone(cli, ONE, tmp_path / "one.jsonl", *plan)
    assert asked[OLD] == asked_alone(cli, OLD, tmp_path / "old.jsonl", *plan)
    assert asked[OLD]
    assert asked[OLD] != asked[ONE]


def test_a_worker_needs_no_copy_of_the_capture(capture: str) -> None:
    """Dask sends the action to workers, where the file is not."""
    pickle = pytest.importorskip("distributed.protocol.pickle", reason="the extra dask")
    plans = sweep_plans(SweepOptions(None, None, None, None, capture))
    wanted = {generation: plans(ANY._replace(generation=generation)) for generation in Generation}
    sent = pickle.dumps(PlanAction("sweep", plans))
    Path(capture).unlink()
    arrived = pickle.loads(sent)
    for generation, plan in wanted.items():
        assert arrived.plan_for(ANY._replace(generation=generation)) == plan


def test_resume_finishes_a_run_of_a_capture(cli: Cli, capture: str) -> None:
    gone = f"{ONE}&disconnect_after=2"
    arguments = ("fleet", "sweep", "--plan-from", capture, *devices(gone, OTHER), "--format", "jsonl")
    first, second = cli(*arguments), cli(*arguments, "--resume")
    assert first.code == 5
    journals = [{row["journal"] for row in objects(ran.out) if "journal" in row} for ran in (first, second)]
    assert journals[0] == journals[1]


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        pytest.param(("--plan-from", "no-such-file"), 8, "no-such-file", id="no file"),
        pytest.param(("--plan-from", "x", "--did", "0x13"), 2, "cannot be combined", id="and --did"),
        pytest.param(("--plan", "spherov2-claims", "--did", "0x13"), 2, "cannot be combined", id="claims"),
        pytest.param(("--plan", "other-claims"), 8, "no such plan", id="another library"),
    ],
)
def test_a_mistake_shows_before_anything_is_connected(
    cli: Cli, tmp_path: Path, arguments: tuple[str, ...], code: int, said: str
) -> None:
    ledger = tmp_path / "ledger"
    ran = cli("fleet", "sweep", *arguments, *devices(f"{ONE}&ledger={ledger}", OTHER))
    assert (ran.code, said in ran.err.splitlines()[0]) == (code, True), ran.err
    assert not ledger.exists()


def test_a_robot_that_the_library_does_not_know_is_told_and_the_others_are_asked(cli: Cli) -> None:
    new = "fake:bolt-plus"
    ran = cli("fleet", "sweep", "--plan", "spherov2-claims", *devices(new, OTHER), "--format", "jsonl")
    assert ran.code == 5
    told = {row["device"]: row for row in objects(ran.out) if row["type"] == "fleet_robot"}
    assert {device: row["status"] for device, row in told.items()} == {new: "failed", OTHER: "done"}
    assert "has no bolt-plus" in told[new]["trouble"]
