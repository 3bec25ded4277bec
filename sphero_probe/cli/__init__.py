"""The command line: words in, an exit code out. Nothing heavy is imported before a command needs it."""

import sys
from typing import NoReturn

from sphero_probe import __version__


def main() -> NoReturn:
    """Run ``sphero-probe`` on the process's arguments and exit."""
    if sys.argv[1:] == ["--version"]:
        sys.stdout.write(f"sphero-probe {__version__}\n")  # before click is imported: scripts ask this often
        sys.exit(0)
    from sphero_probe.cli.failures import run_and_exit

    run_and_exit(sys.argv[1:])
