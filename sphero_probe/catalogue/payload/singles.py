"""Find the shortest decimals of 32-bit floats, so that 0.1 reads 0.1 and not 0.10000000149011612.

Sensor streams consist of such numbers. So most of them are rounded to 7, 8 or 9 digits without text: a
decimal is the same 32-bit float if it is less than half of the space between two floats away. All products
are exact in 64 bits, and no decimal of so few digits lies in the middle between two floats.
"""

from functools import lru_cache
from math import floor, inf, isfinite, log10
from struct import Struct
from typing import Final

_SINGLE: Final = Struct(">f")
_SURE: Final = 9
"""As many digits as any 32-bit float needs."""
_MOST: Final = 64
"""The most numbers that are unpacked at once."""
_TO_WHOLE: Final = 1.5 * 2**52
"""A number below 2**51 becomes whole, half to even, when this is added and taken away again."""
_EXACT: Final = 12
"""The highest power of ten that times a 32-bit float is exact in 64 bits."""


def shortest(value: float) -> float | str:
    """Return the shortest decimal that is the same 32-bit float; text where it is not finite."""
    if not isfinite(value):
        return str(value)
    whole = _SINGLE.pack(value)
    for digits in (6, 7, 8):
        short = float(f"{value:.{digits}g}")
        if _SINGLE.pack(short) == whole:
            return short
    return float(f"{value:.{_SURE}g}")


def all_shortest(packed: bytes) -> list[float | str]:
    """Return ``shortest`` of each big-endian 32-bit float in these bytes."""
    count = len(packed) // _SINGLE.size
    if count > _MOST:
        cut = _MOST * _SINGLE.size
        return [*all_shortest(packed[:cut]), *all_shortest(packed[cut:])]
    values, starts = _readers(count)
    rules = map(_rule_of, starts.unpack(packed))
    return [
        digits / seven
        if below_7 < (digits := (exact := value * seven) + _TO_WHOLE - _TO_WHOLE) - exact < half_7
        else digits / eight
        if below_8 < (digits := (exact := value * eight) + _TO_WHOLE - _TO_WHOLE) - exact < half_8
        else _nine_digits(value, eight)
        for value, (seven, below_7, half_7, eight, below_8, half_8) in zip(
            values.unpack(packed), rules, strict=True
        )
    ]


def _nine_digits(value: float, eight: float) -> float | str:
    """Return the shortest decimal of a number that 8 digits do not tell; ``eight`` is of its ``_Rule``."""
    return (value * eight * 10 + _TO_WHOLE - _TO_WHOLE) / (eight * 10) if eight else shortest(value)


def all_raw(packed: bytes) -> list[float]:
    """Return each big-endian 32-bit float in these bytes, as a 64-bit float."""
    count = len(packed) // _SINGLE.size
    if count > _MOST:
        return [value for (value,) in _SINGLE.iter_unpack(packed)]
    return [*_readers(count)[0].unpack(packed)]


@lru_cache(maxsize=_MOST + 1)
def _readers(count: int) -> tuple[Struct, Struct]:
    """Return what reads that many numbers, and the first 16 bits of each."""
    return Struct(f">{count}f"), Struct(">" + count * "Hxx")


_Rule = tuple[float, float, float, float, float, float]
"""How to round numbers that begin with the same 16 bits: to 7 digits, then to 8.

For each, the power of ten that makes a whole number of the first digits, then half of the space between two
floats times that power, below zero and above. A plain tuple, as others take longer to unpack.
"""
_BY_TEXT: Final[_Rule] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""For numbers that need text: zero, subnormal or not finite, if a product is not exact, if numbers that begin
like this have different powers, or if 6 digits may do although seven do not end in 0."""


class _Rules(dict[int, _Rule]):
    """The first 16 bits of a number -> how to round it."""

    def __missing__(self, start: int) -> _Rule:
        self[start] = _rule(start)
        if not start & 0x7F:  # a power of two: below it is less space than above
            packed = (start << 16).to_bytes(4, "big")
            if all_shortest(packed) != [shortest(_first(start, 0))]:
                self[start] = _BY_TEXT
        return self[start]


_rule_of: Final = _Rules().__getitem__


def _rule(start: int) -> _Rule:
    least, most = abs(_first(start, 0)), abs(_first(start, 0xFFFF))
    if not 0 < least <= most < inf:
        return _BY_TEXT
    power = floor(log10(least))
    behind = 6 - power
    alike = 10.0**power <= least and most < 10.0 ** (power + 1)
    if not (alike and 0 <= behind <= _EXACT - 2):
        return _BY_TEXT
    half = (most - least) / 0xFFFF / 2 * 10.0**behind
    return _shared_rule(10.0**behind, half) if half < 1 / 2 else _BY_TEXT


@lru_cache
def _shared_rule(scale: float, half: float) -> _Rule:
    """Return the same rule for all numbers that are rounded alike: so few stay in the processor's cache."""
    return scale, -half, half, scale * 10, -half * 10, half * 10


def _first(start: int, end: int) -> float:
    value: float = _SINGLE.unpack((start << 16 | end).to_bytes(4, "big"))[0]
    return value
