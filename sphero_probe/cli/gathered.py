"""Gives a command several options as one argument.

``--help`` imports this module, so it imports nothing else.
"""

from collections.abc import Callable
from typing import Any

Function = Callable[..., Any]


def gather(function: Function, name: str, kind: Callable[..., object], *options: Function) -> Function:
    """Give a command options whose values arrive as one argument.

    Args:
        function: the command.
        name: of the argument; the parameter of an option is called ``{name}_{attribute}``.
        kind: makes the argument from its attributes.
        *options: as help lists them.
    """

    def gathered(**arguments: Any) -> Any:
        prefix = f"{name}_"
        parts = {key: arguments.pop(key) for key in list(arguments) if key.startswith(prefix)}
        value = kind(**{key.removeprefix(prefix): part for key, part in parts.items()})
        return function(**{name: value}, **arguments)

    decorated = _instead_of(function, gathered)
    for option in reversed(options):
        decorated = option(decorated)
    return decorated


def _instead_of(function: Function, replacement: Function) -> Function:
    """Return the replacement with the name, docstring and options of the function."""
    replacement.__doc__ = function.__doc__
    replacement.__name__ = function.__name__
    replacement.__click_params__ = getattr(function, "__click_params__", [])  # type: ignore[attr-defined]
    return replacement
