"""What a library says that robots have, as values."""

from collections.abc import Mapping
from typing import Final, NamedTuple

from sphero_probe.catalogue.model import Kind
from sphero_probe.protocol.packets import Generation

INSTALLED: Final = ("spherov2", "sphero_sdk")
"""Packages of libraries that are found by name."""

PairKey = tuple[Generation, int, int]
"""Generation, DID and CID; the DID of V1's asynchronous messages is ``NO_DEVICE``."""


class Claim(NamedTuple):
    """One DID/CID pair that a library knows.

    Attributes:
        name: of the function that sends it, or of the notification.
        kind: command or notification.
        robots: robot key -> number of the node that it is sent to, None where the library names none.
    """

    name: str
    kind: Kind
    robots: Mapping[str, int | None]


class Library(NamedTuple):
    """A library and all that it knows.

    Attributes:
        name: of the library, with its version where one is known.
        robots: keys of the robots that it has.
        claims: pair -> what is said of it.
    """

    name: str
    robots: frozenset[str]
    claims: Mapping[PairKey, Claim]
