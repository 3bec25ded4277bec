"""How each generation is reached over Bluetooth LE: which characteristics unlock, hear and speak."""

from typing import Final, NamedTuple

from sphero_probe.protocol.packets import Generation

API_SERVICE = "00010001-574f-4f20-5370-6865726f2121"
"""V2: the BLE service that holds the API characteristic."""
API_CHARACTERISTIC = "00010002-574f-4f20-5370-6865726f2121"
"""V2: commands are written to it, answers and notifications come from it."""
ANTI_DOS_CHARACTERISTIC = "00020005-574f-4f20-5370-6865726f2121"
"""V2: takes the phrase without which many models stay silent; absent on BOLT+ and RVR."""
ANTI_DOS_PHRASE = b"usetheforce...band"
"""V2: the phrase."""

V1_RADIO_SERVICE = "22bb746f-2bb0-7554-2d6f-726568705327"
"""V1: the BLE service of what must be written before the robot listens, and of what wakes it."""
V1_ANTI_DOS_CHARACTERISTIC = "22bb746f-2bbd-7554-2d6f-726568705327"
"""V1: takes the phrase without which the robot stays silent; in the radio service."""
V1_ANTI_DOS_PHRASE = b"011i3"
"""V1: the phrase."""
V1_TX_POWER_CHARACTERISTIC = "22bb746f-2bb2-7554-2d6f-726568705327"
"""V1: takes the strength at which the robot sends; in the radio service."""
V1_TX_POWER = b"\x07"
"""V1: the strength that known clients ask for."""
V1_WAKE_CHARACTERISTIC = "22bb746f-2bbf-7554-2d6f-726568705327"
"""V1: a write wakes the robot, which no command can; in the radio service."""
V1_WAKE = b"\x01"
"""V1: what is written to wake it."""
V1_HANDSHAKE = (
    (V1_ANTI_DOS_CHARACTERISTIC, V1_ANTI_DOS_PHRASE),
    (V1_TX_POWER_CHARACTERISTIC, V1_TX_POWER),
    (V1_WAKE_CHARACTERISTIC, V1_WAKE),
)
"""V1: what is written to which characteristic, in this order, before the first command."""
V1_CONTROL_SERVICE = "22bb746f-2ba0-7554-2d6f-726568705327"
"""V1: the BLE service of commands and answers."""
V1_COMMAND_CHARACTERISTIC = "22bb746f-2ba1-7554-2d6f-726568705327"
"""V1: commands are written to it; in the control service."""
V1_RESPONSE_CHARACTERISTIC = "22bb746f-2ba6-7554-2d6f-726568705327"
"""V1: answers and asynchronous messages come from it as notifications; in the control service."""


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
