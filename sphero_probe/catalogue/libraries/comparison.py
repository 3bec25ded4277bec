"""What only a library knows, and what only the catalogue knows."""

from collections.abc import Iterator
from typing import Final, NamedTuple

from sphero_probe.catalogue.commands import all_rows, async_rows
from sphero_probe.catalogue.libraries.claims import Library, PairKey
from sphero_probe.catalogue.model import Kind
from sphero_probe.protocol.packets import Generation

OURS: Final = "sphero-probe"
"""The side of what only the catalogue knows."""


class Difference(NamedTuple):
    """A pair that only one side knows, or that only one side knows of some robots.

    Attributes:
        known_by: the library's name, or ``OURS``.
        generation: the protocol.
        did: device id; ``NO_DEVICE`` for an asynchronous message of V1.
        cid: command id.
        kind: command or notification.
        name: as the catalogue calls it, empty where it does not know it.
        their_name: as the library calls it, likewise.
        robots: the robots of which only this side knows it; empty where it names none.
    """

    known_by: str
    generation: Generation
    did: int
    cid: int
    kind: Kind
    name: str
    their_name: str
    robots: tuple[str, ...]


class _Known(NamedTuple):
    name: str
    kind: Kind
    robots: frozenset[str]


def compare_library(library: Library) -> Iterator[Difference]:
    """Yield first what only the library knows, then what only the catalogue knows of its robots.

    Each is in the order of generation, DID and CID. What robots of the catalogue have under different names
    is one pair here.
    """
    found = list(_differences(library))
    yield from (one for one in found if one.known_by != OURS)
    yield from (one for one in found if one.known_by == OURS)


def _differences(library: Library) -> Iterator[Difference]:
    ours = _catalogue()
    nothing = frozenset[str]()
    for key in sorted(ours.keys() | library.claims.keys()):
        known, claim = ours.get(key), library.claims.get(key)
        theirs = frozenset(claim.robots) if claim else nothing
        mine = known.robots & library.robots if known else nothing
        kind = known.kind if known else claim.kind if claim else Kind.COMMAND
        names = known.name if known else "", claim.name if claim else ""
        if theirs - mine or known is None:
            yield Difference(library.name, *key, kind, *names, tuple(sorted(theirs - mine)))
        if mine - theirs:
            yield Difference(OURS, *key, kind, *names, tuple(sorted(mine - theirs)))


def _catalogue() -> dict[PairKey, _Known]:
    """Return every pair of the catalogue with all robots that have it."""
    found: dict[PairKey, _Known] = {}
    for generation in Generation:
        for row in (*all_rows(generation), *async_rows(generation)):
            key = (generation, row.did, row.cid)
            before = found.get(key)
            robots = frozenset(row.nodes) | (before.robots if before else frozenset())
            found[key] = _Known(before.name if before else row.name, row.kind, robots)
    return found
