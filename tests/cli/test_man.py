"""The man pages are made from the commands: every command has its page, and the page its options."""

import re
import shutil
import subprocess
from collections.abc import Iterator
from importlib.metadata import entry_points
from pathlib import Path

import click
import pytest
from click_man.shell import cli as click_man

from sphero_probe import __version__, cli
from sphero_probe.cli.group import COMMANDS

MACROS = {".TH", ".SH", ".PP", ".TP", ".B"}
ESCAPES = {r"\-", r"\f"}


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("man")
    click_man.main(["sphero-probe", "--target", str(folder)], standalone_mode=False)
    return {file.stem: file for file in folder.glob("*.1")}


def commands(
    group: click.Group, words: tuple[str, ...] = ("sphero-probe",)
) -> Iterator[tuple[str, click.Command]]:
    yield "-".join(words), group
    for name, command in group.commands.items():
        if isinstance(command, click.Group):
            yield from commands(command, (*words, name))
        else:
            yield "-".join((*words, name)), command


def test_click_man_finds_the_commands_beside_the_entry_point() -> None:
    (script,) = entry_points(group="console_scripts", name="sphero-probe")
    assert script.load() is cli.main
    assert "everything" in dir(cli)
    assert set(cli.everything.commands) == set(COMMANDS)
    assert not hasattr(cli, "another")


def test_every_command_has_a_page_with_its_options(pages: dict[str, Path]) -> None:
    known = dict(commands(cli.everything))
    assert set(pages) == set(known)
    assert "sphero-probe-plan-check" in known
    for name, command in known.items():
        page = pages[name].read_text(encoding="utf-8").replace(r"\-", "-")
        assert f'"{__version__}"' in page
        assert f"\\- {command.short_help}\n" in pages[name].read_text(encoding="utf-8")
        for option in command.params:
            if isinstance(option, click.Option) and not option.hidden:
                assert re.search(rf"^\\fB{option.opts[0]},?\\fP", page, re.MULTILINE), (name, option.name)
                assert option.help
                assert option.help.split("  ")[0] in page
        for word in getattr(command, "commands", ()):
            assert f"\\fB{word}\\fP" in page


def test_no_text_of_ours_is_taken_for_a_macro(pages: dict[str, Path]) -> None:
    for page in pages.values():
        text = page.read_text(encoding="utf-8")
        for line in text.splitlines():
            assert line[:1] not in ".'" or line.split()[0] in MACROS, (page.name, line)
        assert set(re.findall(r"\\.", text)) <= ESCAPES
        assert text.replace("\n", "").isprintable()


@pytest.mark.skipif(not shutil.which("groff"), reason="no groff here")
def test_the_pages_are_set_without_a_warning(pages: dict[str, Path]) -> None:
    set_ = subprocess.run(
        ["groff", "-man", "-ww", "-Tutf8", "-z", *pages.values()],
        capture_output=True,
        text=True,
        check=False,
        env={"PATH": "/usr/bin:/bin"},
    )
    assert (set_.returncode, set_.stderr) == (0, "")


def test_the_page_of_the_group_has_the_exit_codes(pages: dict[str, Path]) -> None:
    assert "3 robot not found" in pages["sphero-probe"].read_text(encoding="utf-8")
