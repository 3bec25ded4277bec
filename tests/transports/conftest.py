"""Fixtures for the tests of the transports."""

import pytest

from tests.support.cli import Cli
from tests.support.fake_bluez_stage import Stage


@pytest.fixture
def stage(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> Stage:
    """Robots on a fake BlueZ, to which the command line connects without a pause between two tries."""
    monkeypatch.setattr("sphero_probe.transports.ble.connection._PAUSES", (0.0, 0.0))
    return Stage(cli, monkeypatch)
