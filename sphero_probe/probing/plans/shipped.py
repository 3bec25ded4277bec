"""Find the plans that are shipped with the tool, by name."""

from pathlib import Path
from typing import Final

from sphero_probe.errors import BadInputFileError
from sphero_probe.probing.plan import Plan
from sphero_probe.probing.plans.loader import load_plan

_PACKAGE: Final = Path(__file__).resolve().parents[2]


def plans_folder() -> Path:
    """Return the folder of the plans: in the installed package, or next to the package in a checkout."""
    installed = _PACKAGE / "probe_plans"
    return installed if installed.is_dir() else _PACKAGE.parent / "probe_plans"


def plan_files() -> list[Path]:
    """Return the files of the plans shipped with the tool, by name."""
    return sorted(path for path in plans_folder().glob("*.py") if not path.name.startswith("_"))


def is_shipped(path: Path) -> bool:
    """Whether this file is one of the plans shipped with the tool."""
    return path.resolve() in {file.resolve() for file in plan_files()}


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # the name is too long, or the folder is not readable
        return False


def find_plan(text: str) -> Plan:
    """Load a plan file, or the shipped plan of this name.

    Raises:
        BadInputFileError: there is no such plan, or it is broken.
    """
    path = Path(text)
    if not _is_file(path):
        shipped = {file.stem: file for file in plan_files()}
        by_name = shipped.get(path.stem)
        if (
            by_name is None
            or (path.suffix not in ("", ".py"))
            or (path.parent.name not in ("", plans_folder().name))
        ):
            raise BadInputFileError(f"{text}: no such plan", f"there are: {', '.join(shipped)}")
        path = by_name
    return load_plan(path)
