"""Share Bluetooth adapters among robots: so many connections on each, and one connecting at a time.

An adapter carries few connections at once. BlueZ allows each program one scan per adapter, and an adapter can
set up only one connection at a time; so scanning and connecting take turns on each adapter.
"""

import asyncio
import sys
from collections.abc import AsyncIterator, Iterable
from contextlib import AsyncExitStack, asynccontextmanager
from typing import Final

from sphero_probe.transports.base import Connection, OpenOptions
from sphero_probe.transports.registry import DeviceAddress, open_transport

PER_ADAPTER: Final = 4
"""Connections on one adapter at a time, unless told otherwise: most adapters carry 4 to 6 reliably."""
_ASKING: Final = 3.0
"""Seconds for asking which adapters there are."""
_RADIO: Final = "ble"
"""The scheme of addresses that need an adapter."""


class Adapter:
    """A way to robots: a Bluetooth adapter, or whatever else needs no sharing.

    Attributes:
        name: ``hci0``; empty for the system's choice.
        connections: places that are taken.
    """

    def __init__(self, name: str, turn: asyncio.Lock | None = None) -> None:
        """Describe a way to robots.

        Args:
            name: as the attribute.
            turn: held while a robot is connected, None where robots need not take turns.
        """
        self.name = name
        self.connections = 0
        self._turn = turn

    @asynccontextmanager
    async def open(self, address: DeviceAddress, options: OpenOptions) -> AsyncIterator[Connection]:
        """Connect to a robot, and close the connection on leaving; it can be opened again the same way.

        Raises:
            SpheroProbeError: the robot cannot be reached.
        """
        turn = self._turn
        if turn is None:
            async with open_transport(address, options) as connection:
                yield connection
            return
        options = options._replace(adapter=self.name)

        async def connect(to: DeviceAddress) -> Connection:
            if turn.locked():
                options.on_step("wait for the adapter")
            async with turn:
                return await line.enter_async_context(open_transport(to, options))

        async with AsyncExitStack() as line:
            connection = await connect(address)
            reached = DeviceAddress(_RADIO, connection.address.partition(":")[2])

            @asynccontextmanager
            async def again() -> AsyncIterator[Connection]:
                await line.aclose()
                yield await connect(reached)

            yield connection._replace(again=again)


class Adapters:
    """The adapters of this machine, used in turn."""

    def __init__(self, names: Iterable[str] = ("",), per_adapter: int = PER_ADAPTER) -> None:
        """Share adapters.

        Args:
            names: of the adapters; an empty name is the system's choice.
            per_adapter: connections on each at a time.
        """
        self._adapters = [Adapter(name, asyncio.Lock()) for name in dict.fromkeys(names)]
        self._places = asyncio.Semaphore(per_adapter * len(self._adapters))

    @asynccontextmanager
    async def place(self, address: DeviceAddress) -> AsyncIterator[Adapter]:
        """Wait for a place, and keep it while the block lasts.

        Args:
            address: of the robot; only Bluetooth LE needs a place.
        """
        if address.scheme != _RADIO:
            yield Adapter("")
            return
        async with self._places:
            adapter = min(self._adapters, key=lambda one: one.connections)
            adapter.connections += 1
            try:
                yield adapter
            finally:
                adapter.connections -= 1


async def adapter_names() -> tuple[str, ...]:
    """Return the adapters that can be used, by name; one empty name where the system does not tell."""
    if sys.platform != "linux":
        return ("",)
    from sphero_probe.transports.ble.explain import RAISED  # noqa: PLC0415 - imports bleak
    from sphero_probe.transports.ble.machine import adapters  # noqa: PLC0415 - exists on Linux only

    try:
        there = await adapters(_ASKING)
    except RAISED:
        return ("",)  # connecting will say what is wrong
    return tuple(one.name for one in there if one.powered and one.central) or ("",)
