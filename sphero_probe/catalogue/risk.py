"""The six risk classes: how much harm a command can do. The user allows commands by class."""

from enum import IntEnum


class Risk(IntEnum):
    """Risk classes in rising order; users allow them by name."""

    READ = 0
    """A documented query."""
    PROBE = 1
    """A wrong-length payload that a strict firmware refuses without executing."""
    WRITE = 2
    """A volatile, visible change: LEDs, volume, streaming."""
    MOTION = 3
    """The robot moves, makes noise or ends the session."""
    PERSIST = 4
    """A change that outlives the session: names, configuration, saved animations."""
    BRICK = 5
    """Bootloader, firmware, factory data, erasing, deep sleep."""

    @property
    def word(self) -> str:
        """The class as people type and read it: ``read``, ``probe``, ``write``, …"""
        return _WORDS[self]


_WORDS = [risk.name.lower() for risk in Risk]
"""By the number of the class: a name of an enumeration is looked up slowly."""
