"""The exceptions: one module, a correct tree, one exit code per branch; and hints for mistyped words."""

import ast
import re
from pathlib import Path

import pytest

from sphero_probe import errors
from sphero_probe.errors import InterruptedRunError, SpheroProbeError, did_you_mean, nearest

PACKAGE = Path(errors.__file__).parent
PRIVATE = {"_TooLong"}
"""Exceptions that never leave their module; the docstring of the tree says why."""


def branches(kind: type[SpheroProbeError], depth: int = 0) -> list[tuple[int, str, int]]:
    """Depth, name and exit code of a class and its subclasses, in the order of definition."""
    below = [line for child in kind.__subclasses__() for line in branches(child, depth + 1)]
    return [(depth, kind.__name__, kind.exit_code), *below]


def test_the_tree_in_the_docstring_is_right() -> None:
    drawn = re.findall(r"^    ([│├└─ ]*)(\w+Error) +(\d+)  ", errors.__doc__ or "", re.MULTILINE)
    assert [(len(indent) // 4, name, int(code)) for indent, name, code in drawn] == branches(SpheroProbeError)


def test_a_branch_has_one_exit_code_of_its_own() -> None:
    codes = [kind.exit_code for kind in SpheroProbeError.__subclasses__()]
    assert len(codes) == len(set(codes))
    for kind in SpheroProbeError.__subclasses__():
        assert {code for _, _, code in branches(kind)} == {kind.exit_code}


def test_every_exception_of_the_package_is_in_the_tree() -> None:
    elsewhere = set()
    for file in PACKAGE.rglob("*.py"):
        if file.name == "errors.py":
            continue
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef):
                bases = [base.id for base in node.bases if isinstance(base, ast.Name)]
                if any(base.endswith(("Error", "Exception")) for base in bases):
                    elsewhere.add(node.name)
    assert elsewhere == PRIVATE


def test_a_signal_has_the_exit_code_that_shells_use() -> None:
    assert InterruptedRunError(2).exit_code == 130
    assert not isinstance(InterruptedRunError(2), SpheroProbeError)


@pytest.mark.parametrize(
    ("word", "otherwise", "hint"),
    [
        pytest.param("swep", None, "did you mean 'sweep'?", id="near"),
        pytest.param("zzz", None, "known: scan, sweep", id="nothing-near"),
        pytest.param("zzz", "see --help", "see --help", id="otherwise"),
        pytest.param("", None, "known: scan, sweep", id="empty"),
    ],
)
def test_did_you_mean(word: str, otherwise: str | None, hint: str) -> None:
    assert did_you_mean(word, iter(["scan", "sweep"]), otherwise) == hint


def test_nearest_gives_the_nearest_first() -> None:
    assert nearest("swep", ["step", "sweep", "scan"], count=2)[0] == "sweep"
    assert nearest("swep", []) == []


def test_there_is_one_did_you_mean() -> None:
    users = [
        file for file in PACKAGE.rglob("*.py") if "get_close_matches" in file.read_text(encoding="utf-8")
    ]
    assert [file.name for file in users] == ["errors.py"]
