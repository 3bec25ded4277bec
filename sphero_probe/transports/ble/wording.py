"""What is known to fail with Bluetooth, by name, code or text, in words for a person."""

from typing import Final, NamedTuple

from bleak.exc import PROTOCOL_ERROR_CODES, BleakBluetoothNotAvailableReason

from sphero_probe.errors import (
    ConnectionFailedError,
    LastingFailureError,
    RobotNotFoundError,
    SpheroProbeError,
    UnavailableError,
)
from sphero_probe.transports.base import TRY_FAKE, WHY_UNHEARD

NO_BUS: Final = "D-Bus is not running here (a container?): start it with bluetoothd, " + TRY_FAKE
NEARER: Final = "try again, nearer to the robot"
DROPPED: Final = "the robot dropped the link"
NOT_THERE: Final = "the robot is not there any more"
NO_ADAPTER: Final = "this machine has no Bluetooth adapter"

_RESTART: Final = {
    "linux": "restart it: systemctl restart bluetooth",
    "darwin": "switch Bluetooth off and on",
    "win32": "switch Bluetooth off and on",
}
SWITCH_ON: Final = {
    "linux": "switch it on: bluetoothctl power on (blocked? rfkill unblock bluetooth)",
    "darwin": "switch it on in the Control Centre or in System Settings > Bluetooth",
    "win32": "switch it on in Settings > Bluetooth & devices (is flight mode on?)",
}
_ALLOW: Final = {
    "linux": "in a user namespace set BLEAK_DBUS_AUTH_UID to the user id outside of it",
    "darwin": "allow your terminal in System Settings > Privacy & Security > Bluetooth",
    "win32": "allow apps to use the radios in Settings > Privacy & security > Radios",
}
_FORGET: Final = {
    "linux": "forget the robot (bluetoothctl remove ADDRESS), try again; still so: bluetoothctl pair ADDRESS",
    "darwin": "forget the robot in System Settings > Bluetooth, then try again",
    "win32": "remove the robot in Settings > Bluetooth & devices, then try again; still so: pair it there",
}


class Words(NamedTuple):
    """A message for a person.

    Attributes:
        kind: the error, and with it the exit code.
        said: what happened.
        hint: what to do, or a table of that by ``sys.platform``.
    """

    kind: type[SpheroProbeError]
    said: str
    hint: str | dict[str, str]

    def on(self, platform: str, before: str = "") -> SpheroProbeError:
        """Return the error as it reads on a platform; Linux speaks for those that are not listed.

        Args:
            platform: as ``sys.platform`` has it.
            before: the step, where the words do not name it themselves.
        """
        hint = self.hint if isinstance(self.hint, str) else self.hint.get(platform, self.hint["linux"])
        return self.kind(f"{before}: {self.said}" if before else self.said, hint)


_Reason = BleakBluetoothNotAvailableReason

NOT_AVAILABLE: Final[dict[BleakBluetoothNotAvailableReason, Words]] = {
    _Reason.NO_BLUETOOTH: Words(UnavailableError, NO_ADAPTER, "plug one in, " + TRY_FAKE),
    _Reason.NO_BLE_CENTRAL_ROLE: Words(
        UnavailableError,
        "this machine's Bluetooth adapter cannot connect to Bluetooth LE devices",
        "plug in one that can, " + TRY_FAKE,
    ),
    _Reason.POWERED_OFF: Words(UnavailableError, "Bluetooth is switched off", SWITCH_ON),
    _Reason.DENIED_BY_USER: Words(UnavailableError, "you have denied Bluetooth to this terminal", _ALLOW),
    _Reason.DENIED_BY_SYSTEM: Words(
        UnavailableError,
        "the system denies Bluetooth to this program",
        _ALLOW | {"darwin": "ask the administrator of this Mac to lift the restriction"},
    ),
    _Reason.DENIED_BY_UNKNOWN: Words(UnavailableError, "Bluetooth is denied to this program", _ALLOW),
    _Reason.UNKNOWN: Words(
        UnavailableError,
        "Bluetooth does not tell what state it is in",
        _RESTART | {"linux": "look at: bluetoothctl show"},
    ),
}
"""Why there is no Bluetooth -> words, for every reason that bleak knows."""

MUTE: Final = Words(UnavailableError, "the Bluetooth service does not answer", _RESTART)
BUS_DIED: Final = Words(
    UnavailableError, "the connection to D-Bus broke", "was D-Bus or bluetoothd restarted? try again"
)
LOCKED_OUT: Final = NOT_AVAILABLE[_Reason.DENIED_BY_SYSTEM]
OLDEST_BLUEZ: Final = "5.55"
"""The first version that bleak talks to [bleak, backends/bluezdbus/version.py]."""
TOO_OLD: Final = Words(UnavailableError, "BlueZ is too old", f"update it to {OLDEST_BLUEZ} or later")
UNPAIRED: Final = Words(
    LastingFailureError, "the robot wants a pairing (insufficient authentication or encryption)", _FORGET
)
UNREACHABLE: Final = Words(ConnectionFailedError, "no answer in time", WHY_UNHEARD)
NEVER_RESOLVED: Final = Words(
    ConnectionFailedError,
    "the robot is connected and does not tell which it has",
    _FORGET | {"linux": "wake it; still so: bluetoothctl remove ADDRESS, then try again"},
)
_NO_START: Final = Words(UnavailableError, "BlueZ does not start", "look at: systemctl status bluetooth")

DBUS: Final[dict[str, Words]] = {
    "AccessDenied": Words(
        UnavailableError,
        "access to Bluetooth is denied",
        "add your user to the group bluetooth and log in again",
    ),
    "ServiceUnknown": Words(
        UnavailableError, "BlueZ is not running", "install and start bluetoothd (Debian: apt install bluez)"
    ),
    "NameHasNoOwner": Words(UnavailableError, "BlueZ is not running", "start it: systemctl start bluetooth"),
    "Spawn": _NO_START,
    "NoSuchUnit": _NO_START,
    "NoReply": MUTE,
    "Timeout": MUTE,
    "TimedOut": MUTE,
    "Disconnected": BUS_DIED,
    "NotReady": Words(UnavailableError, "the Bluetooth adapter is switched off", SWITCH_ON),
    "InProgress": Words(
        ConnectionFailedError,
        "BlueZ is busy with another request",
        "close what else uses Bluetooth, try again",
    ),
    "UnknownObject": Words(RobotNotFoundError, NOT_THERE, WHY_UNHEARD),
    "DoesNotExist": Words(RobotNotFoundError, NOT_THERE, WHY_UNHEARD),
    "AuthenticationFailed": UNPAIRED,
    "AuthenticationRejected": UNPAIRED,
    "AuthenticationCanceled": UNPAIRED,
    "AuthenticationTimeout": UNPAIRED,
}
"""A part between the dots of a D-Bus error's name -> words."""

_GONE: Final = Words(ConnectionFailedError, DROPPED, NEARER)
_GIVEN_UP: Final = Words(ConnectionFailedError, "the radio gave the connection up", NEARER)

TEXTS: Final[tuple[tuple[str, Words], ...]] = (
    ("not paired", UNPAIRED),
    ("not connected", _GONE),
    ("disconnected", _GONE),
    ("service discovery has not been performed", _GONE),
    ("connection abort", _GIVEN_UP),
    ("connection-abort", _GIVEN_UP),
    ("connection timed out", UNREACHABLE),
    ("page timeout", UNREACHABLE),
    ("host is down", UNREACHABLE),
    ("access denied", Words(ConnectionFailedError, "the system denies access to the robot", _FORGET)),
    ("unreachable", Words(ConnectionFailedError, "the robot cannot be reached", WHY_UNHEARD)),
    ("requires bluez", TOO_OLD),
)
"""A piece of an error's text, lower case -> words; the first that fits counts."""

_TO_DO: Final[dict[int, str | dict[str, str]]] = {
    **dict.fromkeys((0x05, 0x08, 0x0C, 0x0F), _FORGET),
    **dict.fromkeys(
        (0x02, 0x03, 0x06),
        "this firmware is laid out otherwise: please report it with the output of sphero-probe info -v",
    ),
    **dict.fromkeys((0x11, 0xFE), "the robot is busy: wait a moment and try again"),
    **dict.fromkeys(
        (0x01, 0x0A, 0x12), _FORGET | {"linux": "its services changed: bluetoothctl remove ADDRESS"}
    ),
}


def att_words(code: int) -> Words:
    """Return what an ATT error code means [Bluetooth Core 5.2, Vol 3 Part F, 3.4.1.1]."""
    name = PROTOCOL_ERROR_CODES.get(code, "not in the specification").lower()
    hint = _TO_DO.get(code, "wake the robot and try again")
    return Words(LastingFailureError, f"the robot refuses with ATT error 0x{code:02x}, {name}", hint)
