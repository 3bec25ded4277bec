"""The public names of ``import sphero_probe``, and that importing it loads nothing else."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

import sphero_probe
from sphero_probe.exports import HOMES

ROOT = Path(__file__).resolve().parents[2]
LIGHT = """
import sys
seen = set(sys.modules)
import sphero_probe
sphero_probe.__version__
print(*set(sys.modules) - seen)
"""
LIGHT_VALUES = """
import sys
from sphero_probe import Command, Plan, Probe, sweep
print(*sys.modules)
"""


def imported_by(code: str) -> set[str]:
    """Run code in a new interpreter without coverage and return the words that it prints."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("COV")}
    ran = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT, env=environment
    )
    return set(ran.stdout.split())


def test_importing_the_package_imports_nothing_else() -> None:
    assert imported_by(LIGHT) == {"sphero_probe"}


def test_a_plan_file_needs_no_event_loop() -> None:
    assert not {"asyncio", "bleak", "click", "rich", "sphero_probe.api"} & imported_by(LIGHT_VALUES)


@pytest.mark.parametrize("name", sphero_probe.__all__)
def test_every_public_name_is_there_and_documented(name: str) -> None:
    value = getattr(sphero_probe, name)
    assert name == "__version__" or value.__doc__
    assert name in dir(sphero_probe)


def test_type_checkers_are_told_the_same_names() -> None:
    stub = ast.parse((ROOT / "sphero_probe" / "__init__.pyi").read_text(encoding="utf-8"))
    homes = {
        alias.name: "" if node.module == "sphero_probe" else (node.module or "").removeprefix("sphero_probe.")
        for node in stub.body
        if isinstance(node, ast.ImportFrom) and node.module != "typing"
        for alias in node.names
    }
    listed = next(
        ast.literal_eval(node.value)
        for node in stub.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__"
    )
    assert homes == HOMES
    assert listed == sphero_probe.__all__ == sorted({*homes, "__version__"})


def test_a_star_import_imports_them_all() -> None:
    space: dict[str, object] = {}
    exec("from sphero_probe import *", space)
    assert set(sphero_probe.__all__) <= set(space)


def test_another_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'conect'"):
        _ = sphero_probe.conect  # type: ignore[attr-defined]
