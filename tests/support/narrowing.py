"""What a test knows of a value and its declared type does not say: asserted, and told to the type checker."""

from collections.abc import Iterable
from typing import TypeVar

_T = TypeVar("_T")


def known(value: _T | None) -> _T:
    """Give back what is not None here."""
    assert value is not None
    return value


def only(kind: type[_T], values: Iterable[object]) -> _T:
    """Give the single value there is, which is of this kind."""
    (value,) = values
    assert isinstance(value, kind), value
    return value


def every(kind: type[_T], values: Iterable[object]) -> list[_T]:
    """Give all the values, which are all of this kind."""
    found = []
    for value in values:
        assert isinstance(value, kind), value
        found.append(value)
    return found
