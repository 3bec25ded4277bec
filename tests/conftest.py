"""Fixtures that several test files share."""

import gc
import importlib
import itertools
import pkgutil
import sys
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from hypothesis import settings

import sphero_probe
from sphero_probe.cli.invoke import run
from tests.support.cli import Cli, Ran

settings.register_profile("suite", deadline=None, max_examples=40)
settings.load_profile("suite")


LEFT_OUT = ("sphero_probe.__main__", "sphero_probe.fleet.dask.")
"""Modules that are not imported before all tests: the program, and what takes a second and an extra."""


@pytest.fixture
def cli(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Cli:
    """Run the command line in this process and tell how it ended."""
    for name in ("SPHERO_PROBE_DEVICE", "FORCE_COLOR", "NO_COLOR", "COLUMNS", "LC_ALL", "LC_CTYPE", "LANG"):
        monkeypatch.delenv(name, raising=False)

    def ran(*arguments: str) -> Ran:
        capsys.readouterr()
        code = run(arguments)
        out, err = capsys.readouterr()
        return Ran(code, out, err)

    return ran


@pytest.fixture
def limited() -> Iterator[None]:
    """End the test in time, also where the bus never answers."""
    from tests.support.fake_bluez_stage import PATIENCE, limit

    with limit(PATIENCE):
        yield


@pytest.fixture(scope="session")
def _homes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Folders that are not there yet, one for each test: most never look at theirs."""
    base = tmp_path_factory.mktemp("homes")
    return (base / str(number) for number in itertools.count())


@pytest.fixture(autouse=True)
def _home(_homes: Iterator[Path], monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep journals and the last scan away from the real home."""
    home = next(_homes)
    monkeypatch.setenv("XDG_STATE_HOME", str(home / "state"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(home / "cache"))


@contextmanager
def _unmeasured() -> Iterator[None]:
    """Run something without a trace function.

    ``no_cover`` of pytest-cov does not do it: pytest-cov measures a worker of xdist, and so does coverage
    itself, which is told to measure every process that is started here.
    """
    trace = sys.gettrace()
    sys.settrace(None)
    try:
        yield
    finally:
        sys.settrace(trace)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Import the whole tool, for coverage must see it whichever test comes first; then collect the tests."""
    for module in pkgutil.walk_packages(sphero_probe.__path__, "sphero_probe."):
        if not module.name.startswith(LEFT_OUT):
            importlib.import_module(module.name)
    with _unmeasured():
        return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, None, None]:
    """Look away from what is marked ``unmeasured``."""
    if item.get_closest_marker("unmeasured") is None:
        return (yield)
    with _unmeasured():
        return (yield)


def pytest_collection_finish() -> None:
    """Spare the garbage collector the collected tests."""
    _spare_what_stays()


def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> None:
    """Spare the garbage collector what a finished file has loaded for good."""
    if nextitem and nextitem.path != item.path:
        _spare_what_stays()


def _spare_what_stays() -> None:
    """Make full collections quick, for the virtual clock calls one at the end of every run."""
    gc.collect()
    gc.freeze()
