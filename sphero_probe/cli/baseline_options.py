"""The options that compare a run with an earlier one.

``--help`` imports this module, so it imports nothing but click.
"""

from collections.abc import Callable
from typing import Any, Final

import click

from sphero_probe.cli.complete.lazily import offer

_OPTIONS: Final = (
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


def baseline_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command ``--baseline`` and ``--baseline-update``, as parameters of these names."""
    for option in _OPTIONS:
        function = option(function)
    return function
