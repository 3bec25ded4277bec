"""The command line: parses, calls the layers below, prints. Heavy imports wait until a command needs them.

``group`` lists the commands; ``commands`` holds the options of each, ``actions`` its work; ``invoke`` runs
a command line and turns errors into exit codes.
"""

import os
import sys

from sphero_probe import __version__

TYPE_CHECKING = False  # as in typing; importing that would double the time of --version
if TYPE_CHECKING:
    from typing import Final, NoReturn

    import click

NAME: "Final" = "sphero-probe"
COMPLETE_VARIABLE: "Final" = "_SPHERO_PROBE_COMPLETE"
"""Set by the completion scripts when they ask for candidates."""


def main() -> "NoReturn":
    """Run ``sphero-probe`` on the process's arguments and exit."""
    if sys.argv[1:] in (["--version"], ["-V"]) and sys.stdout:
        sys.stdout.write(f"sphero-probe {__version__}\n")  # before click is imported: scripts ask this often
        sys.exit(0)
    if COMPLETE_VARIABLE in os.environ:
        from sphero_probe.cli.complete.shells import answer  # noqa: PLC0415 - --version does not need it

        sys.exit(answer())
    from sphero_probe.cli.invoke import run_and_exit  # noqa: PLC0415 - likewise

    run_and_exit(sys.argv[1:])


def __dir__() -> list[str]:
    return [*globals(), "everything"]


def __getattr__(name: str) -> "click.Group":
    """Return the group with all its commands imported; ``click-man`` looks for it next to ``main``."""
    if name != "everything":
        raise AttributeError(name)
    from sphero_probe.cli import group  # noqa: PLC0415 - likewise

    return group.whole_group()
