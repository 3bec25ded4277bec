"""Imports the completion candidates of an option only when a shell asks for them."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from click import Context, Parameter
    from click.shell_completion import CompletionItem


def offer(kind: str) -> "Callable[[Context, Parameter, str], list[CompletionItem[str]]]":
    """Return the function that click calls to complete a value.

    Args:
        kind: a key of ``OFFERS`` in ``sphero_probe.cli.complete.offers``.
    """

    def complete(context: "Context", _: "Parameter", start: str) -> "list[CompletionItem[str]]":
        from sphero_probe.cli.complete.offers import OFFERS  # noqa: PLC0415 - imports the catalogue

        return OFFERS[kind](context, start)

    return complete
