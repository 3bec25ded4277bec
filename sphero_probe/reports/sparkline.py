"""Draws numbers as a line of text."""

from collections.abc import Sequence

_BLOCKS = "▁▂▃▄▅▆▇█"
_ASCII = "_.-=*#"


def sparkline(values: Sequence[float], width: int, *, unicode: bool = True) -> str:
    """Return the last values as a line of characters, the lowest value lowest.

    Args:
        values: any finite numbers; values that are all the same give a line in the middle.
        width: characters at most.
        unicode: False keeps it within ASCII.
    """
    marks = _BLOCKS if unicode else _ASCII
    recent = values[-width:] if width > 0 else []
    if not recent:
        return ""
    low, high = min(recent), max(recent)
    if high <= low:
        return marks[len(marks) // 2] * len(recent)
    top = len(marks) - 1
    return "".join(marks[round((value - low) / (high - low) * top)] for value in recent)
