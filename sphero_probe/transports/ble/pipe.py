"""The byte pipe of a BLE robot: writes are cut to what one of them carries, notifications are read."""

import asyncio
from typing import Final

from bleak import BleakClient
from bleak.backends.characteristic import BleakGATTCharacteristic

from sphero_probe.errors import LinkLostError, SpheroProbeError
from sphero_probe.transports.ble.explain import step

PATIENCE: Final = 5.0
"""Seconds for what takes milliseconds as long as the link and the Bluetooth service are well."""
_SMALLEST_SLICE: Final = 20
"""Bytes that every BLE link takes in one write."""


class BleTransport:
    """A pipe into one characteristic and out of one; the callback only enqueues.

    Attributes:
        write_size: bytes that one write carries at most: the negotiated MTU less 3.
    """

    def __init__(self, client: BleakClient, commands: BleakGATTCharacteristic) -> None:
        self._client = client
        self._commands = commands
        self.write_size = max(_SMALLEST_SLICE, commands.max_write_without_response_size)
        self._response = "write-without-response" not in commands.properties
        self._heard: asyncio.Queue[bytes] = asyncio.Queue()

    async def write(self, data: bytes) -> None:
        """Send bytes in slices that the negotiated MTU allows.

        Raises:
            LinkLostError: the robot is gone.
        """
        try:
            async with step("write", PATIENCE):
                for at in range(0, len(data), self.write_size):
                    await self._client.write_gatt_char(
                        self._commands, data[at : at + self.write_size], response=self._response
                    )
        except SpheroProbeError as error:
            raise LinkLostError(f"the link to the robot is lost ({error})", error.hint) from error

    async def read(self) -> bytes:
        """Wait for a notification; ``b""`` once the robot is gone."""
        data = await self._heard.get()
        if not data:
            self._heard.put_nowait(data)  # the next read ends, too
        return data

    def on_notification(self, _: BleakGATTCharacteristic, data: bytearray) -> None:
        """Queue a notification of the robot."""
        if data:
            self._heard.put_nowait(bytes(data))

    def on_disconnect(self) -> None:
        """End the pipe: the robot is gone."""
        self._heard.put_nowait(b"")
