"""Find the folders for files that are kept between runs: state (journals) and cache (the last scan).

On every system, absolute paths in ``$XDG_STATE_HOME`` and ``$XDG_CACHE_HOME`` are used. Without them, the
folders are in the usual place of the system.
"""

import os
from pathlib import Path
from typing import Final

APP: Final = "sphero-probe"
"""The name of the tool's folder."""


def state_folder() -> Path:
    r"""Return the folder for files that must not be lost; it may not exist yet.

    ``~/.local/state/sphero-probe`` on Linux, ``~/Library/Application Support/sphero-probe`` on macOS,
    ``%LOCALAPPDATA%\sphero-probe`` on Windows.

    Raises:
        RuntimeError: the home folder is not known.
    """
    if folder := _from_environment("XDG_STATE_HOME"):
        return folder
    from platformdirs import user_state_path  # noqa: PLC0415 - costs more than a completion's other imports

    return _absolute(user_state_path(APP, appauthor=False))


def cache_folder() -> Path:
    r"""Return the folder for files that may be deleted at any time; it may not exist yet.

    ``~/.cache/sphero-probe`` on Linux, ``~/Library/Caches/sphero-probe`` on macOS,
    ``%LOCALAPPDATA%\sphero-probe\Cache`` on Windows.

    Raises:
        RuntimeError: the home folder is not known.
    """
    if folder := _from_environment("XDG_CACHE_HOME"):
        return folder
    from platformdirs import user_cache_path  # noqa: PLC0415 - costs more than a completion's other imports

    return _absolute(user_cache_path(APP, appauthor=False))


def former_state_folder() -> Path | None:
    """Return the state folder of earlier versions; None if it is the same as today's."""
    if _from_environment("XDG_STATE_HOME"):
        return None
    try:
        former = Path.home() / ".local" / "state" / APP
    except RuntimeError:
        return None
    return None if former == state_folder() else former


def _from_environment(variable: str) -> Path | None:
    """Return the tool's folder in an XDG variable's; relative paths are ignored [XDG base directory]."""
    base = Path(os.environ.get(variable, ""))
    return base / APP if base.is_absolute() else None


def _absolute(folder: Path) -> Path:
    if not folder.is_absolute():  # for a user without a home, older platformdirs return ~/… unchanged
        raise RuntimeError("the home folder is not known")
    return folder
