"""Check type and range of the fields of an untrusted JSON object."""

from collections.abc import Iterable, Mapping
from typing import Final, TypeVar

from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import BadLineError

_ENTRIES: Final = 256
_DEPTH: Final = 8
_COUNT: Final = 1 << 31
_WHOLE: Final = 1 << 64
_SECONDS: Final = 1e9
_FRAME: Final = 1 << 16
_NAME: Final = 512
_TEXT: Final = 1 << 16
_OWN_KEYS: Final = frozenset({"type", "kind", "text", "schema_version"})
_RISKS: Final = {risk.word: risk for risk in Risk}

_Member = TypeVar("_Member")


class Fields:
    """The fields of one line; each getter checks type and range.

    Raises:
        BadLineError: from every getter.
    """

    def __init__(self, data: dict[str, object]) -> None:
        self._data = data

    def has(self, key: str) -> bool:
        """Whether the line has this field."""
        return key in self._data

    def given(self, key: str) -> bool:
        """Whether the line has this field, and it is not null."""
        return self._data.get(key) is not None

    def whole(self, key: str, least: int, most: int) -> int:
        """A whole number within bounds."""
        value = self._data.get(key)
        if not isinstance(value, int) or isinstance(value, bool) or not least <= value <= most:
            raise BadLineError(f"{key} is not a number from {least} to {most}")
        return value

    def byte(self, key: str) -> int:
        """A number from 0 to 255."""
        value = self._data.get(key)
        if type(value) is int and 0 <= value <= 0xFF:  # most fields are bytes, and these are in order
            return value
        return self.whole(key, 0, 0xFF)

    def byte_or_none(self, key: str) -> int | None:
        """A byte, or null."""
        value = self._data.get(key)
        if value is None or (type(value) is int and 0 <= value <= 0xFF):
            return value
        return self.byte(key)

    def seconds(self, key: str) -> float:
        """A duration."""
        value = self._data.get(key)
        if type(value) is float and 0 <= value <= _SECONDS:
            return value
        if not isinstance(value, int | float) or isinstance(value, bool) or not 0 <= value <= _SECONDS:
            raise BadLineError(f"{key} is not a duration")
        return float(value)

    def text(self, key: str, limit: int) -> str:
        """A text of limited length."""
        return _text(self._data.get(key), key, limit)

    def raw(self, key: str, limit: int = _FRAME) -> bytes:
        """Bytes, written in hex without spaces."""
        text = self._data.get(key)
        if type(text) is not str or len(text) > 2 * limit:
            text = _text(text, key, 2 * limit)
        try:
            if not text or text.isalnum():
                return bytes.fromhex(text)
        except ValueError:
            pass
        raise BadLineError(f"{key} is not hexadecimal")

    def text_or_none(self, key: str, limit: int) -> str | None:
        """A text of limited length, or null."""
        return None if self._data.get(key) is None else self.text(key, limit)

    def raw_or_none(self, key: str) -> bytes | None:
        """Bytes, or null."""
        return None if self._data.get(key) is None else self.raw(key)

    def flag(self, key: str) -> bool:
        """True or false."""
        value = self._data.get(key)
        if not isinstance(value, bool):
            raise BadLineError(f"{key} is neither true nor false")
        return value

    def one_of(self, key: str, words: Mapping[str, _Member]) -> _Member:
        """The value that one of these words stands for."""
        value = self._data.get(key)
        member = words.get(value) if isinstance(value, str) else None
        if member is None:
            raise BadLineError(f"{key} is not one of {', '.join(words)}")
        return member

    def risk(self, key: str) -> Risk:
        """A risk class by its word."""
        return self.one_of(key, _RISKS)

    def texts(self, key: str) -> dict[str, str]:
        """An object whose values are texts."""
        held = self._object(key)
        return {_text(name, key, _NAME): _text(value, key, _TEXT) for name, value in held.items()}

    def risks(self, key: str) -> tuple[str, ...]:
        """Risk classes, each as its word."""
        value = self._data.get(key)
        known = isinstance(value, list) and all(isinstance(one, str) and one in _RISKS for one in value)
        if not isinstance(value, list) or not known or len(value) > len(_RISKS):
            raise BadLineError(f"{key} is not a list of risk classes")
        return tuple(value)

    def counts(self, key: str, words: Iterable[str]) -> dict[str, int]:
        """A count for each of these words that the object has."""
        data = self._object(key)
        held = Fields(data)
        return {word: held.whole(word, 0, _COUNT) for word in words if word in data}

    def inner(self, key: str) -> "Fields":
        """The fields of an object within the line."""
        return Fields(self._object(key))

    def details(self, key: str) -> dict[str, object]:
        """The details of a note: any JSON of limited depth and size."""
        held = self._object(key)
        if not _is_plain(held, _DEPTH) or _OWN_KEYS.intersection(held):
            raise BadLineError(f"{key} is not the details of a note")
        return held

    def _object(self, key: str) -> dict[str, object]:
        value = self._data.get(key)
        if not isinstance(value, dict) or len(value) > _ENTRIES:
            raise BadLineError(f"{key} is not an object of at most {_ENTRIES} entries")
        return value


def _text(value: object, key: str, limit: int) -> str:
    if not isinstance(value, str) or len(value) > limit:
        raise BadLineError(f"{key} is not a text of at most {limit} characters")
    return value


def _is_plain(value: object, depth: int) -> bool:
    """Whether a value nests no deeper than this and holds no huge numbers."""
    match value:
        case int():
            return -_WHOLE < value < _WHOLE
        case dict():
            return depth > 0 and all(_is_plain(held, depth - 1) for held in value.values())
        case list():
            return depth > 0 and all(_is_plain(held, depth - 1) for held in value)
        case _:
            return True
