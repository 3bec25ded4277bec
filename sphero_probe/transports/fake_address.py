"""What the address of a built-in robot says of its line."""

from typing import Final

from sphero_probe.simulator import Line, parse_settings
from sphero_probe.simulator.network import lines_of
from sphero_probe.transports.base import BLE_PORT
from sphero_probe.transports.serial_address import PORT

CLIENT_PORTS: Final = {Line.BLE: BLE_PORT, Line.UART: PORT}
"""Line -> the port nibble of target addresses there."""


def on_a_wire(rest: str) -> str:
    """Return the address of a built-in robot as it is at the end of a wire: an RVR is reached by its UART.

    Args:
        rest: the address without its scheme; a ``line`` that it names stays.

    Raises:
        UsageError: the address makes no sense.
    """
    word, mark, query = rest.partition("?")
    has_line = any(pair.partition("=")[0] == "line" for pair in query.split("&"))
    if has_line or Line.UART not in lines_of(parse_settings(rest).model):
        return rest
    return f"{word}?line={Line.UART}{'&' if mark and query else ''}{query}"
