"""Shows a run on one screen of the terminal when its report goes to a file."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from sphero_probe.cli.messages import say
from sphero_probe.cli.output import style_for
from sphero_probe.cli.values import Output
from sphero_probe.reports.formats.sweep_table import SweepTable
from sphero_probe.reports.rows import Row
from sphero_probe.reports.views import FINDINGS


@contextmanager
def brief_table(output: Output) -> Iterator[Callable[[Row], None]]:
    """Yield a function that takes each row of a run; then write the table and the path of the report.

    They are written to standard error, if that is a terminal.
    """
    if output.file is None or not sys.stderr.isatty():
        yield lambda _: None
        return
    page = SweepTable(sys.stderr, FINDINGS, style_for(output, sys.stderr), brief=True)
    yield page.add
    page.close()
    say(f"The whole report is in {output.file}.")
