"""Plausible answers of a robot to its documented reads, from catalogue rows and a seed."""

import math
from random import Random
from typing import Final, NamedTuple

from sphero_probe.catalogue.model import CommandRow, Robot
from sphero_probe.catalogue.payload.enums import VALUE_NAMES
from sphero_probe.catalogue.payload.layout import Field, Layout

_BY_NAME: Final[tuple[tuple[str, float, float], ...]] = (
    ("record_version", 1, 1),
    ("major", 4, 9),
    ("minor", 0, 9),
    ("revision", 100, 499),
    ("year", 2018, 2024),
    ("month", 1, 12),
    ("day", 1, 28),
    ("hysteresis", 0.05, 0.1),
    ("critical_threshold", 3.3, 3.4),
    ("low_threshold", 3.5, 3.6),
    ("battery_voltage", 7.2, 8.2),
    ("low_trip", 7.0, 7.0),
    ("critical_trip", 6.5, 6.5),
    ("degrees", 18, 36),
    ("tenths", 0, 9),
)
"""Part of a field's name, and the range of its value; the first that matches is used, before the unit."""
_BY_UNIT: Final[dict[str, tuple[float, float]]] = {
    "%": (20, 100),
    "V": (3.6, 4.2),
    "mV": (3600, 4200),
    "A": (0.01, 0.4),
    "mA": (10, 400),
    "C": (18, 36),
    "degC": (18, 36),
    "°C": (18, 36),
    "deg": (-90, 90),
    "lux": (50, 500),
    "lx": (50, 500),
}
_BY_TYPE: Final[dict[str, tuple[float, float]]] = {
    "u8": (0, 31),
    "u16": (0, 999),
    "u32": (0, 99_999),
    "u64": (0, 999_999),
    "i8": (-20, 20),
    "i16": (-180, 180),
    "i32": (-9999, 9999),
    "f32": (0.0, 1.0),
    "uint": (0, 9999),
}
_LARGEST: Final = {"u8": 0xFF, "i8": 0x7F, "u16": 0xFFFF, "i16": 0x7FFF}
_DULL: Final = {"unknown", "reserved", "unused", "critical"}
_ID_COLOURS: Final = "BGOPRWY"
_MOST: Final = 6
"""Elements or bytes at most where a layout does not fix the number."""


class Identity(NamedTuple):
    """What distinguishes robots of one model.

    Attributes:
        name: as advertised; the model's prefix and the end of the address, without a prefix ``Sphero-`` and
            three letters that stand for colours.
        address: a random static, locally administered MAC, ``C6:01:…``.
    """

    name: str
    address: str


def identity(robot: Robot, seed: int) -> Identity:
    """Draw a name and an address."""
    chance = Random(f"{seed} {robot.key} address")
    first, *rest = chance.randbytes(6)
    address = bytes((first & 0x3C | 0xC2, *rest)).hex(":").upper()
    if robot.prefix:
        return Identity(f"{robot.prefix}{address[-5:].replace(':', '')}", address)
    return Identity("Sphero-" + "".join(chance.choices(_ID_COLOURS, k=3)), address)


class Readings:
    """The answers of one robot to its documented reads; the same ones for its whole life.

    Attributes:
        identity: its name and address.
    """

    def __init__(self, robot: Robot, seed: int) -> None:
        self._robot = robot
        self._seed = seed
        self.identity = identity(robot, seed)

    def payload(self, row: CommandRow, node: int) -> bytes:
        """Return the data of a response or notification of one node; a few bytes where no layout is known."""
        chance = Random(f"{self._seed} {self._robot.key} {node} {row.did} {row.cid}")
        if row.response is None:
            return chance.randbytes(chance.randrange(1, _MOST))
        text = self._texts(node).get(row.name.rpartition(".")[2]) or None
        return self._fill(row.response, chance, text)

    def secret(self, did: int, cid: int, node: int) -> bytes:
        """Return the data with which a hidden command answers."""
        chance = Random(f"{self._seed} {self._robot.key} {node} {did} {cid}")
        return chance.randbytes(chance.randrange(0, _MOST))

    def _texts(self, node: int) -> dict[str, str]:
        return {
            "get_mac_address": self.identity.address.replace(":", "").lower(),
            "get_bluetooth_name": self.identity.name,
            "get_bluetooth_advertising_name": self.identity.name,
            "get_sku": self._robot.sku,
            "get_three_character_sku": self._robot.sku,
            "get_sku_lmq": self._robot.sku,
            "get_model_number": self._robot.sku,
            "get_processor_name": self._robot.nodes.get(node, ""),
        }

    def _fill(self, layout: Layout, chance: Random, text: str | None) -> bytes:
        """Give every field a value but those that some robots leave out."""
        fields = (field for field in layout.fields if not field.optional)
        return layout.encode({field.name: _value(field, chance, text) for field in fields})


def _value(field: Field, chance: Random, text: str | None) -> object:
    if field.type in ("bytes", "cstring"):
        return _blob(field, chance, text)
    if field.count is None and not field.to_end:
        return _number(field, chance)
    if field.type == "uint":
        return _number(field, chance)
    count = field.count if field.count is not None else chance.randrange(_MOST)
    return [_number(field, chance) for _ in range(count)]


def _blob(field: Field, chance: Random, text: str | None) -> str:
    """Text for ``cstring``, hex for ``bytes``, no longer than the field."""
    if text is None and field.type == "bytes":
        return chance.randbytes(field.count if field.count is not None else chance.randrange(1, _MOST)).hex()
    data = ("".join(chance.choices("abcdefghijkmnpqrstuvwxyz", k=_MOST)) if text is None else text).encode()
    data = data[: field.count]
    return data.hex() if field.type == "bytes" else data.decode()


def _number(field: Field, chance: Random) -> object:
    if field.values:
        names = VALUE_NAMES[field.values]
        if names.flags:
            return [name for name in names.names.values() if chance.random() < 1 / 2]
        likely = [name for name in names.names.values() if name not in _DULL]
        return chance.choice(likely or list(names.names.values()))
    if field.type == "bool":
        return chance.random() < 1 / 2
    low, high = _range(field)
    value = chance.uniform(low, high)
    return round(value, 2) if field.type == "f32" or field.scale != 1 else round(value)


def _range(field: Field) -> tuple[float, float]:
    least = 0 if field.type.startswith("u") else -math.inf
    for part, low, high in _BY_NAME:
        if part in field.name and high <= _LARGEST.get(field.type, high):
            return low, high
    low, high = _BY_UNIT.get(field.unit) or _BY_TYPE.get(field.type, (0, 0))
    most = float(_LARGEST.get(field.type, math.inf) / field.scale)
    return max(low, least, -most), min(high, most)
