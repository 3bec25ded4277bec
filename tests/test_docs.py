"""The pages in docs/, compared with the code: the reference is complete, the floor plan is right."""

import re
import tomllib
from pathlib import Path

import click
import pytest

from docs.hooks import MARKS, commands, exit_codes, fill_in, public_modules
from sphero_probe import cli
from sphero_probe.cli.group import COMMANDS

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
ARCHITECTURE = (DOCS / "architecture.md").read_text(encoding="utf-8")
REFERENCE = commands()


def section(command: str) -> str:
    """Return the section of a command in the reference, without its subcommands."""
    return REFERENCE.split(f"\n## {command}\n")[1].split("\n## ")[0]


@pytest.mark.parametrize("name", COMMANDS)
def test_the_reference_has_every_command_with_every_option(name: str) -> None:
    command = cli.everything.commands[name]
    said = section(f"sphero-probe {name}")
    assert f"```\nsphero-probe {name} " in said
    for option in command.params:
        if isinstance(option, click.Option):
            assert f"{option.opts[-1]}" in said, option.name
            assert option.help
            assert option.help.split()[0] in said
    for member in getattr(command, "commands", {}):
        assert section(f"sphero-probe {name} {member}")


def test_an_example_of_the_help_is_a_transcript() -> None:
    assert "```console\n$ sphero-probe sweep --did 0x13 --device fake:bolt-plus\n```" in section(
        "sphero-probe sweep"
    )


def test_no_cell_of_the_reference_breaks_its_table() -> None:
    for line in REFERENCE.splitlines():
        if line.startswith("| "):
            assert len(re.findall(r"(?<!\\)\|", line)) == 3, line
            assert "<" not in re.sub(r"`.*?`", "", line), line


def test_exit_codes_come_from_the_readme() -> None:
    assert exit_codes().startswith("|")
    assert "| 0 | done, all that was asked |" in exit_codes()


@pytest.mark.parametrize("page", MARKS)
def test_marks_are_filled_in(page: str) -> None:
    text = (DOCS / page).read_text(encoding="utf-8")
    filled = fill_in(text, page)
    assert all(mark in text and mark not in filled for mark in MARKS[page])
    with pytest.raises(ValueError, match="lacks the line"):
        fill_in("", page)


def test_other_pages_are_left_as_they_are() -> None:
    assert fill_in("text", "index.md") == "text"


def test_public_modules_are_documented_once_they_exist(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("docs.hooks.PUBLIC_MODULES", ("sphero_probe.errors", "sphero_probe.never_there"))
    assert public_modules() == "::: sphero_probe.errors"


def test_the_floor_plan_shows_every_package_and_every_layer_in_order() -> None:
    with (ROOT / "pyproject.toml").open("rb") as file:
        contracts = tomllib.load(file)["tool"]["importlinter"]["contracts"]
    layers = next(contract["layers"] for contract in contracts if contract["type"] == "layers")
    assert f"`{' → '.join(layers)}`" in ARCHITECTURE
    packages = {path.parent.name for path in (ROOT / "sphero_probe").glob("*/__init__.py")}
    drawn = set(re.findall(r"^  (\w+)/ ", ARCHITECTURE, re.MULTILINE))
    assert drawn == packages


def test_what_the_pages_say_of_files_is_so() -> None:
    """Every path of the tree that is named in architecture.md and CONTRIBUTING.md exists."""
    text = ARCHITECTURE + (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`((?:sphero_probe|tests|docs|probe_plans)/[\w/]*(?:\.\w+)?)`", text))
    assert len(named) >= 8
    assert not [path for path in named if not (ROOT / path).exists()]


def test_links_from_the_readme_and_contributing_lead_somewhere() -> None:
    for page in ("README.md", "CONTRIBUTING.md"):
        links = re.findall(r"\]\((?!https?:)([^)#]+)", (ROOT / page).read_text(encoding="utf-8"))
        assert links
        assert not [link for link in links if not (ROOT / link).exists()]


def test_the_changelog_says_each_change_once() -> None:
    """Where two branches add the same line, a merge may keep both."""
    for version in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").split("\n## ")[1:]:
        changes = [line for line in version.splitlines() if line.startswith("- ")]
        assert len(changes) == len(set(changes)) > 0
        headings = [line for line in version.splitlines() if line.startswith("#")]
        assert len(headings) == len(set(headings))
