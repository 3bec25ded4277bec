"""Strangers swept through unpatched bleak: the command line is as harmless and true as the engine alone."""

from pathlib import Path

import pytest

from tests.support.cli import Cli
from tests.support.fake_bluez_stage import Stage
from tests.support.strangers.air import sweep_on_air
from tests.support.strangers.habits import STRANGERS
from tests.support.strangers.judge import judge

BY_NAME = {stranger.name: stranger for stranger in STRANGERS}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "dids", "codes"),
    [
        ("plain r2", "0x13,0x18", {0}),
        ("plain bb-8", "0x00,0x02", {0}),
        ("setters ignore surplus", "0x13,0x16,0x1a", {0, 5}),
        ("the unknown ignore surplus", "0x13,0x18", {0, 5}),
        ("masks everywhere", "0x13,0x1a", {0}),
        ("number 0 answers", "0x13", {4}),
        ("one command late by 0.6 s", "0x13", {0}),
        ("answers twice", "0x13", {0}),
        ("answers out of order", "0x13", {0}),
        ("no end byte", "0x13", {0}),
        ("byte by byte", "0x13", {0}),
        ("2 kB answer", "0x11,0x13", {0}),
        ("floods", "0x13", {0}),
    ],
)
def test_a_sweep_over_the_air_is_harmless_and_true(
    name: str, dids: str, codes: set[int], cli: Cli, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    ran, ended = sweep_on_air(BY_NAME[name], dids, Stage(cli, monkeypatch), tmp_path)
    assert ended.code in codes, ended.err
    offences = {check: found for check, found in judge([ran]).items() if found}
    assert {check: found[:5] for check, found in offences.items()} == {}
    assert ran.robot.heard
    assert ran.findings or 4 in codes
