"""Checks this machine's software, serial ports, terminal and folders."""

import os
import platform
import re
import shutil
import sys
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, metadata, requires, version
from pathlib import Path
from typing import Final, TextIO

from sphero_probe import __version__
from sphero_probe.errors import SpheroProbeError, UnavailableError
from sphero_probe.reports.checks import Look, State
from sphero_probe.reports.streams import takes_unicode, wants_color
from sphero_probe.runs.store import runs_folder
from sphero_probe.transports import serial

PACKAGE: Final = "sphero-probe"
CONTAINER_MARKS: Final = (Path("/.dockerenv"), Path("/run/.containerenv"))
"""Files that Docker and Podman put into every container."""

_BOUND: Final = re.compile(r"(>=|<)\s*([0-9.]+)")
_NARROWEST: Final = 60


def python() -> Look:
    """Check the version of Python."""
    needed = _metadata("Requires-Python")
    seen = f"{platform.python_version()} ({platform.python_implementation()})"
    if within(platform.python_version(), needed):
        return Look(State.OK, seen)
    return Look(State.FAIL, f"{seen}, but {needed} is needed", "install a newer Python")


def system() -> Look:
    """Report the operating system, and what it runs in."""
    name = {"Darwin": "macOS"}.get(platform.system(), platform.system())
    seen = f"{name} {platform.release()} on {platform.machine()}"
    if platform.system() not in ("Linux", "Darwin", "Windows"):
        return Look(State.WARN, seen, "Bluetooth is supported on Linux, macOS and Windows")
    inside = surroundings()
    return Look(State.OK, f"{seen}, inside {inside}" if inside else seen)


def surroundings() -> str:
    """Return what hides the machine's Bluetooth: ``a container``, ``WSL``, or nothing."""
    if "microsoft" in platform.release().lower():
        return "WSL"
    if os.environ.get("container") or any(map(os.path.exists, CONTAINER_MARKS)):  # noqa: SIM112 - systemd's
        return "a container"
    return ""


def tool() -> Look:
    """Report the version of this tool."""
    return Look(State.OK, __version__)


def bleak() -> Look:
    """Check the version of the Bluetooth library."""
    needed = _needed("bleak")
    install = f"install it: pip install 'bleak{needed}'"
    try:
        found = version("bleak")
    except PackageNotFoundError:
        return Look(State.FAIL, "not installed", install)
    if not within(found, needed):
        return Look(State.FAIL, f"{found}, but {needed} is needed", install)
    return Look(State.OK, found)


def serial_library() -> Look:
    """Check the library for robots on a serial port."""
    try:
        found = version("serialx")
    except PackageNotFoundError:
        return Look(
            State.WARN, "not installed; only robots on a serial port need it", f"install it: {serial.INSTALL}"
        )
    needed = _needed("serialx")
    if within(found, needed):
        return Look(State.OK, f"serialx {found}")
    return Look(State.WARN, f"serialx {found}, but {needed} is needed", f"pip install 'serialx{needed}'")


def serial_ports() -> Look:
    """List the serial ports; warn of those that this user may not open."""
    try:
        listed = serial.ports()
    except UnavailableError as error:
        return Look(State.SKIPPED, str(error))
    closed = [port.path for port in listed if not _allowed(port.path)]
    if closed:
        return Look(
            State.WARN, f"not allowed to use {', '.join(closed)}", f"to use a robot there: {serial.ALLOW}"
        )
    named = [f"{port.path} ({port.description})" if port.description else port.path for port in listed]
    return Look(State.OK, ", ".join(named) or "none")


def _allowed(port: str) -> bool:
    """Whether this user may open a port; where ports are not files, as on Windows, only opening tells."""
    return not os.path.exists(port) or os.access(port, os.R_OK | os.W_OK)  # noqa: PTH110 - quiet


def terminal(stream: TextIO | None = None) -> Look:
    """Report what standard output can show."""
    stream = stream or sys.stdout
    encoding = stream.encoding or "unknown encoding"
    if not stream.isatty():
        said = f"none (output goes to a file or a pipe), {encoding}"
        return Look(State.OK, said)
    width = shutil.get_terminal_size().columns
    seen = ", ".join(
        (
            f"{width} columns",
            encoding,
            "colour" if wants_color("auto", stream) else "no colour",
            f"TERM={os.environ.get('TERM', '')}",
        )
    )
    if width < _NARROWEST:
        return Look(State.WARN, seen, f"make it at least {_NARROWEST} columns wide: tables need that")
    if not takes_unicode(stream):
        return Look(State.WARN, f"{seen}: non-ASCII characters are escaped", "set LC_ALL=C.UTF-8")
    return Look(State.OK, seen)


def journal_folder() -> Look:
    """Check that journals can be written."""
    fix = "set XDG_STATE_HOME to a folder that you can write, or use --no-journal"
    try:
        folder = runs_folder()
    except SpheroProbeError as error:
        return Look(State.FAIL, str(error), fix)
    nearest = next(path for path in (folder, *folder.parents) if os.path.exists(path))  # noqa: PTH110 - quiet
    if not nearest.is_dir():
        return Look(State.FAIL, f"{nearest} is not a folder", fix)
    if not os.access(nearest, os.W_OK | os.X_OK):
        return Look(State.FAIL, f"not allowed to write {nearest}", fix)
    return Look(State.OK, str(folder))


SOFTWARE: Final[dict[str, Callable[[], Look]]] = {
    "Python": python,
    "system": system,
    "sphero-probe": tool,
    "bleak": bleak,
}
"""Name -> check, before Bluetooth."""

SURROUNDINGS: Final[dict[str, Callable[[], Look]]] = {
    "serial library": serial_library,
    "serial ports": serial_ports,
    "terminal": terminal,
    "journals": journal_folder,
}
"""Name -> check, after Bluetooth."""


def within(found: str, needed: str) -> bool:
    """Whether a version is within bounds like ``>=3.0.2,<4``; other kinds of bounds are ignored.

    Args:
        found: a version; only its leading numbers count.
        needed: bounds, in any order.
    """
    have = _numbers(found)
    bounds = _BOUND.findall(needed)
    return all((have >= _numbers(bound)) is (sign == ">=") for sign, bound in bounds)


def _numbers(text: str) -> tuple[int, ...]:
    """Return the leading numbers of a version, without zeros at the end."""
    found = re.match(r"[0-9.]*", text)
    numbers = [int(part) for part in (found[0] if found else "").split(".") if part]
    while numbers and not numbers[-1]:
        numbers.pop()
    return tuple(numbers)


def _needed(library: str) -> str:
    """Return the versions of a library that this package needs, empty if the package is not installed."""
    try:
        wanted = requires(PACKAGE) or []
    except PackageNotFoundError:
        return ""
    for line in wanted:
        name, *_ = re.split(r"[^\w-]", line)
        if name == library:
            bounds = _BOUND.findall(line.partition(";")[0])
            return ",".join(sign + bound for sign, bound in sorted(bounds, reverse=True))
    return ""


def _metadata(key: str) -> str:
    try:
        return str(metadata(PACKAGE)[key] or "")
    except PackageNotFoundError:
        return ""
