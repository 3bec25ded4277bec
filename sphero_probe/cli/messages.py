"""Prints messages on standard error."""

import sys
from contextlib import suppress

from sphero_probe.reports.printable import visible
from sphero_probe.reports.streams import takes_unicode


def say(text: str, *, limit: int | None = 400) -> None:
    """Write a line to standard error, made harmless, above a progress bar if there is one.

    ``click.echo`` would write into the bar. A closed standard error is ignored.

    Args:
        text: may hold text from a robot or a file.
        limit: the most characters of it to write, None for all.
    """
    if sys.stderr is not None:
        with suppress(OSError):
            sys.stderr.write(visible(text, limit=limit, unicode=takes_unicode(sys.stderr)) + "\n")
            sys.stderr.flush()


def warn(text: str) -> None:
    """Print a warning on standard error."""
    say(f"warning: {text}")
