"""Narrows types in tests: asserts what a test knows about a value, for the test and the type checker."""

from collections.abc import Iterable
from typing import TypeVar

_T = TypeVar("_T")


def known(value: _T | None) -> _T:
    """Return a value that must not be None."""
    assert value is not None
    return value


def only(kind: type[_T], values: Iterable[object]) -> _T:
    """Return the only value, which must be of this type."""
    (value,) = values
    assert isinstance(value, kind), value
    return value


def every(kind: type[_T], values: Iterable[object]) -> list[_T]:
    """Return all the values, which must be of this type."""
    found = []
    for value in values:
        assert isinstance(value, kind), value
        found.append(value)
    return found
