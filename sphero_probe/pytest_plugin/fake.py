"""Test access to the built-in robot: what it executed, its state, and ways to make it fail."""

import asyncio

from sphero_probe.api.portal import Portal
from sphero_probe.catalogue.naming import pair
from sphero_probe.errors import UsageError
from sphero_probe.simulator import Executed, Fact, FakeRobot, Settings, parse_settings


class SpheroFake:
    """The built-in robot behind the fixture ``sphero``.

    Attributes:
        settings: the part of its address after ``fake:``, parsed.
        ledger: every command that it executed, in order: ``node``, ``did``, ``cid``, ``payload`` and
            ``risk``. Rejected commands are not in it.
    """

    def __init__(self, robot: FakeRobot, address: str, portal: Portal) -> None:
        self.settings: Settings = parse_settings(address.partition(":")[2])
        self.ledger: list[Executed] = []
        self._robot = robot
        self._portal = portal
        robot.on_execute.append(self.ledger.append)

    def __repr__(self) -> str:
        return f"<SpheroFake {self.name!r}, {self._robot.model.name}>"

    @property
    def name(self) -> str:
        """The Bluetooth name that it has now."""
        return self._robot.name

    @property
    def leds(self) -> dict[str, int]:
        """Channel -> brightness 0-255: ``front_red`` for an LED of three channels, ``head`` for one."""
        return self._robot.leds

    @property
    def asleep(self) -> bool:
        """Whether it sleeps."""
        return self._robot.asleep

    @property
    def connected(self) -> bool:
        """Whether there is a link to it."""
        return self._robot.connected

    @property
    def truth(self) -> list[Fact]:
        """Every command that exists, hidden ones too: what a complete sweep finds."""
        return self._robot.truth()

    def executed(self, what: str | int, cid: int | None = None) -> list[Executed]:
        """Return the entries of ``ledger`` for one command.

        Args:
            what: the command's name, or its DID.
            cid: the CID, where ``what`` is a DID.
        """
        wanted = self._pair(what, cid)
        return [entry for entry in self.ledger if (entry.did, entry.cid) == wanted]

    def silence(self, what: str | int, cid: int | None = None) -> None:
        """Make it execute a command without answering; the arguments are those of ``executed``."""
        self._robot.silent.add(self._pair(what, cid))

    def unsilence(self, what: str | int, cid: int | None = None) -> None:
        """Make it answer a command again."""
        self._robot.silent.discard(self._pair(what, cid))

    def drop_link(self) -> None:
        """Drop the connection; the robot keeps its state, and can be connected again."""

        async def drop() -> None:
            self._robot.drop(now=asyncio.get_running_loop().time())
            await asyncio.sleep(0)

        self._portal.run(drop())

    def fall_asleep(self) -> None:
        """Make it fall asleep at once; then it responds only to the command that wakes it."""

        async def sleep() -> None:
            self._robot.fall_asleep(now=asyncio.get_running_loop().time())

        self._portal.run(sleep())

    def pass_time(self, seconds: float) -> None:
        """Let time pass for the robot; at once on a virtual clock."""
        self._portal.run(asyncio.sleep(seconds))

    def _pair(self, what: str | int, cid: int | None) -> tuple[int, int]:
        if isinstance(what, str):
            return pair(what, self._robot.model.generation)
        if cid is None:
            raise UsageError("a DID alone is not a command", "write: (0x13, 0x10)")
        return what, cid
