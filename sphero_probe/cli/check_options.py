"""The options that check a run: against an earlier one, and for outcomes that must not occur.

``--help`` imports this module, so it imports nothing but click.
"""

from collections.abc import Callable
from typing import Any, Final

import click

from sphero_probe.cli.complete.lazily import offer

_OPTIONS: Final = (
    click.option(
        "--fail-on",
        metavar="OUTCOMES",
        help="Exit with 1 if one occurs: silent, inconclusive, absent, blocked, or the run is incomplete.",
    ),
    click.option(
        "--baseline-update",
        is_flag=True,
        help="Write the run to the baseline, whether it exists or not, if the run is complete.",
    ),
    click.option(
        "--baseline",
        metavar="FILE",
        help="Compare with an earlier run, a journal or a JSON report; exit with 1 if it differs.",
        shell_complete=offer("files"),
    ),
)


def check_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command ``--baseline``, ``--baseline-update`` and ``--fail-on``, parameters of these names."""
    for option in _OPTIONS:
        function = option(function)
    return function
