"""Writes many ids as ranges, such as ``0x1d-0x1f:0x00-0xff``."""

from collections.abc import Iterable
from itertools import pairwise

_WORTH_A_RANGE = 3


def spans(numbers: Iterable[int]) -> list[str]:
    """Return ``0x00-0x05``, ``0x07`` for numbers in any order; two neighbours stay apart."""
    ordered = sorted(set(numbers))
    breaks = [at for at, (one, other) in enumerate(pairwise(ordered), 1) if other != one + 1]
    runs = [ordered[start:end] for start, end in pairwise([0, *breaks, len(ordered)])] if ordered else []
    return [
        text
        for run in runs
        for text in (
            [f"0x{run[0]:02x}-0x{run[-1]:02x}"]
            if len(run) >= _WORTH_A_RANGE
            else [f"0x{number:02x}" for number in run]
        )
    ]


def pair_spans(pairs: Iterable[tuple[int, int]]) -> list[str]:
    """Return ``0x13:0x00-0x05``, ``0x13:0x07`` for pairs in any order; devices that are alike go together."""
    commands: dict[int, set[int]] = {}
    for did, cid in pairs:
        commands.setdefault(did, set()).add(cid)
    alike: dict[tuple[str, ...], list[int]] = {}
    for did, cids in sorted(commands.items()):
        alike.setdefault(tuple(spans(cids)), []).append(did)
    return [f"{device}:{span}" for cids, dids in alike.items() for device in spans(dids) for span in cids]
