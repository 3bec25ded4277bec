"""Runs a long table of cases as a few tests; a failure names its rows."""

from collections.abc import Callable, Sequence
from typing import Any

import pytest

_ROWS = 64
"""Rows per test; one test per row would cost more than most rows do."""


def rows(
    table: Sequence[Any], at_once: int = _ROWS
) -> Callable[[Callable[..., None]], Callable[[int], None]]:
    """Call a test with every row, as ``pytest.mark.parametrize`` does, but many rows in one test.

    Every row is tried, even if others fail. The test takes the values of a row and no fixtures.

    Args:
        table: ``pytest.param`` each, or the bare values.
        at_once: rows of one test.

    Raises:
        ExceptionGroup: rows failed; each failure has a note with its row's id.
    """
    assert table
    parts = -(-len(table) // at_once)

    def decorate(test: Callable[..., None]) -> Any:
        def whole(part: int) -> None:
            failed = []
            for row in table[part::parts]:
                values, name = getattr(row, "values", row), getattr(row, "id", None)
                try:
                    test(*values)
                except Exception as error:  # noqa: BLE001 - the other rows are tried all the same
                    error.add_note(f"in the row {name or values!r}")
                    failed.append(error)
            if failed:
                raise ExceptionGroup(f"{test.__name__}: {len(failed)} of the rows", failed)

        whole.__name__, whole.__module__ = test.__name__, test.__module__
        return pytest.mark.parametrize("part", range(parts))(whole)

    return decorate
