"""Access to the fields of a decoded payload by name."""

from collections.abc import Mapping
from typing import Any


class NamedFields:
    """A value with decoded fields: ``answer.percentage`` and ``answer["percentage"]`` read one of them.

    Attributes:
        fields: field name -> value, as the catalogue's layout names them; empty where no layout is known.
    """

    __slots__ = ()
    fields: Mapping[str, object]

    def __getitem__(self, name: str) -> Any:
        """Return a field.

        Raises:
            KeyError: there is no field of that name.
        """
        try:
            return self.fields[name]
        except KeyError:
            raise KeyError(f"no field {name!r}; {self._known()}") from None

    def __getattr__(self, name: str) -> Any:
        """Return a field whose name is not an ordinary attribute.

        Raises:
            AttributeError: there is no field of that name.
        """
        if name.startswith("_") or name == "fields":
            raise AttributeError(name)
        try:
            return self.fields[name]
        except KeyError:
            raise AttributeError(f"no field {name!r}; {self._known()}") from None

    def __contains__(self, name: object) -> bool:
        return name in self.fields

    def _known(self) -> str:
        return f"the fields are {', '.join(self.fields)}" if self.fields else "no fields were decoded"
