"""Names BLE services by their UUID, for messages."""

from collections.abc import Iterable
from typing import Final

from sphero_probe.catalogue.gatt import API_SERVICE, V1_CONTROL_SERVICE, V1_RADIO_SERVICE

_NAMED: Final = 6
"""Most services that are listed; the rest is counted."""
_UUID_LENGTH: Final = 36
_ASSIGNED: Final = "0000{:04x}-0000-1000-8000-00805f9b34fb"

SERVICES: Final = {
    API_SERVICE: "Sphero V2 API",
    "00020001-574f-4f20-5370-6865726f2121": "Sphero V2 gate",
    V1_CONTROL_SERVICE: "Sphero V1 control",
    V1_RADIO_SERVICE: "Sphero V1 radio",
    "00001530-1212-efde-1523-785feabcd123": "Nordic firmware update",
    _ASSIGNED.format(0x1800): "generic access",
    _ASSIGNED.format(0x1801): "generic attribute",
    _ASSIGNED.format(0x180A): "device information",
    _ASSIGNED.format(0x180F): "battery",
    _ASSIGNED.format(0xFE59): "Nordic firmware update",
}
"""UUID in lower case -> what it is for [sdk, Bluetooth Assigned Numbers 3.4, Nordic nRF5 SDK]."""


def list_services(uuids: Iterable[str]) -> str:
    """Return a list of services as text: known ones by name, others by UUID; ``none`` for none."""
    names = list(dict.fromkeys(SERVICES.get(uuid.lower(), uuid[:_UUID_LENGTH]) for uuid in uuids))
    if len(names) > _NAMED:
        names[_NAMED:] = [f"and {len(names) - _NAMED} more"]
    return ", ".join(names) or "none"
