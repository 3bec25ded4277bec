"""How a client of the built-in robot writes target addresses, by the line that it comes through."""

from typing import Final

from sphero_probe.simulator import Line
from sphero_probe.transports.base import BLE_PORT
from sphero_probe.transports.serial_address import PORT

CLIENT_PORTS: Final = {Line.BLE: BLE_PORT, Line.UART: PORT}
"""Line -> the port nibble of target addresses there."""
