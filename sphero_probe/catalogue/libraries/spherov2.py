"""The commands in the source of spherov2.

A device is a class with ``_did``; its methods call ``_encode(toy, CID, …)``, and its notifications are tuples
that begin with ``(DID, CID, 0xff)``, or ``(0xfe, ID)`` for the asynchronous messages of V1. A robot is a
class with ``toy_type``; its attributes name the methods that it has, and the processor where there are two.
"""

import ast
from collections.abc import Iterable, Iterator, Mapping
from typing import Final, NamedTuple

from sphero_probe.catalogue.libraries.claims import Claim, PairKey
from sphero_probe.catalogue.libraries.source import (
    SourceFile,
    aliases,
    assignments,
    byte_in,
    classes,
    functions,
    member,
    numbers,
    text_in,
)
from sphero_probe.catalogue.model import NO_DEVICE, Kind, Robot
from sphero_probe.catalogue.robots import ROBOTS, robot_by_prefix
from sphero_probe.protocol.packets import Generation

_LATER: Final = "ToyV2"
"""The base class of the robots of the second generation."""
_FIRST_V2_DEVICE: Final = 0x10
"""The lowest device id of V2; it tells the generation of a command that no robot has."""
_DEPTH: Final = 16


class _Pair(NamedTuple):
    did: int
    cid: int
    name: str
    kind: Kind


class _Toy(NamedTuple):
    """A robot's class: its bases, its prefix, and attribute -> (device class, method, processor)."""

    bases: tuple[str, ...]
    prefix: str
    has: dict[str, tuple[str, str, int | None]]


_Devices = Mapping[str, Mapping[str, _Pair]]
"""Class -> method -> pair."""


def spherov2_claims(files: Iterable[SourceFile]) -> tuple[frozenset[str], dict[PairKey, Claim]]:
    """Return the robots that the library has, and what it says of each pair; nothing for another library."""
    devices: dict[str, dict[str, _Pair]] = {}
    toys: dict[str, _Toy] = {}
    processors: dict[str, int] = {}
    trees = [file.tree for file in files]
    for tree in trees:
        for node in classes(tree):
            if node.name == "Processors":
                processors |= numbers(node.body)
            if pairs := _pairs(node):
                devices.setdefault(node.name, {}).update(pairs)
    for tree in trees:
        renamed = aliases(tree)
        for node in classes(tree):
            if toy := _toy(node, renamed, processors):
                toys.setdefault(node.name, toy)
    robots: set[str] = set()
    claims: dict[PairKey, Claim] = {}
    for name, toy in toys.items():
        if robot := robot_by_prefix(toy.prefix) or ROBOTS.get(name.lower()):
            robots.add(robot.key)
            _add_robot(claims, robot, _inherited(name, toys), devices)
    _add_unused(claims, devices)
    return frozenset(robots), claims


def _pairs(node: ast.ClassDef) -> dict[str, _Pair]:
    """Return the commands and notifications of a device's class."""
    values = dict(assignments(node.body))
    did = byte_in(values.get("_did"))
    found: dict[str, _Pair] = {}
    for name, value in values.items():
        ids = _notification(value)
        if ids is not None and (did is not None or ids[0] == NO_DEVICE):
            found[name] = _Pair(*ids, name, Kind.NOTIFICATION)
    for function in functions(node.body) if did is not None else ():
        cid = next((number for call in ast.walk(function) if (number := _encoded(call)) is not None), None)
        if did is not None and cid is not None:
            found[function.name] = _Pair(did, cid, function.name, Kind.COMMAND)
    return found


def _encoded(node: ast.AST) -> int | None:
    """Return the CID of ``_encode(toy, CID, …)``; some methods forget the toy, some call ``__encode``."""
    match node:
        case ast.Call(func=ast.Attribute(attr=name), args=arguments) if name.endswith("_encode"):
            return next((number for one in arguments[:2] if (number := byte_in(one)) is not None), None)
        case _:
            return None


def _notification(value: ast.expr) -> tuple[int, int] | None:
    """Return DID and CID of ``(DID, CID, 0xff)`` or ``(0xfe, ID)``, alone or with its handler behind it."""
    if not isinstance(value, ast.Tuple) or not value.elts:
        return None
    ids = value.elts[0].elts if isinstance(value.elts[0], ast.Tuple) else value.elts
    match [byte_in(part) for part in ids]:
        case [int(did), int(cid), 0xFF]:
            return did, cid
        case [0xFE, int(cid)]:
            return NO_DEVICE, cid
        case _:
            return None


def _toy(node: ast.ClassDef, renamed: Mapping[str, str], processors: Mapping[str, int]) -> _Toy | None:
    """Return what a robot's class has, None for another class."""
    bases = tuple(renamed.get(base.id, base.id) for base in node.bases if isinstance(base, ast.Name))
    prefix, is_toy = "", False
    has: dict[str, tuple[str, str, int | None]] = {}
    for name, value in assignments(node.body):
        if name == "toy_type" and isinstance(value, ast.Call):
            is_toy = True
            prefix = text_in(value.args[1]) if len(value.args) > 1 else ""
        elif found := _used(value, processors):
            owner, method, processor = found
            has[name] = renamed.get(owner, owner), method, processor
    return _Toy(bases, prefix, has) if is_toy or has else None


def _used(value: ast.expr, processors: Mapping[str, int]) -> tuple[str, str, int | None] | None:
    """Return device class, method and processor of ``Power.wake`` or ``partialmethod(Power.wake, …)``."""
    if direct := member(value):
        return *direct, None
    if not isinstance(value, ast.Call):
        return None
    methods = [method for method in map(member, value.args) if method and method[0] != "Toy"]
    if len(methods) != 1:
        return None
    named = [member(keyword.value) for keyword in value.keywords if keyword.arg == "proc"]
    return *methods[0], next((processors.get(one[1]) for one in named if one), None)


def _inherited(name: str, toys: Mapping[str, _Toy]) -> _Toy:
    """Return a robot's class with what it inherits; its bases are all its ancestors."""
    bases: list[str] = []
    has: dict[str, tuple[str, str, int | None]] = {}
    waiting = [name]
    while waiting and len(bases) < _DEPTH:
        current = waiting.pop(0)
        bases.append(current)
        if toy := toys.get(current):
            has = toy.has | has
            waiting += [base for base in toy.bases if base not in bases]
    return _Toy(tuple(bases), toys[name].prefix, has)


def _add_robot(claims: dict[PairKey, Claim], robot: Robot, toy: _Toy, devices: _Devices) -> None:
    generation = Generation.V2 if _LATER in toy.bases else Generation.V1
    if generation is not robot.generation:
        return
    for owner, method, processor in toy.has.values():
        if pair := devices.get(owner, {}).get(method):
            key = (generation, pair.did, pair.cid)
            claim = claims.get(key) or Claim(pair.name, pair.kind, {})
            claims[key] = claim._replace(robots={**claim.robots, robot.key: processor})


def _add_unused(claims: dict[PairKey, Claim], devices: _Devices) -> None:
    """Add the pairs that no robot has."""
    for pair in _all_pairs(devices):
        is_v1 = pair.did < _FIRST_V2_DEVICE
        key = (Generation.V1 if is_v1 else Generation.V2, pair.did, pair.cid)
        claims.setdefault(key, Claim(pair.name, pair.kind, {}))


def _all_pairs(devices: _Devices) -> Iterator[_Pair]:
    return (pair for pairs in devices.values() for pair in pairs.values())
