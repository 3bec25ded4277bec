"""``fleet sweep`` and ``fleet discover`` with ``--dry-run``: for each robot, what it would get alone."""

from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from tests.support.cli import Cli, Ran, objects

ROBOTS = ("fake:bolt", "fake:bolt-plus?seed=4", "fake:rvr", "fake:r2d2", "fake:bb8")
NAMED = "SB-DE8E"
"""The name of ``fake:bolt``."""


def devices(*addresses: str) -> tuple[str, ...]:
    return tuple(word for address in addresses for word in ("--device", address))


def planned(ran: Ran) -> dict[str, dict[str, Any]]:
    """Device -> its row."""
    return {row["device"]: row for row in objects(ran.out) if row["type"] == "fleet_planned"}


def withheld(ran: Ran) -> Counter[tuple[str, int, int, str]]:
    """Count name, DID, CID and class of each command that is blocked on a robot."""
    return Counter(
        (name, command["did"], command["cid"], row["risk"])
        for row in objects(ran.out)
        if row["type"] == "fleet_withheld"
        for name in row["robots"]
        for command in row["commands"]
    )


@pytest.mark.parametrize(
    "asked",
    [
        pytest.param(("sweep", "--did", "0x13"), id="sweep"),
        pytest.param(("sweep", "--did", "0x10-0x1b", "--allow", "motion"), id="motion allowed"),
        pytest.param(("sweep", "--plan", "self_description"), id="plan"),
        pytest.param(("sweep", "--did", "0x13", "--payload", ""), id="payload"),
        pytest.param(("discover", "--lengths"), id="discover"),
        pytest.param(("led", "--off"), id="led"),
    ],
)
def test_it_says_of_each_robot_what_a_dry_run_of_that_robot_says(cli: Cli, asked: tuple[str, ...]) -> None:
    ran = cli("fleet", *asked, *devices(*ROBOTS), "--dry-run", "--format", "jsonl")
    assert ran.code == 0, ran.err
    assert list(planned(ran)) == list(ROBOTS)
    blocked: Counter[tuple[str, int, int, str]] = Counter()
    for device, row in planned(ran).items():
        alone = cli(*asked, "--device", device, "--dry-run", "--format", "jsonl")
        probes = objects(alone.out)
        assert row["sent"] == Counter(probe["risk"] for probe in probes if not probe["withheld"])
        assert row["withheld"] == Counter(probe["risk"] for probe in probes if probe["withheld"])
        assert all(f"({', '.join(row['following'])})" in alone.err for _ in row["following"][:1])
        blocked.update(
            (row["name"], probe["did"], probe["cid"], probe["risk"]) for probe in probes if probe["withheld"]
        )
    assert withheld(ran) == blocked


def test_each_robot_would_be_lit(cli: Cli) -> None:
    asked = ("fleet", "led", "--dry-run", "--format", "jsonl")
    ran = cli(*asked, *devices("fake:bolt", "fake:rvr", "AA:BB:CC:DD:EE:FF"))
    assert ran.code == 0, ran.err
    assert [row["sent"] for row in planned(ran).values()] == [{"write": 1}, {"write": 1}, {}]
    assert "known once the robot is connected" in planned(ran)["AA:BB:CC:DD:EE:FF"]["trouble"]
    ran = cli(*asked, "--led", "left_headlight=00f", *devices("fake:bolt", "fake:rvr"))
    assert (ran.code, "1 of 2 robots cannot be asked: fake:bolt (no LED" in ran.err) == (5, True)


def test_evidence_of_each_robot_is_planned(cli: Cli, tmp_path: Path) -> None:
    folder = ("--folder", str(tmp_path / "new"))
    ran = cli(
        "fleet", "evidence", *devices("fake:bolt", "fake:bb8"), *folder, "--dry-run", "--format", "jsonl"
    )
    assert ran.code == 0, ran.err
    for device, row in planned(ran).items():
        alone = cli("evidence", "--device", device, "--dry-run").out.splitlines()
        assert row["sent"] == Counter(line.split("\t")[5] for line in alone)
    assert not (tmp_path / "new").exists()


def test_it_touches_nothing(cli: Cli, tmp_path: Path) -> None:
    ledgers = [tmp_path / name for name in ("one", "two")]
    names = [f"fake:bolt?seed={number}&ledger={path}" for number, path in enumerate(ledgers)]
    cli("runs")
    before = set(tmp_path.rglob("*"))
    for asked in (("sweep", "--did", "0x13"), ("discover",)):
        ran = cli("fleet", *asked, *devices(*names), "--dry-run")
        assert (ran.code, "nothing is sent" in ran.err) == (0, True)
    assert set(tmp_path.rglob("*")) == before


def test_a_real_run_sends_no_class_that_the_dry_run_does_not_name(cli: Cli) -> None:
    asked = ("fleet", "sweep", "--did", "0x13,0x1a", *devices("fake:bolt", "fake:rvr"), "--format", "jsonl")
    dry, real = cli(*asked, "--dry-run"), cli(*asked)
    journals = {row["device"]: row["journal"] for row in objects(real.out) if row["type"] == "fleet_robot"}
    for device, row in planned(dry).items():
        lines = objects(Path(journals[device]).read_text(encoding="utf-8"))
        found = {line["number"]: line for line in lines if line["type"] == "finding"}.values()
        skipped = Counter(line["risk"] for line in found if line["outcome"] == "skipped")
        assert skipped == row["withheld"]
        assert len(found) - skipped.total() == sum(row["sent"].values())


def test_models_are_told_by_name_address_or_file(cli: Cli, tmp_path: Path) -> None:
    file = tmp_path / "class.toml"
    file.write_text(
        '[[robot]]\nname = "RV-12AB"\naddress = "AA:BB:CC:DD:EE:01"\nlabel = "table 3"\n'
        '[[robot]]\naddress = "AA:BB:CC:DD:EE:02"\n[[robot]]\nname = "BB-1A2B"\n',
        encoding="utf-8",
    )
    ran = cli("fleet", "sweep", "--did", "0x13", "--robots", str(file), "--dry-run", "--format", "jsonl")
    rows = [(row["name"], row["model"], row["generation"]) for row in planned(ran).values()]
    assert rows == [
        ("RV-12AB", "Sphero RVR", "v2"),
        ("AA:BB:CC:DD:EE:02", None, "v2"),
        ("BB-1A2B", "BB-8", "v1"),
    ]
    assert planned(ran)["AA:BB:CC:DD:EE:01"]["label"] == "table 3"
    table = cli("fleet", "sweep", "--did", "0x13", "--robots", str(file), "--dry-run", "--format", "table")
    assert "not known yet" in table.out
    assert "\nBlocked\n" in table.out


def test_a_command_that_all_robots_lack_consent_for_is_listed_once(cli: Cli) -> None:
    asked = ("fleet", "sweep", "--did", "0x13", "--cid", "0x00-0x02")
    ran = cli(*asked, *devices("fake:bolt", "fake:rvr"), "--dry-run", "--format", "jsonl")
    rows = [row for row in objects(ran.out) if row["type"] == "fleet_withheld"]
    assert [(row["risk"], row["everywhere"], len(row["commands"])) for row in rows] == [
        ("motion", True, 1),
        ("brick", True, 1),
    ]
    table = cli(*asked, *devices("fake:bolt", "fake:rvr"), "--dry-run", "--format", "table").out
    assert table.count("power.sleep") == 1
    assert "all" in table.split("power.sleep")[1].splitlines()[0]


@pytest.mark.parametrize(
    ("confirm", "code", "sent"),
    [
        pytest.param((), 0, [{"read": 2}, {"read": 2}], id="nobody: shown as blocked"),
        pytest.param((NAMED,), 6, [{"read": 2, "brick": 1}, {}], id="one: the other would be refused"),
        pytest.param((NAMED, "RV-B9D8"), 0, [{"read": 2, "brick": 1}] * 2, id="both"),
    ],
)
def test_brick_needs_each_name_as_in_a_run(
    cli: Cli, confirm: tuple[str, ...], code: int, sent: list[dict[str, int]]
) -> None:
    words = tuple(word for name in confirm for word in ("--confirm", name))
    asked = ("fleet", "sweep", "--did", "0x13", "--cid", "0x00,0x03,0x04", "--allow", "brick", *words)
    ran = cli(*asked, *devices("fake:bolt", "fake:rvr"), "--dry-run", "--format", "jsonl")
    assert ran.code == code, ran.err
    assert [row["sent"] for row in planned(ran).values()] == sent
    if code:
        assert "1 of 2 robots would be refused: fake:rvr (the class brick is not confirmed" in ran.err
        assert cli(*asked, *devices("fake:bolt", "fake:rvr")).code == code


def test_a_plan_that_cannot_be_made_for_a_robot_is_told(cli: Cli) -> None:
    asked = ("fleet", "sweep", "--plan", "spherov2-claims", *devices("fake:bolt-plus", "fake:rvr"))
    ran = cli(*asked, "--dry-run", "--format", "jsonl")
    assert ran.code == 5
    rows = planned(ran)
    assert "has no bolt-plus" in rows["fake:bolt-plus"]["trouble"]
    assert rows["fake:rvr"]["sent"]
    assert "1 of 2 robots cannot be asked" in ran.err


@pytest.mark.parametrize("option", ["--resume", "--matrix"])
def test_what_makes_no_sense_with_it_is_a_usage_error(cli: Cli, option: str) -> None:
    ran = cli("fleet", "sweep", "--did", "0x13", *devices("fake:bolt"), "--dry-run", option)
    assert (ran.code, f"--dry-run cannot be combined with {option}" in ran.err) == (2, True)


@pytest.mark.parametrize("form", ["table", "plain", "json", "csv", "md", "html"])
def test_every_format_shows_it(cli: Cli, form: str) -> None:
    asked = ("fleet", "sweep", "--did", "0x13", *devices("fake:bolt", "fake:rvr"), "--dry-run")
    out = cli(*asked, "--format", form).out
    assert "Sphero RVR" in out
    assert "228" in out
    assert ("power.sleep" in out) is (form not in ("plain", "csv"))
