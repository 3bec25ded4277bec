"""Find the shortest decimals of 32-bit floats, so that 0.1 reads 0.1 and not 0.10000000149011612.

Sensor streams consist of such numbers. So a list of them is rounded to 7 and to 8 digits as a whole, without
text, where that gives the same as text.
"""

from functools import lru_cache
from math import floor, inf, isfinite, log10, nan
from struct import Struct
from typing import Final

_SINGLE: Final = Struct(">f")
_SURE: Final = 9
"""As many digits as any 32-bit float needs."""
_MOST: Final = 64
"""The most numbers that are rounded at once."""
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
    numbers, both, starts = _structs(count)
    values = numbers.unpack(packed)
    pairs = [*zip(values, map(_SCALES.__getitem__, starts.unpack(packed)), strict=True)]
    eights = [(value * scale + _TO_WHOLE - _TO_WHOLE) / scale for value, scale in pairs]
    sevens = [(value * (less := scale / 10) + _TO_WHOLE - _TO_WHOLE) / less for value, scale in pairs]
    same = both.unpack(both.pack(*eights, *sevens))
    return [
        seven if same_seven == value else eight if same_eight == value else shortest(value)
        for value, eight, seven, same_eight, same_seven in zip(
            values, eights, sevens, same[:count], same[count:], strict=True
        )
    ]


def all_raw(packed: bytes) -> list[float]:
    """Return each big-endian 32-bit float in these bytes, as a 64-bit float."""
    return [value for (value,) in _SINGLE.iter_unpack(packed)]


@lru_cache(maxsize=_MOST + 1)
def _structs(count: int) -> tuple[Struct, Struct, Struct]:
    """Return what reads that many numbers, twice as many, and the first 16 bits of each."""
    return Struct(f">{count}f"), Struct(f">{2 * count}f"), Struct(">" + count * "Hxx")


class _Scales(dict[int, float]):
    """The first 16 bits of a number -> the power of ten that makes a whole number of its first 8 digits.

    NaN, which equals nothing, stands for numbers that need text: if the product is not exact, if the numbers
    that begin like this have different powers, or if six digits may do although seven do not end in 0.
    """

    def __missing__(self, start: int) -> float:
        scale = self[start] = _scale(abs(_first(start, 0)), abs(_first(start, 0xFFFF)))
        return scale


def _first(start: int, end: int) -> float:
    value: float = _SINGLE.unpack((start << 16 | end).to_bytes(4, "big"))[0]
    return value


def _scale(least: float, most: float) -> float:
    if not 0 < least <= most < inf:
        return nan
    power = floor(log10(least))
    digits_behind = 7 - power
    spacing = (most - least) / 0xFFFF
    alike = 10.0**power <= least and most < 10.0 ** (power + 1)
    sure = alike and 1 <= digits_behind <= _EXACT and 10.0 ** (1 - digits_behind) > spacing
    return 10.0**digits_behind if sure else nan


_SCALES: Final = _Scales()
