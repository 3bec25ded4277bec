"""The architecture: layers import one way, and commands that must start quickly import little."""

import subprocess
import sys
from pathlib import Path

import pytest
from importlinter.cli import lint_imports

from sphero_probe import __version__
from sphero_probe.catalogue.risk import Risk
from sphero_probe.cli import values
from sphero_probe.cli.group import COMMANDS, LazyGroup, group
from sphero_probe.reports.registry import FORMATS
from sphero_probe.reports.selection import SORTS
from tests.support.cli import Cli

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "sphero_probe"


def test_layers_import_one_way(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(ROOT)
    assert lint_imports(cache_dir=None) == 0, capsys.readouterr().out


def imported_by(*arguments: str) -> set[str]:
    code = f"import sys; sys.argv = ['sphero-probe', *{arguments!r}]\n"
    code += "from sphero_probe.cli import main\ntry: main()\nexcept SystemExit: pass\n"
    code += "print('\\n'.join(['IMPORTED', *sys.modules]))"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(ran.stdout.split("IMPORTED\n")[1].split())


def test_a_sweep_of_a_fake_needs_no_bleak() -> None:
    assert "bleak" not in imported_by("explain", "0x05")
    assert "bleak" not in imported_by("sweep", "--did", "0x13", "--device", "fake:bolt", "--format", "plain")


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_has_help_with_an_example(cli: Cli, name: str) -> None:
    assert isinstance(group, LazyGroup)
    ran = cli(name, "--help")
    assert ran.code == 0
    assert COMMANDS[name].rstrip(".").split()[0] in ran.out or name == "plan"
    if name != "plan":
        assert f"Example: sphero-probe {name}" in ran.out


def test_the_light_copies_of_words_agree_with_their_homes() -> None:
    assert tuple(FORMATS) == values.FORMATS
    assert tuple(risk.word for risk in Risk) == values.RISKS
    assert values.SORTS == SORTS


def test_version(cli: Cli, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli("--version").out == f"sphero-probe {__version__}\n"


def test_above_the_catalogue_nobody_asks_which_generation() -> None:
    for layer in ("link", "probing", "reports"):
        for file in (PACKAGE / layer).rglob("*.py"):
            assert "Generation.V" not in file.read_text(encoding="utf-8"), file


def test_modules_stay_small() -> None:
    for file in PACKAGE.rglob("*.py"):
        if file != PACKAGE / "reports" / "views.py":  # a table of columns
            assert len(file.read_text(encoding="utf-8").splitlines()) <= 300, file
