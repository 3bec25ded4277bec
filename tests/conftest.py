"""Fixtures that several test files share."""

import gc
from collections.abc import Callable
from typing import NamedTuple

import pytest
from hypothesis import settings

from sphero_probe.cli.failures import run

settings.register_profile("suite", deadline=None, max_examples=40)
settings.load_profile("suite")


class Ran(NamedTuple):
    code: int
    out: str
    err: str


Cli = Callable[..., Ran]


@pytest.fixture
def cli(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Cli:
    """Run the command line in this process and tell how it ended."""
    for name in ("SPHERO_PROBE_DEVICE", "FORCE_COLOR", "NO_COLOR", "COLUMNS"):
        monkeypatch.delenv(name, raising=False)

    def ran(*arguments: str) -> Ran:
        capsys.readouterr()
        code = run(arguments)
        out, err = capsys.readouterr()
        return Ran(code, out, err)

    return ran


@pytest.fixture(autouse=True)
def _state_folder(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep journals away from the real home."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))


def pytest_collection_finish() -> None:
    """Spare the garbage collector the thousands of collected tests: the virtual clock calls it often."""
    gc.collect()
    gc.freeze()
