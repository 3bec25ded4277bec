"""Colours by name: the basic colours of CSS, and some that LEDs show well."""

from typing import Final

COLOURS: Final[dict[str, str]] = {
    "black": "000000",
    "white": "ffffff",
    "red": "ff0000",
    "lime": "00ff00",
    "green": "008000",
    "blue": "0000ff",
    "yellow": "ffff00",
    "cyan": "00ffff",
    "magenta": "ff00ff",
    "orange": "ffa500",
    "purple": "800080",
    "pink": "ffc0cb",
    "violet": "ee82ee",
    "turquoise": "40e0d0",
    "gold": "ffd700",
    "brown": "a52a2a",
    "gray": "808080",
    "silver": "c0c0c0",
    "maroon": "800000",
    "navy": "000080",
    "olive": "808000",
    "teal": "008080",
}
"""Name -> RRGGBB, as the CSS Color Module defines them [https://www.w3.org/TR/css-color-4/#named-colors]."""
