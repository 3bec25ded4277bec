"""The Python files of a library as syntax trees: read, bounded, and never run."""

import ast
import os
import stat
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

_MAX_FILES: Final = 500
_MAX_ENTRIES: Final = 20_000
"""Names in folders that are looked at."""
_MAX_BYTES: Final = 1 << 19
"""Bytes of a file; longer ones are no tables of commands."""
_MAX_TOTAL: Final = 1 << 23
_MAX_NAME: Final = 100
_FLAGS: Final = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)


class SourceFile(NamedTuple):
    """One file.

    Attributes:
        module: its name without ``.py``.
        tree: what is in it.
    """

    module: str
    tree: ast.Module


def read_source(root: Path) -> Iterator[SourceFile]:
    """Yield the Python files under a folder, by name; what cannot be read or parsed is left out.

    Symbolic links are not followed.
    """
    entries = files = total = 0
    for folder, folders, names in os.walk(root, followlinks=False):
        folders.sort()
        entries += len(folders) + len(names)
        if entries > _MAX_ENTRIES:
            return
        for name in sorted(names):
            if not name.endswith(".py"):
                continue
            files += 1
            data = _read(Path(folder, name))
            total += len(data)
            if files > _MAX_FILES or total > _MAX_TOTAL:
                return
            if tree := _parse(data):
                yield SourceFile(name[: -len(".py")], tree)


def _read(path: Path) -> bytes:
    """Return what is in a file; nothing where it is too long, or no regular file."""
    try:
        descriptor = os.open(path, os.O_RDONLY | _FLAGS)
    except (OSError, ValueError):
        return b""
    with os.fdopen(descriptor, "rb") as file:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            return b""
        try:
            data = file.read(_MAX_BYTES + 1)
        except OSError:
            return b""
    return data if len(data) <= _MAX_BYTES else b""


def _parse(data: bytes) -> ast.Module | None:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about escapes and the like in another's source
            return ast.parse(data)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None


def classes(tree: ast.Module) -> Iterator[ast.ClassDef]:
    """Yield the classes of a module."""
    return (node for node in tree.body if isinstance(node, ast.ClassDef))


def functions(body: list[ast.stmt]) -> Iterator[ast.FunctionDef]:
    """Yield the functions of a module or class."""
    return (node for node in body if isinstance(node, ast.FunctionDef))


def assignments(body: list[ast.stmt]) -> Iterator[tuple[str, ast.expr]]:
    """Yield name and value of each simple assignment in a module or class."""
    for node in body:
        match node:
            case ast.Assign(targets=[ast.Name(id=name)], value=value):
                yield shortened(name), value
            case _:
                pass


def byte_in(node: ast.expr | None) -> int | None:
    """Return the byte that an expression is, None where it is none."""
    match node:
        case ast.Constant(value=int() as value) if not isinstance(value, bool) and 0 <= value <= 0xFF:
            return value
        case _:
            return None


def text_in(node: ast.expr | None) -> str:
    """Return the text that an expression is, empty where it is none."""
    return shortened(node.value) if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""


def member(node: ast.expr | None) -> tuple[str, str] | None:
    """Return the class and the attribute of ``Class.attribute``."""
    match node:
        case ast.Attribute(value=ast.Name(id=owner), attr=attribute):
            return owner, shortened(attribute)
        case _:
            return None


def aliases(tree: ast.Module) -> dict[str, str]:
    """Return how a module calls what it imports under another name -> its own name."""
    return {
        name.asname: name.name
        for node in tree.body
        if isinstance(node, ast.ImportFrom)
        for name in node.names
        if name.asname
    }


def numbers(body: list[ast.stmt]) -> dict[str, int]:
    """Return the members of an enumeration that are bytes."""
    found = ((name, byte_in(value)) for name, value in assignments(body))
    return {name: value for name, value in found if value is not None}


def shortened(name: str) -> str:
    """Return a name of bounded length."""
    return name[:_MAX_NAME]
