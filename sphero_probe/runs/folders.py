"""Where files are kept between runs: journals in the state folder, the last scan in the cache folder.

Absolute paths in ``$XDG_STATE_HOME`` and ``$XDG_CACHE_HOME`` decide on every system; without them it is
the usual place of the system.
"""

import os
from pathlib import Path
from typing import Final

APP: Final = "sphero-probe"
"""The name of the tool's own folder below the user's."""


def state_folder() -> Path:
    r"""Return the folder for what must not get lost; it need not exist.

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
    r"""Return the folder for what may be deleted at any time; it need not exist.

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
    """Return where state was kept on every system before; None where that is the state folder of today."""
    if _from_environment("XDG_STATE_HOME"):
        return None
    try:
        former = Path.home() / ".local" / "state" / APP
    except RuntimeError:
        return None
    return None if former == state_folder() else former


def _from_environment(variable: str) -> Path | None:
    """Return the tool's folder below an XDG variable; a relative path does not count [XDG base directory]."""
    base = Path(os.environ.get(variable, ""))
    return base / APP if base.is_absolute() else None


def _absolute(folder: Path) -> Path:
    if not folder.is_absolute():  # an older platformdirs returns ~/… as it is for a user without a home
        raise RuntimeError("the home folder is not known")
    return folder
