"""Check that Dask is installed, and keep its log away from the user."""

import logging

from sphero_probe.errors import UnavailableError


def check_dask() -> None:
    """Check that Dask is installed, before any other module of this package is imported.

    Raises:
        UnavailableError: it is not.
    """
    try:
        import distributed  # noqa: F401, PLC0415 - an extra; it sets up its log, which is silenced below
    except ImportError as error:
        raise UnavailableError(
            "robots on several hosts need Dask, which is not installed", "pip install 'sphero-probe[dask]'"
        ) from error
    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
