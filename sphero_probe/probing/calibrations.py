"""Keep the calibrations of one run, of nodes and of devices, each made once, also over dropped links."""

import asyncio
from collections.abc import Callable, Collection, Coroutine, Iterable
from typing import Any

from sphero_probe.link.concurrent import ask_together
from sphero_probe.probing.calibration import Calibration
from sphero_probe.probing.device_calibration import DeviceCalibration
from sphero_probe.probing.profiles import DeviceProfile, NodeProfile
from sphero_probe.probing.retries import LossEstimate
from sphero_probe.session.reconnect import Reconnector


class Calibrations:
    """Measures nodes and devices: what does not depend on each other goes out together.

    Attributes:
        profiles: node -> what was measured on it.
        devices: node and device -> what was measured of it.
        claimed: node, device and command ids that the robot lists as its own.
    """

    def __init__(self, line: Reconnector, loss: LossEstimate) -> None:
        """Begin without any.

        Args:
            line: to the robot.
            loss: learns how much the link loses.
        """
        self.profiles: dict[int | None, NodeProfile] = {}
        self.devices: dict[tuple[int | None, int], DeviceProfile] = {}
        self.claimed: set[tuple[int | None, int, int]] = set()
        self._line = line
        self._loss = loss
        self._turn = asyncio.Lock()
        self._nodes: dict[int | None, Calibration] = {}
        self._devices: dict[tuple[int | None, int], DeviceCalibration] = {}

    async def measure(
        self,
        target: int | None,
        dids: Collection[int] = (),
        devices: Iterable[tuple[int | None, int]] = (),
    ) -> NodeProfile:
        """Begin to measure how strictly a node checks lengths; ``finish`` must follow.

        Args:
            target: the node's address byte.
            dids: devices that will be probed.
            devices: node and device id of those to begin with meanwhile.

        Raises:
            LinkLostError: the link was lost.
        """
        node = self._nodes[target] = Calibration(self._line, target, self._loss, dids, self._turn)
        measured = [self._calibration(key) for key in devices]

        async def ask_impossible() -> None:
            await ask_together(device.ask_impossible(node.impossible) for device in measured)

        if await node.measure(ask_impossible):
            await ask_together([*(device.ask_reads() for device in measured), node.ask_setter()])
        profile = self.profiles[target] = node.profile()
        return profile

    async def ask_codes(self, target: int | None) -> None:
        """Ask a node that was just measured for every error code that it can answer with.

        Args:
            target: the node's address byte.

        Raises:
            LinkLostError: the link was lost.
        """
        if node := self._nodes.get(target):
            await node.ask_codes()
            self.profiles[target] = node.profile()

    async def finish(
        self,
        devices: Iterable[tuple[int | None, int]],
        meanwhile: Iterable[Callable[[], Coroutine[Any, Any, object]]] = (),
    ) -> list[DeviceProfile]:
        """Measure devices that were not measured yet, and what is left of their nodes; return their profiles.

        Reads are sent to all devices at once. Setters get their wrong length one after the other, until one
        accepts it; commands that were called absent are sent at other lengths meanwhile.

        Args:
            devices: node and device id of each.
            meanwhile: ask more, which need not wait for the setters.

        Raises:
            LinkLostError: the link was lost.
        """
        keys = [key for key in dict.fromkeys(devices) if key not in self.devices]
        measured = [self._calibration(key) for key in keys]
        if unread := [device for device in measured if not device.has_reads]:
            await ask_together(device.ask_reads() for device in unread)
        await ask_together(
            [
                self._ask_setters(measured),  # first: they take the longest
                *map(self._finish_node, list(self._nodes)),
                ask_together(device.ask_claims() for device in measured),
                *(ask() for ask in meanwhile),
            ]
        )
        await ask_together(
            device.ask_empty(self._nodes[target].impossible if target in self._nodes else {})
            for (target, _), device in zip(keys, measured, strict=True)
        )
        found = [device.profile() for device in measured]
        self.devices.update(zip(keys, found, strict=True))
        self.claimed |= {(profile.target, profile.did, cid) for profile in found for cid in profile.claimed}
        return found

    async def _ask_setters(self, measured: Iterable[DeviceCalibration]) -> None:
        for device in measured:
            await device.ask_setters()

    async def _finish_node(self, target: int | None) -> None:
        await self._nodes[target].finish()
        self.profiles[target] = self._nodes[target].profile()

    def _calibration(self, key: tuple[int | None, int]) -> DeviceCalibration:
        return self._devices.setdefault(key, DeviceCalibration(self._line, self._loss, *key, self._turn))
