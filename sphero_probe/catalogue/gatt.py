"""How each generation is reached over Bluetooth LE: which characteristics unlock, hear and speak."""

from typing import Final, NamedTuple

from sphero_probe.catalogue.robots import (
    ANTI_DOS_CHARACTERISTIC,
    ANTI_DOS_PHRASE,
    API_CHARACTERISTIC,
    API_SERVICE,
    V1_COMMAND_CHARACTERISTIC,
    V1_CONTROL_SERVICE,
    V1_HANDSHAKE,
    V1_RESPONSE_CHARACTERISTIC,
)
from sphero_probe.protocol.packets import Generation


class GattProfile(NamedTuple):
    """The GATT face of a generation.

    Attributes:
        generation: the protocol that is spoken through it.
        service: the service of the commands, as some robots advertise it.
        unlock: characteristic and bytes to write, in this order, before anything else; those that a robot
            does not have are passed over.
        commands: where command frames are written.
        answers: where frames from the robot are notified.
    """

    generation: Generation
    service: str
    unlock: tuple[tuple[str, bytes], ...]
    commands: str
    answers: str


PROFILES: Final = (
    GattProfile(
        Generation.V2,
        API_SERVICE,
        ((ANTI_DOS_CHARACTERISTIC, ANTI_DOS_PHRASE),),
        API_CHARACTERISTIC,
        API_CHARACTERISTIC,
    ),
    GattProfile(
        Generation.V1,
        V1_CONTROL_SERVICE,
        V1_HANDSHAKE,
        V1_COMMAND_CHARACTERISTIC,
        V1_RESPONSE_CHARACTERISTIC,
    ),
)
"""Every known face, in the order in which a robot's services are compared with them."""
