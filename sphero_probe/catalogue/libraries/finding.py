"""Find a library: an installed package by its name, or a folder with its source."""

from importlib.util import find_spec
from pathlib import Path

from sphero_probe.catalogue.libraries.claims import INSTALLED, Library
from sphero_probe.catalogue.libraries.rvr_sdk import sdk_claims
from sphero_probe.catalogue.libraries.source import read_source
from sphero_probe.catalogue.libraries.spherov2 import spherov2_claims
from sphero_probe.errors import BadInputFileError


def find_library(text: str) -> Library:
    """Return what a library knows.

    Args:
        text: its name, one of ``INSTALLED``, or the path of its source.

    Raises:
        BadInputFileError: it is not installed, or there are no commands in what was found.
    """
    name, root = _installed(text) if text in INSTALLED else (Path(text).absolute().name, Path(text))
    try:
        if not (text and root.is_dir()):
            raise BadInputFileError(f"{text}: no such folder", f"known by name: {', '.join(INSTALLED)}")
    except (OSError, ValueError) as error:
        raise BadInputFileError(f"{text}: {error}") from error
    files = list(read_source(root))
    for read in (spherov2_claims, sdk_claims):
        robots, claims = read(files)
        if claims:
            return Library(name, robots, claims)
    raise BadInputFileError(
        f"{text}: no commands of robots in its Python files",
        "it takes the source of spherov2 or of the SDK for RVR",
    )


def _installed(name: str) -> tuple[str, Path]:
    """Return the name with the version, and the folder, of an installed package; nothing of it is run."""
    from importlib import metadata  # noqa: PLC0415 - slow to import, and only an installed library needs it

    spec = find_spec(name)
    places = list(spec.submodule_search_locations or ()) if spec else []
    if not places:
        raise BadInputFileError(
            f"{name} is not installed beside sphero-probe", "install it there, or give the path of its source"
        )
    try:
        return f"{name} {metadata.version(name)}", Path(places[0])
    except metadata.PackageNotFoundError:
        return name, Path(places[0])
