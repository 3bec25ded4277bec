"""How each generation is reached over Bluetooth LE: the characteristics that unlock, receive and send."""

from typing import Final, NamedTuple

from sphero_probe.protocol.packets import Generation

API_SERVICE = "00010001-574f-4f20-5370-6865726f2121"
"""V2: the BLE service that holds the API characteristic."""
API_CHARACTERISTIC = "00010002-574f-4f20-5370-6865726f2121"
"""V2: commands are written to it; responses and notifications arrive from it."""
ANTI_DOS_CHARACTERISTIC = "00020005-574f-4f20-5370-6865726f2121"
"""V2: many models stay silent until the phrase is written to it; absent on BOLT+ and RVR."""
ANTI_DOS_PHRASE = b"usetheforce...band"
"""V2: the phrase."""

V1_RADIO_SERVICE = "22bb746f-2bb0-7554-2d6f-726568705327"
"""V1: the BLE service of the characteristics that unlock and wake the robot."""
V1_ANTI_DOS_CHARACTERISTIC = "22bb746f-2bbd-7554-2d6f-726568705327"
"""V1: the robot stays silent until the phrase is written to it; in the radio service."""
V1_ANTI_DOS_PHRASE = b"011i3"
"""V1: the phrase."""
V1_TX_POWER_CHARACTERISTIC = "22bb746f-2bb2-7554-2d6f-726568705327"
"""V1: sets the transmit power; in the radio service."""
V1_TX_POWER = b"\x07"
"""V1: the transmit power that known clients set."""
V1_WAKE_CHARACTERISTIC = "22bb746f-2bbf-7554-2d6f-726568705327"
"""V1: a write wakes the robot, which no command can do; in the radio service."""
V1_WAKE = b"\x01"
"""V1: what is written to wake it."""
V1_HANDSHAKE = (
    (V1_ANTI_DOS_CHARACTERISTIC, V1_ANTI_DOS_PHRASE),
    (V1_TX_POWER_CHARACTERISTIC, V1_TX_POWER),
    (V1_WAKE_CHARACTERISTIC, V1_WAKE),
)
"""V1: what is written to which characteristic, in this order, before the first command."""
V1_CONTROL_SERVICE = "22bb746f-2ba0-7554-2d6f-726568705327"
"""V1: the BLE service of commands and responses."""
V1_COMMAND_CHARACTERISTIC = "22bb746f-2ba1-7554-2d6f-726568705327"
"""V1: commands are written to it; in the control service."""
V1_RESPONSE_CHARACTERISTIC = "22bb746f-2ba6-7554-2d6f-726568705327"
"""V1: responses and asynchronous messages arrive from it as notifications; in the control service."""


class GattProfile(NamedTuple):
    """The services and characteristics of a generation.

    Attributes:
        generation: the protocol.
        service: the service of the commands, as some robots advertise it.
        unlock: characteristics and the bytes to write to them first, in this order; those that a robot does
            not have are skipped.
        commands: where command frames are written.
        answers: where frames from the robot arrive, as notifications.
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
"""Every known profile, in the order in which a robot's services are compared with them."""
