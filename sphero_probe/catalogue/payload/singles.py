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
    scales = map(_scale_of, starts.unpack(packed))
    return [
        seven / scale
        if -half < (seven := (exact := value * scale) + _TO_WHOLE - _TO_WHOLE) - exact < half
        else _longer(value, scale, half)
        for value, (scale, half) in zip(values.unpack(packed), scales, strict=True)
    ]


def _longer(value: float, scale: float, half: float) -> float | str:
    """Return the shortest decimal of a number that 7 digits do not tell; the arguments are of ``_Scales``."""
    if not half:
        return shortest(value)
    exact = value * scale * 10
    eight = exact + _TO_WHOLE - _TO_WHOLE
    if -half * 10 < eight - exact < half * 10:
        return eight / (scale * 10)
    return (exact * 10 + _TO_WHOLE - _TO_WHOLE) / (scale * 100)


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


_BY_TEXT: Final = (0.0, 0.0)


class _Scales(dict[int, tuple[float, float]]):
    """The first 16 bits of a number -> how to round it.

    The first is the power of ten that makes a whole number of its first 7 digits, the second half of the
    space between two floats, times that power. ``_BY_TEXT`` stands for numbers that need text: zero,
    subnormal or not finite, if a product is not exact, if numbers that begin like this have different powers,
    or if 6 digits may do although seven do not end in 0.
    """

    def __missing__(self, start: int) -> tuple[float, float]:
        self[start] = _shared(*_scale(start))
        if not start & 0x7F:  # a power of two: below it is less space than above
            packed = (start << 16).to_bytes(4, "big")
            if all_shortest(packed) != [shortest(_first(start, 0))]:
                self[start] = _BY_TEXT
        return self[start]


_scale_of: Final = _Scales().__getitem__


@lru_cache
def _shared(scale: float, half: float) -> tuple[float, float]:
    """Return the same pair for all numbers that are rounded alike: so few stay in the processor's cache."""
    return scale, half


def _scale(start: int) -> tuple[float, float]:
    least, most = abs(_first(start, 0)), abs(_first(start, 0xFFFF))
    if not 0 < least <= most < inf:
        return _BY_TEXT
    power = floor(log10(least))
    behind = 6 - power
    alike = 10.0**power <= least and most < 10.0 ** (power + 1)
    if not (alike and 0 <= behind <= _EXACT - 2):
        return _BY_TEXT
    scale = 10.0**behind
    half = (most - least) / 0xFFFF / 2 * scale
    return (scale, half) if half < 1 / 2 else _BY_TEXT


def _first(start: int, end: int) -> float:
    value: float = _SINGLE.unpack((start << 16 | end).to_bytes(4, "big"))[0]
    return value
