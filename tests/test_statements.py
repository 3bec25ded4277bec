"""docs/statements.md: every command line prints what its row says, and every test that a row names exists."""

import ast
import re
import shlex
from pathlib import Path
from typing import Final, NamedTuple

import pytest

from tests.support.cli import Cli

TESTS: Final = Path(__file__).resolve().parent
PAGE: Final = (TESTS.parent / "docs" / "statements.md").read_text(encoding="utf-8")
SHOWN: Final = re.compile(r"`sphero-probe ([^`]+)`: `([^`]+)`")
NAMED: Final = re.compile(r"`([\w/]+\.py)::(\w+)`")


class Statement(NamedTuple):
    id: str
    words: str
    command: str
    tests: str


STATEMENTS: Final = [
    Statement(*(cell.strip() for cell in line.strip("|").split("|")))
    for line in PAGE.splitlines()
    if line.startswith("| S")
]
COMMANDS: Final = sorted({line for line, _ in SHOWN.findall(PAGE)})


def test_every_statement_is_numbered_and_has_a_command_or_a_test() -> None:
    assert [statement.id for statement in STATEMENTS] == [f"S{at + 1}" for at in range(len(STATEMENTS))]
    assert len(STATEMENTS) >= 57
    for statement in STATEMENTS:
        assert statement.words.endswith(".")
        assert SHOWN.fullmatch(statement.command) or not statement.command, statement
        named = NAMED.findall(statement.tests)
        assert statement.tests == ", ".join(f"`{file}::{name}`" for file, name in named), statement
        assert named or statement.command, statement


@pytest.mark.parametrize("file", sorted({file for file, _ in NAMED.findall(PAGE)}))
def test_the_tests_that_the_page_names_exist(file: str) -> None:
    parsed = ast.parse((TESTS / file).read_text(encoding="utf-8"))
    there = {node.name for node in parsed.body if isinstance(node, ast.FunctionDef)}
    assert {name for named, name in NAMED.findall(PAGE) if named == file} <= there


@pytest.mark.unmeasured
@pytest.mark.parametrize("line", COMMANDS)
def test_the_command_lines_print_what_the_page_says(
    cli: Cli, line: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "240")
    ran = cli(*shlex.split(line), "--format", "table", "--color", "never")
    assert ran.code == 0, ran.err
    printed = " ".join(ran.out.split())
    for wanted in {text for shown, text in SHOWN.findall(PAGE) if shown == line}:
        assert wanted in printed
