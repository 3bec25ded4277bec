"""Wake nodes that failed a health check, and wait until they pass one."""

import asyncio
from collections.abc import Callable, Collection
from datetime import UTC, datetime
from typing import Final

from sphero_probe.catalogue.model import Robot
from sphero_probe.probing.finding import Note
from sphero_probe.probing.health import HealthCheck
from sphero_probe.probing.notes import hung_note
from sphero_probe.session.identify import wake
from sphero_probe.session.reconnect import PAUSES, Reconnector

RECOVERY: Final = 20.0
"""Seconds after which a node that fails every health check is given up."""


class HealthLog:
    """Records which nodes failed a health check, and when each passed its last one."""

    def __init__(self) -> None:
        self._failed: dict[int | None, int] = {}
        self._passed_at: dict[int | None, datetime] = {}

    def __bool__(self) -> bool:
        """Whether a node failed since the last ``take_failed``."""
        return bool(self._failed)

    def passed(self, *targets: int | None) -> None:
        """Record that nodes passed a health check just now."""
        self._passed_at |= dict.fromkeys(targets, datetime.now(UTC))

    def failed(self, target: int | None, check: int) -> None:
        """Record that a node failed the health check of this number."""
        self._failed.setdefault(target, check)

    def take_failed(self) -> dict[int | None, int]:
        """Return the nodes that failed since the last call, each with the number of its health check."""
        failed, self._failed = self._failed, {}
        return failed

    def hung(self, target: int | None, robot: Robot | None) -> Note:
        """Return the note of a node that is given up."""
        return hung_note(target, self._passed_at.get(target), robot)


async def still_healthy(
    line: Reconnector, health: HealthCheck, nodes: Collection[int | None]
) -> set[int | None]:
    """Return which nodes pass a health check at once, without being woken; none where the link drops.

    Args:
        line: to the robot.
        health: of its nodes.
        nodes: addresses of those to ask.
    """
    passed: set[int | None] = set()
    before = line.reconnects

    async def ask() -> None:
        for target in sorted(nodes, key=str):
            if health.has_questions(target) and await health.passes(target):
                passed.add(target)

    await line.with_reconnect(ask)
    return passed if line.reconnects == before else set()


async def recover(
    line: Reconnector, health: HealthCheck, nodes: Collection[int | None], is_over: Callable[[], bool]
) -> set[int | None]:
    """Wake nodes until they pass a health check; return those that never do.

    Args:
        line: to the robot.
        health: of its nodes.
        nodes: addresses of those that failed.
        is_over: whether the run was ended.
    """
    failing = set(nodes)

    async def try_again() -> None:
        for target in sorted(failing, key=str):
            await wake(line.link, target, 1)
            if await health.passes(target):
                failing.discard(target)

    loop = asyncio.get_running_loop()
    began = loop.time()
    for pause in PAUSES:
        await line.pause(pause)
        await line.with_reconnect(try_again)
        if is_over():
            return set()
        if not failing or loop.time() - began > RECOVERY:
            break
    return failing
