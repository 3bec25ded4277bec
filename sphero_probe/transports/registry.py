"""Which module opens which scheme of a device address."""

import re
from collections.abc import Callable
from contextlib import AbstractAsyncContextManager
from importlib import import_module
from typing import Final, NamedTuple

from sphero_probe.errors import UsageError, did_you_mean
from sphero_probe.transports.base import HARDWARE_ADDRESS, Connection, OpenOptions, Seen

SCHEMES: Final[dict[str, str]] = {
    "ble": "sphero_probe.transports.ble",
    "fake": "sphero_probe.transports.fake",
    "replay": "sphero_probe.transports.replay",
    "rfcomm": "sphero_probe.transports.serial:open_rfcomm",
    "serial": "sphero_probe.transports.serial",
}
"""Scheme of an address -> module with ``open_connection(rest, options)``, or ``module:function`` where that
has another name; imported when it is opened."""

_SCHEME = re.compile(r"([a-z]+):(.*)", re.DOTALL)


class DeviceAddress(NamedTuple):
    """A robot's address, taken apart.

    Attributes:
        scheme: how to reach it, a key of ``SCHEMES``.
        rest: what the scheme's module understands.
    """

    scheme: str
    rest: str

    def __str__(self) -> str:
        """Write it as ``--device`` takes it."""
        return f"{self.scheme}:{self.rest}"


def parse_address(text: str) -> DeviceAddress:
    """Return the address that a person wrote; a name or MAC alone means Bluetooth.

    Raises:
        UsageError: empty, or a scheme that no module opens.
    """
    text = text.strip()
    if not text:
        raise UsageError("empty device address", "try --device fake:bolt-plus")
    match = _SCHEME.fullmatch(text)
    if match is None or HARDWARE_ADDRESS.fullmatch(text):
        return DeviceAddress("ble", text)
    scheme, rest = match.groups()
    if scheme not in SCHEMES:
        raise UsageError(
            f"unknown kind of device address '{scheme}:'",
            did_you_mean(f"{scheme}:", (f"{known}:" for known in SCHEMES)),
        )
    if not rest:
        raise UsageError(f"'{scheme}:' names no robot", f"try --device {scheme}:…, or fake:bolt-plus")
    return DeviceAddress(scheme, rest)


def open_transport(
    address: DeviceAddress, options: OpenOptions | None = None
) -> AbstractAsyncContextManager[Connection]:
    """Return a context manager that connects, and closes on leaving.

    Raises:
        SpheroProbeError: on entering, when the robot cannot be reached.
    """
    module, _, function = SCHEMES[address.scheme].partition(":")
    open_connection = getattr(import_module(module), function or "open_connection")
    opened: AbstractAsyncContextManager[Connection] = open_connection(address.rest, options or OpenOptions())
    return opened


async def scan(options: OpenOptions, *, everything: bool = False) -> list[Seen]:
    """Return the robots nearby, strongest first, and then those that this machine is connected to.

    Args:
        options: time and adapter.
        everything: also what is no Sphero.

    Raises:
        UnavailableError: no Bluetooth here.
    """
    seen: list[Seen] = await import_module(SCHEMES["ble"]).scan(options, everything=everything)
    return seen


async def watch(options: OpenOptions, on_seen: Callable[[Seen], None], *, everything: bool = False) -> None:
    """Report every robot each time it advertises.

    Args:
        options: time, which may be infinite, and adapter.
        on_seen: called with what is known of the robot; it must not raise.
        everything: also what is no Sphero.

    Raises:
        UnavailableError: no Bluetooth here, or not any more.
    """
    await import_module(SCHEMES["ble"]).watch(options, on_seen, everything=everything)
