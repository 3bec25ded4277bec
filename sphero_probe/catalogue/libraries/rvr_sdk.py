"""The commands in the source of the maker's Python SDK for RVR.

A command is a function that returns ``{'did': DevicesEnum.power, 'cid': CommandsEnum.wake, …}``; the numbers
are in the enumerations of these names, of which each device has one for its commands.
"""

import ast
from collections.abc import Iterable, Iterator, Mapping
from typing import Final

from sphero_probe.catalogue.libraries.claims import Claim, PairKey
from sphero_probe.catalogue.libraries.source import SourceFile, byte_in, classes, functions, member, numbers
from sphero_probe.catalogue.model import Kind
from sphero_probe.protocol.packets import Generation

_ROBOT: Final = "rvr"
_LISTENER: Final = "on_"
"""How the functions begin that wait for a notification."""

_Numbers = Mapping[tuple[str, str], Mapping[str, int]]
"""Module and class -> member -> number."""


def sdk_claims(files: Iterable[SourceFile]) -> tuple[frozenset[str], dict[PairKey, Claim]]:
    """Return the robot that the SDK is for, and what it says of each pair; nothing for another library."""
    kept = list(files)
    enumerations = {
        (file.module, node.name): numbers(node.body) for file in kept for node in classes(file.tree)
    }
    claims: dict[PairKey, Claim] = {}
    for file in kept:
        origins = _origins(file.tree)
        for function in functions(file.tree.body):
            for did, cid in _pairs(function, origins, enumerations):
                is_notification = function.name.startswith(_LISTENER)
                name = function.name.removeprefix(_LISTENER)
                kind = Kind.NOTIFICATION if is_notification else Kind.COMMAND
                claims.setdefault((Generation.V2, did, cid), Claim(name, kind, {_ROBOT: None}))
    return frozenset({_ROBOT} if claims else ()), claims


def _origins(tree: ast.Module) -> dict[str, str]:
    """Return the classes that a module imports -> the last word of the module that has them."""
    return {
        name.asname or name.name: node.module.rpartition(".")[2]
        for node in tree.body
        if isinstance(node, ast.ImportFrom) and node.module
        for name in node.names
    }


def _pairs(
    function: ast.FunctionDef, origins: Mapping[str, str], enumerations: _Numbers
) -> Iterator[tuple[int, int]]:
    """Yield the pair in what a function returns."""

    def number(node: ast.expr) -> int | None:
        if (found := member(node)) is None:
            return byte_in(node)
        owner, name = found
        return enumerations.get((origins.get(owner, ""), owner), {}).get(name)

    for statement in function.body:
        match statement:
            case ast.Return(value=ast.Dict(keys=keys, values=values)):
                said = {
                    key.value: number(value)
                    for key, value in zip(keys, values, strict=True)
                    if isinstance(key, ast.Constant) and key.value in ("did", "cid")
                }
                did, cid = said.get("did"), said.get("cid")
                if did is not None and cid is not None:
                    yield did, cid
            case _:
                pass
