"""What stands for an address, a name or another value: always the same, and of the same length."""

import re
from hashlib import blake2b
from typing import Final

from sphero_probe.catalogue.payload.layout import Field
from sphero_probe.catalogue.robots import robot_by_prefix

_ADDRESS: Final = 6
_TEXT_ADDRESS: Final = re.compile(
    rb"(?<![0-9A-Za-z])(?:[0-9A-Fa-f]{2}([:-]?)(?:[0-9A-Fa-f]{2}\1){4}[0-9A-Fa-f]{2})(?![0-9A-Za-z])"
)
"""A Bluetooth address as text: twelve hex digits, with or without colons or dashes."""
_NO_ADDRESSES: Final = frozenset({bytes(_ADDRESS), b"\xff" * _ADDRESS})
_RANDOM_KIND: Final = 0xC0
"""Bits of the first byte of a random address that say which kind it is."""
_LEAST: Final = 4
"""Bytes of the shortest value that is looked for in other places; shorter ones are there by chance."""
_READABLE: Final = re.compile(rb"[ -~]{4,}")
"""Text of unknown meaning, which may be a part of a name or of an address."""
_MAX_KNOWN: Final = 1 << 12
_MAX_MADE: Final = 1 << 16


class Pseudonyms:
    """The replacements of one file."""

    def __init__(self, salt: bytes) -> None:
        """Choose the pseudonyms.

        Args:
            salt: up to 64 bytes; another salt gives other pseudonyms, and without it none can be traced back.
        """
        self._salt = salt
        self._known: dict[bytes, bytes] = {}
        self._made: set[bytes] = set(_NO_ADDRESSES)
        self._pattern: re.Pattern[bytes] | None = None
        self._seen: dict[str, set[bytes]] = {"address": set(), "name": set(), "other": set()}

    @property
    def addresses(self) -> int:
        """Different addresses so far."""
        return len(self._seen["address"])

    @property
    def names(self) -> int:
        """Different names so far."""
        return len(self._seen["name"])

    @property
    def others(self) -> int:
        """Different other values so far."""
        return len(self._seen["other"])

    def address(self, octets: bytes) -> bytes:
        """Return what stands for an address, first byte first; the kind of a random address stays.

        An address that stands for another one is returned as it is.
        """
        if octets in self._made or len(octets) != _ADDRESS:
            return octets
        self._count("address", octets)
        digest = self._digest(b"address", octets, _ADDRESS)
        made = bytes((octets[0] & _RANDOM_KIND | digest[0] & ~_RANDOM_KIND & 0xFF,)) + digest[1:]
        if len(self._made) < _MAX_MADE:
            self._made.add(made)
        return made

    def reversed_address(self, octets: bytes) -> bytes:
        """Return what stands for an address, last byte first, as Bluetooth sends it."""
        return self.address(octets[::-1])[::-1]

    def name(self, name: bytes) -> bytes:
        """Return what stands for a name: hex digits, after the prefix that tells a robot's model."""
        if not name.strip(b"\0"):
            return name
        text = name.rstrip(b"\0")
        self._count("name", text)
        robot = robot_by_prefix(text.decode("utf-8", "replace"))
        kept = len(robot.prefix) if robot and len(robot.prefix) < len(text) else 0
        return text[:kept] + self._digits(text, len(text) - kept) + name[len(text) :]

    def value(self, field: Field, value: bytes) -> bytes:
        """Return what stands for the value of an identifying field."""
        text = self.text_addresses(value)
        if text != value:
            return text
        if field.type == "cstring":
            return self.name(value)
        self._count("other", value)
        return self._digest(b"value", value, len(value))

    def text_addresses(self, data: bytes) -> bytes:
        """Replace the addresses that are written out in bytes, in the form and case in which they are."""

        def other(found: re.Match[bytes]) -> bytes:
            octets = bytes.fromhex(re.sub(rb"[:-]", b"", found[0]).decode())
            digits = self.address(octets).hex(found[1].decode() or ":")
            written = digits if found[1] else digits.replace(":", "")
            return (written if found[0].islower() else written.upper()).encode()

        return _TEXT_ADDRESS.sub(other, data)

    def learn_address(self, octets: bytes) -> None:
        """Look for an address, given first byte first, in all that ``everywhere`` gets, in either order."""
        if octets in self._made or len(octets) != _ADDRESS:
            return
        made = self.address(octets)
        for one, other in ((octets, made), (octets[::-1], made[::-1])):
            self._learn(one, other)
            for text, instead in ((one.hex(), other.hex()), (one.hex().upper(), other.hex().upper())):
                self._learn(text.encode(), instead.encode())
            for mark in (":", "-"):
                self._learn(one.hex(mark).encode(), other.hex(mark).encode())
                self._learn(one.hex(mark).upper().encode(), other.hex(mark).upper().encode())

    def learn_name(self, name: bytes) -> None:
        """Look for a name in all that ``everywhere`` gets."""
        text = name.rstrip(b"\0")
        if len(text) >= _LEAST:
            made = self.name(text)
            self._learn(text, made)
            self._learn(text.hex().encode(), made.hex().encode())

    def learn_value(self, field: Field, value: bytes) -> None:
        """Look for the value of an identifying field in all that ``everywhere`` gets."""
        made = self.value(field, value)
        if len(value) >= _LEAST:
            self._learn(value, made)
        for found in _TEXT_ADDRESS.finditer(value):
            self.learn_address(bytes.fromhex(re.sub(rb"[:-]", b"", found[0]).decode()))

    def everywhere(self, data: bytes) -> bytes:
        """Replace what was learned, and written addresses, wherever they are in some bytes."""
        if self._known and self._pattern is None:
            longest_first = sorted(self._known, key=len, reverse=True)
            self._pattern = re.compile(b"|".join(map(re.escape, longest_first)), re.DOTALL)
        if self._pattern:
            data = self._pattern.sub(lambda found: self._known[found[0]], data)
        return self.text_addresses(data)

    def _learn(self, one: bytes, other: bytes) -> None:
        if one not in self._known and len(self._known) < _MAX_KNOWN:
            self._known[one] = other
            self._pattern = None

    def _count(self, kind: str, value: bytes) -> None:
        if len(self._seen[kind]) < _MAX_KNOWN:
            self._seen[kind].add(value)

    def _digits(self, name: bytes, size: int) -> bytes:
        """Return that many hex digits which are not the end of the name."""
        turn = 0
        while True:
            made = self._digest(b"name%d" % turn, name, size)
            digits = made.hex().upper().encode()[:size]
            if not name.endswith(digits):
                return digits
            turn += 1

    def _digest(self, kind: bytes, value: bytes, size: int) -> bytes:
        made = b""
        while len(made) < size:
            made += blake2b(b"%d:%b:%b" % (len(made), kind, value), key=self._salt).digest()
        return made[:size]


def without_text(data: bytes) -> bytes:
    """Return bytes of unknown meaning in the same length, without what people could read in them."""
    return _READABLE.sub(lambda found: b"x" * len(found[0]), data)
