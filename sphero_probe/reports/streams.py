"""Tells whether an output stream can show colour, and characters beyond ASCII."""

import os
import sys
from typing import TextIO


def takes_unicode(stream: TextIO) -> bool:
    """Tell whether all characters may be written to a stream.

    In the C locale Python still writes UTF-8, which a terminal of that locale does not show.
    """
    if stream in (sys.stdout, sys.stderr, sys.__stdout__, sys.__stderr__) and _is_plain_c():
        return False
    return (stream.encoding or "").lower().replace("-", "").startswith("utf")


def _is_plain_c() -> bool:
    """Tell whether the environment asks for the C locale, and for no other encoding."""
    if os.environ.get("PYTHONUTF8") or os.environ.get("PYTHONIOENCODING"):
        return False
    chosen = next(filter(None, map(os.environ.get, ("LC_ALL", "LC_CTYPE", "LANG"))), "")
    return chosen in ("C", "POSIX")


def wants_color(choice: str, stream: TextIO) -> bool:
    """Decide on colour: ``--color``, then FORCE_COLOR, NO_COLOR, TERM=dumb, then whether it is a terminal."""
    if choice != "auto":
        return choice == "always"
    if os.environ.get("FORCE_COLOR"):
        return True
    if os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb":
        return False
    return stream.isatty()
