"""Where journals and the last scan are kept, on Linux and macOS, and what was kept elsewhere before.

The paths of macOS come from platformdirs' own class for it.
"""

import os
import pwd
from collections.abc import Callable
from pathlib import Path

import pytest
from platformdirs.macos import MacOS

from sphero_probe.cli.complete.last_scan import cache_file, recall
from sphero_probe.errors import BadInputFileError, OutputError
from sphero_probe.runs.folders import cache_folder, former_state_folder, state_folder
from sphero_probe.runs.store import find_journal, journal_files, runs_folder
from tests.support.cli import Cli

FOLDERS: dict[str, Callable[[], Path]] = {"XDG_STATE_HOME": state_folder, "XDG_CACHE_HOME": cache_folder}
USUAL = {"XDG_STATE_HOME": ".local/state/sphero-probe", "XDG_CACHE_HOME": ".cache/sphero-probe"}
SWEEP = ("sweep", "--did", "0x13", "--cid", "0x10", "--device", "fake:bolt-plus")


@pytest.fixture
def home(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A home folder, and no XDG variable."""
    for variable in FOLDERS:
        monkeypatch.delenv(variable)
    monkeypatch.setenv("HOME", str(tmp_path))
    return tmp_path


@pytest.fixture
def mac_home(home: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The same as macOS sees it."""
    mac = MacOS("sphero-probe", appauthor=False)
    monkeypatch.setattr("platformdirs.user_state_path", lambda *_, **__: mac.user_state_path)
    monkeypatch.setattr("platformdirs.user_cache_path", lambda *_, **__: mac.user_cache_path)
    return home


@pytest.mark.parametrize("variable", FOLDERS)
def test_an_absolute_xdg_folder_decides(variable: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(variable, "/x")
    assert FOLDERS[variable]() == Path("/x/sphero-probe")


@pytest.mark.parametrize("value", [None, "", "not/absolute"])
@pytest.mark.parametrize("variable", FOLDERS)
def test_otherwise_it_is_the_usual_folder(
    variable: str, value: str | None, home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if value is not None:
        monkeypatch.setenv(variable, value)
    assert FOLDERS[variable]() == home / USUAL[variable]
    assert former_state_folder() is None


def test_macos_has_its_own_folders(mac_home: Path) -> None:
    assert runs_folder() == mac_home / "Library/Application Support/sphero-probe/runs"
    assert cache_file() == mac_home / "Library/Caches/sphero-probe/last_scan.json"


def test_xdg_decides_on_macos_too(mac_home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(mac_home / "x"))
    assert runs_folder() == mac_home / "x" / "sphero-probe" / "runs"
    assert former_state_folder() is None


def test_runs_in_the_former_folder_are_found_on_macos(mac_home: Path, cli: Cli) -> None:
    assert cli(*SWEEP).code == 0
    (run,) = journal_files()
    former = mac_home / ".local/state/sphero-probe/runs"
    former.mkdir(parents=True)
    moved = run.rename(former / "older.jsonl")
    os.utime(moved, ns=(1, 1))
    assert find_journal("older") == moved
    assert cli("report", "last", "--format", "jsonl").code == 0
    assert cli(*SWEEP).code == 0
    newer, older = journal_files()
    assert newer.parent == runs_folder()
    assert (older, find_journal("last")) == (moved, newer)
    assert cli("runs").out.count("\tsweep\tsweep\t") == 2


def test_without_a_home_nothing_is_kept(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_user(_number: int) -> None:
        raise KeyError

    monkeypatch.delenv("HOME")
    monkeypatch.setattr(pwd, "getpwuid", no_user)
    assert home
    with pytest.raises(OutputError, match="home"):
        runs_folder()
    with pytest.raises(OutputError):
        find_journal("last")
    assert cache_file() is None
    assert recall() == []
    assert former_state_folder() is None


def test_a_folder_that_cannot_be_read_is_named(home: Path) -> None:
    runs_folder().parent.mkdir(parents=True)
    runs_folder().touch()
    with pytest.raises(BadInputFileError, match=str(home)):
        journal_files()


def test_a_folder_that_platformdirs_leaves_relative_is_not_used(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("platformdirs.user_state_path", lambda *_, **__: Path("~/.local/state/sphero-probe"))
    monkeypatch.chdir(home)
    with pytest.raises(OutputError, match="home"):
        runs_folder()
