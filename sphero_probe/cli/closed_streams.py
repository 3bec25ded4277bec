"""Stands in for standard streams that are closed (``<&-``, ``>&-``), which Python leaves out."""

import os
import sys
from io import TextIOWrapper
from typing import Literal


def replace_closed_streams() -> None:
    """Put a stream that fails with ``OSError`` in the place of a closed standard input or output.

    Code that reads or writes them then reports the error as it reports a full disk.
    """
    if sys.stdin is None:
        sys.stdin = _failing("r", os.O_WRONLY)
    if sys.stdout is None:
        sys.stdout = _failing("w", os.O_RDONLY)


def _failing(mode: Literal["r", "w"], flags: int) -> TextIOWrapper:
    """Open the null device in the other direction than the stream will use it."""
    return os.fdopen(os.open(os.devnull, flags), mode, encoding="utf-8")
