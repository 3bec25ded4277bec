"""What follows the ``?`` of an address of a simulated robot: ``key=value&…``."""

from collections.abc import Callable, Mapping
from urllib.parse import parse_qsl

from sphero_probe.errors import UsageError, nearest


def parse_query(query: str, keys: Mapping[str, Callable[[str], object]], kind: str) -> dict[str, object]:
    """Return key -> value; values may be percent-encoded.

    Args:
        query: what follows the question mark.
        keys: key -> how its value is read; a ``ValueError`` says what is wanted.
        kind: whose settings they are, for messages: ``fake``.

    Raises:
        UsageError: an unknown key, a key given twice, a value that does not fit its key.
    """
    values: dict[str, object] = {}
    plus_kept = query.replace("+", "%2B")  # parse_qsl would read a plus sign as a blank, as web forms do
    for key, value in parse_qsl(plus_kept, keep_blank_values=True):
        if key not in keys:
            raise UsageError(unknown(f"{kind} setting", key, list(keys)))
        if key in values:
            raise UsageError(f"{kind} robot setting {key} is given twice")
        try:
            values[key] = keys[key](value)
        except ValueError as error:
            raise UsageError(f"{kind} robot setting {key}={value}: {error}") from None
    return values


def unknown(what: str, word: str, known: list[str]) -> str:
    """Return the message for an unknown word, with the nearest known one."""
    near = nearest(word.lower(), known)
    guess = f" did you mean {near[0]}?" if near else ""
    return f"unknown {what} {word!r};{guess} there are {', '.join(known)}"
