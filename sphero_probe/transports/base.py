"""The interface below the link: a byte pipe to a robot, and what is known once it is open."""

import re
from collections.abc import Callable
from contextlib import AbstractAsyncContextManager
from typing import Final, NamedTuple, Protocol

from sphero_probe.catalogue.model import Robot
from sphero_probe.protocol.packets import Generation

HARDWARE_ADDRESS: Final = re.compile(
    r"[0-9A-Fa-f]{2}(:[0-9A-Fa-f]{2}){5}|[0-9A-Fa-f]{8}(-[0-9A-Fa-f]{4}){3}-[0-9A-Fa-f]{12}"
)
"""A MAC address, or the identifier that macOS gives instead."""
WHY_UNHEARD: Final = (
    "is it awake (shake it), in range and charged, and not connected to a phone or another program?"
)
"""The likely reasons why a robot is not heard, for people."""
TRY_FAKE: Final = "or try --device fake:bolt-plus"
"""What to do where there is no robot, or no way to one; the end of a hint."""


BLE_PORT: Final = 1
"""The port nibble of target addresses over Bluetooth LE: nodes are 0x11 and 0x12 [reference]."""


class Transport(Protocol):
    """A byte pipe; the context manager that opened it closes it."""

    async def write(self, data: bytes) -> None:
        """Send bytes.

        Raises:
            LinkLostError: the robot is gone.
        """
        ...

    async def read(self) -> bytes:
        """Wait for bytes; ``b""`` once the robot is gone."""
        ...


class Connection(NamedTuple):
    """An open pipe and what is known about the other end.

    Attributes:
        transport: the pipe.
        generation: the protocol that belongs to the robot's services.
        robot: the model, None where it is not known.
        name: the advertised name, or the address where it has none.
        address: where it was reached, as ``--device`` takes it.
        port: the port nibble of target addresses on this kind of line (BLE 1, serial 0).
        again: opens a connection to the same robot again; None: open the address again.
        services: the services that the robot offers, by UUID; empty where the line knows of none.
        write_size: bytes that one write carries at most, None where the line sets no limit.
    """

    transport: Transport
    generation: Generation
    robot: Robot | None
    name: str
    address: str
    port: int = BLE_PORT
    again: Callable[[], AbstractAsyncContextManager["Connection"]] | None = None
    services: tuple[str, ...] = ()
    write_size: int | None = None

    @property
    def line(self) -> str:
        """The kind of line: ``BLE``, ``UART`` or ``RFCOMM``."""
        return "BLE" if self.port else "RFCOMM" if self.address.startswith("rfcomm:") else "UART"


class Seen(NamedTuple):
    """A robot, or whatever else is near.

    Attributes:
        name: as advertised; a stranger's text.
        robot: the model, from the prefix of the name; None for an unknown one.
        address: MAC address, or an opaque identifier on macOS.
        rssi: signal strength in dBm; None where it is not told, as for what was not heard in this scan.
        generation: the protocol of the services it offers; None where that is not known.
        connected: it is connected to this machine already, which is why it does not advertise.
    """

    name: str
    robot: Robot | None
    address: str
    rssi: int | None
    generation: Generation | None = None
    connected: bool = False

    @property
    def is_sphero(self) -> bool:
        """Whether its name or its services are those of a Sphero."""
        return self.robot is not None or self.generation is not None


class OpenOptions(NamedTuple):
    """The options of connecting.

    Attributes:
        timeout: seconds for scanning, and again for each step of connecting.
        adapter: the Bluetooth adapter, ``hci1``; empty for the system's choice.
        on_step: told the name of each step as it begins.
    """

    timeout: float = 10.0
    adapter: str = ""
    on_step: Callable[[str], None] = lambda _: None
