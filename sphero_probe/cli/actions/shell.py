"""``shell``: run commands line by line over one connection."""

import os
import shlex
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from sphero_probe.cli.invoke import run
from sphero_probe.cli.messages import say
from sphero_probe.cli.shared_connection import SharedConnection
from sphero_probe.cli.values import ConnectOptions
from sphero_probe.errors import InterruptedRunError, SpheroProbeError, UsageError

_DEVICE = "SPHERO_PROBE_DEVICE"
_ENDS = ("exit", "quit")
_NOT_HERE = ("shell",)

Prompt = Callable[[], str]
"""Returns the next line that a person typed; raises EOFError at the end, KeyboardInterrupt at Ctrl-C."""


def shell(connecting: ConnectOptions, *, keep_going: bool) -> None:
    """Read lines from a person or a script, and run each as a command, until the end.

    Args:
        connecting: which robot.
        keep_going: a script goes on after a line that fails.

    Raises:
        SpheroProbeError: a line of a script failed; it has the exit code of that line.
    """
    with SharedConnection(connecting.device) as shared, _default_device(connecting.device):
        if sys.stdin is not None and sys.stdin.isatty():
            _converse(_prompt(shared, connecting))
        else:
            _run_script(keep_going=keep_going)


@contextmanager
def _default_device(device: str) -> Iterator[None]:
    """Let commands without ``--device`` use this one."""
    before = os.environ.get(_DEVICE)
    os.environ[_DEVICE] = device
    try:
        yield
    finally:
        os.environ.pop(_DEVICE)
        if before is not None:
            os.environ[_DEVICE] = before


def _prompt(shared: SharedConnection, connecting: ConnectOptions) -> Prompt:
    """Return a prompt with history and completion, or a plain one without the extra ``shell``."""
    try:
        from sphero_probe.cli.shell_prompt import ShellPrompt  # noqa: PLC0415 - an extra
    except ImportError:
        say("note: history and completion need the extra shell: pip install 'sphero-probe[shell]'")
        return lambda: input("sphero> ")
    return ShellPrompt(shared, connecting).ask


def _converse(ask: Prompt) -> None:
    while True:
        try:
            line = ask()
        except EOFError:
            return
        except KeyboardInterrupt:
            continue
        try:
            if _run_line(line) is None:
                return
        except InterruptedRunError:
            continue


def _run_script(*, keep_going: bool) -> None:
    failed: SpheroProbeError | None = None
    for number, line in enumerate(sys.stdin, 1):
        code = _run_line(line)
        if code is None:
            break
        if code:
            hint = "" if keep_going else "to go on after it: --keep-going"
            failed = SpheroProbeError(f"line {number} failed with exit code {code}", hint)
            failed.exit_code = code
            if not keep_going:
                break
    if failed:
        raise failed


def _run_line(line: str) -> int | None:
    """Run one line; return its exit code, None for the end of the shell."""
    try:
        words = shlex.split(line, comments=True)
    except ValueError as error:
        say(f"sphero-probe: {str(error).lower()}")
        return UsageError.exit_code
    if words[:1] == ["sphero-probe"]:
        words = words[1:]
    if not words:
        return 0
    if words[0] in _ENDS:
        return None
    if words[0] in _NOT_HERE:
        say(f"sphero-probe: {words[0]} cannot run inside the shell")
        return UsageError.exit_code
    code = run(words)
    sys.stdout.flush()
    return code
