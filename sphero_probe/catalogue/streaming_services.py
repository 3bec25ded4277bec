"""RVR's streaming services: what a client has configured, and what the delivered numbers mean.

For each of four tokens, a client configures the services that a node sends and their size (0x18:0x39), then
starts them all (0x18:0x3A). After that the node sends one notification (0x18:0x3D) per token and period: the
token, then the values of its services in the same order. A value is an unsigned number of 8, 16 or 32 bits, a
fraction of the service's range [sdk: the service table of the maker's Python SDK and how it reads values].
"""

from collections.abc import Mapping
from typing import Final, NamedTuple

from sphero_probe.catalogue.payload.layout import Decoded
from sphero_probe.protocol.address import WILDCARD, node_of
from sphero_probe.protocol.packets import Command

CONFIGURE: Final = (0x18, 0x39)
START: Final = (0x18, 0x3A)
STOP: Final = (0x18, 0x3B)
CLEAR: Final = (0x18, 0x3C)
DELIVER: Final = (0x18, 0x3D)
"""The (did, cid) of the commands and of the notification."""

TOKENS: Final = range(1, 5)
"""The tokens that the maker's SDK uses; a notification has one in its lower four bits."""
MOST_SERVICES: Final = 5
"""Most services of one token: the configuration has 15 bytes in the maker's SDK."""
BITS: Final = {0: 8, 1: 16, 2: 32}
"""Size byte of a configuration -> bits of a value."""
_STATUS: Final = 0x10
"""Added to the token in the first byte of a delivery if the values are not valid [sdk]."""
_ENTRY: Final = 3
"""Bytes of one service in a configuration: id u16, size u8."""


class Channel(NamedTuple):
    """One value of a service.

    Attributes:
        name: unique among all services: ``pitch``, ``accelerometer_x``.
        minimum: the value that 0 stands for.
        maximum: the value that the largest number stands for.
        unit: of the value, empty where it has none.
        whole: the value is a whole number.
    """

    name: str
    minimum: float
    maximum: float
    unit: str = ""
    whole: bool = False


class Service(NamedTuple):
    """One streaming service.

    Attributes:
        id: its number in a configuration.
        name: its name.
        nodes: the nodes that have it.
        channels: its values in the order of the wire.
        least_bits: fewest bits of a value; a real robot rejected fewer.
    """

    id: int
    name: str
    nodes: tuple[int, ...]
    channels: tuple[Channel, ...]
    least_bits: int = 8


class Slot(NamedTuple):
    """One service of a configuration, and the bits of its values."""

    service: Service
    bits: int


Configurations = Mapping[tuple[int, int], tuple[Slot, ...]]
"""(node, token) -> the services that were configured for it."""

_PRIMARY, _SECONDARY = 1, 2
_WHOLE_COUNT: Final = 0xFFFF_FFFF


def _axes(name: str, limit: float, unit: str, axes: str = "xyz") -> tuple[Channel, ...]:
    return tuple(Channel(f"{name}_{axis}", -limit, limit, unit) for axis in axes)


def _count(name: str, unit: str = "") -> Channel:
    return Channel(name, 0, _WHOLE_COUNT, unit, whole=True)


def _byte(name: str) -> Channel:
    return Channel(name, 0, 255, whole=True)


SERVICES: Final[dict[int, Service]] = {
    service.id: service
    for service in (
        Service(0x00, "quaternion", (_SECONDARY,), _axes("quaternion", 1, "", "wxyz")),
        Service(
            0x01,
            "imu",
            (_SECONDARY,),
            (
                Channel("pitch", -180, 180, "deg"),
                Channel("roll", -90, 90, "deg"),
                Channel("yaw", -180, 180, "deg"),
            ),
        ),
        Service(0x02, "accelerometer", (_SECONDARY,), _axes("accelerometer", 16, "g")),
        Service(
            0x03,
            "color_detection",
            (_PRIMARY,),
            (
                _byte("red"),
                _byte("green"),
                _byte("blue"),
                _byte("color_index"),
                Channel("color_confidence", 0, 1),
            ),
        ),
        Service(0x04, "gyroscope", (_SECONDARY,), _axes("gyroscope", 2000, "deg/s")),
        Service(0x06, "locator", (_SECONDARY,), _axes("locator", 16000, "m", "xy")),
        Service(0x07, "velocity", (_SECONDARY,), _axes("velocity", 5, "m/s", "xy")),
        Service(0x08, "speed", (_SECONDARY,), (Channel("speed", 0, 5, "m/s"),)),
        Service(
            0x09,
            "core_time",
            (_PRIMARY, _SECONDARY),
            (_count("core_time_upper"), _count("core_time_lower", "ms")),
        ),
        Service(
            0x0A,
            "ambient_light",
            (_PRIMARY,),
            (Channel("ambient_light", 0, 120_000, "lx"),),
            least_bits=32,  # RVR 8.3.432 answers 0x06 to 16 [real: sphero-sdk-raspberrypi-nodejs#6]
        ),
        Service(
            0x0B,
            "encoders",
            (_SECONDARY,),
            (_count("encoder_left", "ticks"), _count("encoder_right", "ticks")),
        ),
    )
}
"""Every known service by its id."""


class Configuration(NamedTuple):
    """The contents of a configure command.

    Attributes:
        token: the token as sent.
        slots: the services in order; empty if there is a ``problem``.
        problem: what is wrong with it, or empty.
    """

    token: int
    slots: tuple[Slot, ...]
    problem: str = ""


def configuration(payload: bytes, node: int | None = None) -> Configuration:
    """Read the argument bytes of a configure command; no bytes make this raise.

    Args:
        payload: token u8, then per service its id u16 and its size u8.
        node: the node that must have the services; None accepts any that are well formed.
    """
    token, entries = payload[0] if payload else 0, payload[1:]
    if token not in TOKENS:
        return Configuration(token, (), f"token {token} is not in 1-{TOKENS[-1]}")
    if not entries or len(entries) % _ENTRY or len(entries) > MOST_SERVICES * _ENTRY:
        return Configuration(token, (), f"{len(entries)} bytes are not 1-{MOST_SERVICES} services of 3 bytes")
    slots: list[Slot] = []
    for at in range(0, len(entries), _ENTRY):
        number, size = int.from_bytes(entries[at : at + 2], "big"), entries[at + 2]
        service, bits = SERVICES.get(number), BITS.get(size)
        if service is None or bits is None:
            return Configuration(token, (), f"service 0x{number:04x} in size {size} is not known")
        if node and node not in service.nodes:
            return Configuration(token, (), f"node {node} does not have {service.name}")
        if node and bits < service.least_bits:
            return Configuration(token, (), f"{service.name} in {bits} bits was rejected by a real robot")
        slots.append(Slot(service, bits))
    if len({slot.service.id for slot in slots}) < len(slots):
        return Configuration(token, (), "a service is named twice")
    return Configuration(token, tuple(slots))


def configured_after(configured: Configurations, command: Command) -> Configurations:
    """Return the configuration after a robot has executed a command; most commands change nothing.

    Args:
        configured: the configuration before; ``{}`` for a robot that was just switched on.
        command: the command; its target is the node; None and the wildcard stand for any.
    """
    pair, node = (command.did, command.cid), node_of(command.target)
    if pair == CONFIGURE:
        asked = configuration(command.payload)
        return {**configured, (node, asked.token): asked.slots}
    if pair == CLEAR:
        return {key: slots for key, slots in configured.items() if node and key[0] != node}
    return configured


def delivered_fields(configured: Configurations, payload: bytes, source: int | None) -> Decoded | None:
    """Decode the payload of a delivery; no bytes make this raise.

    Args:
        configured: the configuration when it was sent.
        payload: of the notification ``DELIVER``: the token, then the values.
        source: address of the node that sent it, None where absent.

    Returns:
        ``token`` and the values by name, ``valid: False`` where the node marks them as not valid. None if
        the configuration of this token was not seen, if more than one node may have sent it, or if the length
        is not the configured one: then the numbers have no names.
    """
    if not payload:
        return None
    status, token = divmod(payload[0], _STATUS)
    slots = _slots(configured, node_of(source), token)
    if not slots or len(payload) - 1 != sum(slot.bits // 8 * len(slot.service.channels) for slot in slots):
        return None
    fields: dict[str, object] = {"token": token}
    if status:
        fields["valid"] = False
    units: dict[str, str] = {}
    at = 1
    for service, bits in slots:
        for channel in service.channels:
            raw = int.from_bytes(payload[at : at + bits // 8], "big")
            fields[channel.name] = value_of(channel, raw, bits)
            if channel.unit:
                units[channel.name] = channel.unit
            at += bits // 8
    return Decoded(fields, units, b"", "")


def value_of(channel: Channel, raw: int, bits: int) -> float:
    """Return the value that a number stands for, rounded to six decimals."""
    value = raw / ((1 << bits) - 1) * (channel.maximum - channel.minimum) + channel.minimum
    return round(value) if channel.whole else round(value, 6)


def raw_of(channel: Channel, value: float, bits: int) -> int:
    """Return the number that stands for a value, the opposite of ``value_of``; nearest if out of range."""
    share = (value - channel.minimum) / (channel.maximum - channel.minimum)
    return round(min(max(share, 0.0), 1.0) * ((1 << bits) - 1))


def _slots(configured: Configurations, node: int, token: int) -> tuple[Slot, ...]:
    """Return the configuration of a token on a node, or of the only node that has the token."""
    if (node, token) in configured:
        return configured[node, token]
    if (WILDCARD, token) in configured:
        return configured[WILDCARD, token]
    if node:
        return ()
    found = [slots for (_, known), slots in configured.items() if known == token]
    return found[0] if len(found) == 1 else ()
