"""Runs a command line; turns every error into a line or two on standard error and an exit code."""

import errno
import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from typing import Final, NoReturn

import click

from sphero_probe.cli import NAME
from sphero_probe.cli.closed_streams import replace_closed_streams
from sphero_probe.cli.group import group
from sphero_probe.errors import InterruptedRunError, OutputError, SpheroProbeError, UsageError

BUG: Final = 70
_HINT: Final = 4000
"""Characters of a hint: a command line to copy must not be cut."""
INTERRUPTED: Final = 130
"""128 and the number of SIGINT; the module with its name is not imported for that."""


def run_and_exit(arguments: Sequence[str]) -> NoReturn:
    """Run the command line and leave the process with its exit code."""
    replace_closed_streams()
    code = run(arguments)
    try:
        sys.stdout.flush()
    except OSError as error:
        code = code or _cannot_write(error)
    _silence_standard_output()
    sys.exit(code)


def run(arguments: Sequence[str]) -> int:
    """Run the command line and return the exit code."""
    debug = "--debug" in arguments
    try:
        return _run(arguments)
    except (SpheroProbeError, click.ClickException, OSError) as error:
        if debug:
            _show_traceback()
        return _say(error)
    except (KeyboardInterrupt, click.Abort):
        _tell("interrupted")
        return INTERRUPTED
    except InterruptedRunError as stopped:
        return stopped.exit_code
    except Exception:  # noqa: BLE001 - a bug is reported, not dumped
        if debug:
            _show_traceback()
        return _report_bug()


def _run(arguments: Sequence[str]) -> int:
    try:  # not group.main: it would end the process by itself when a pipe is closed
        with group.make_context(NAME, list(arguments), terminal_width=_help_width()) as context:
            group.invoke(context)
    except click.exceptions.Exit as ended:
        return ended.exit_code
    return 0


def _help_width() -> int:
    """Return the columns that help fills, as click counts them; click would import shutil for that."""
    columns = os.environ.get("COLUMNS", "")
    if not (columns.isdecimal() and columns.isascii() and int(columns[:6])):
        try:
            columns = str(os.get_terminal_size(sys.__stdout__.fileno()).columns)  # type: ignore[union-attr]
        except (OSError, ValueError, AttributeError):
            columns = ""
    return max(min(int(columns[:6] or 0) or 80, 80) - 2, 50)


def _say(error: SpheroProbeError | click.ClickException | OSError) -> int:
    if isinstance(error, SpheroProbeError):
        _tell(str(error), error.hint)
        return error.exit_code
    if isinstance(error, click.exceptions.NoArgsIsHelpError):
        click.echo(error.format_message(), err=True)
        return error.exit_code
    if isinstance(error, click.ClickException):
        context = getattr(error, "ctx", None)
        hint = f"see: {context.command_path} --help" if context else ""
        _tell(error.format_message(), hint)
        return UsageError.exit_code
    return _cannot_write(error)


def _cannot_write(error: OSError) -> int:
    """Say that the output failed; a closed pipe (``| head``) ends quietly."""
    if not isinstance(error, BrokenPipeError):
        where = f"{error.filename}: " if error.filename else ""
        hint = "standard output is closed" if error.errno == errno.EBADF else "is the disk full?"
        _tell(f"cannot write the output: {where}{error.strerror or error}", hint)
    return OutputError.exit_code


def _tell(message: str, hint: str = "") -> None:
    from sphero_probe.cli.messages import say  # noqa: PLC0415 - help does not need the reports

    say(f"sphero-probe: {message}")
    if hint:
        say(f"  {hint}", limit=_HINT)


def _show_traceback() -> None:
    import traceback  # noqa: PLC0415 - slow to import, and needed only with --debug

    traceback.print_exc()


def _report_bug() -> int:
    import tempfile  # noqa: PLC0415 - slow to import, and needed only after a bug
    import traceback  # noqa: PLC0415 - likewise

    with tempfile.NamedTemporaryFile(
        "w", prefix="sphero-probe-", suffix=".txt", delete=False, encoding="utf-8"
    ) as file:
        traceback.print_exc(file=file)
    kind, error, _ = sys.exc_info()
    name = kind.__name__ if kind else "error"
    _tell(
        f"a bug in sphero-probe ({name}: {error}); the traceback is in {file.name}",
        "please report it with that file",
    )
    return BUG


def _silence_standard_output() -> None:
    """Keep the interpreter from complaining at exit about output that could not be written."""
    with suppress(OSError, ValueError):
        sys.stdout.flush()
        return
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
