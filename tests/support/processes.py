"""Reads what a running command still says, after some of its lines were read."""

from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import subprocess


def rest_of(process: "subprocess.Popen[str]") -> tuple[str, str]:
    """Wait for the end, and return the rest of both outputs.

    ``communicate()`` would lose the lines that ``readline()`` took from the pipe and did not return.
    """
    assert process.stdout
    assert process.stderr
    with process, ThreadPoolExecutor(1) as aside:
        err = aside.submit(process.stderr.read)
        return process.stdout.read(), err.result()
