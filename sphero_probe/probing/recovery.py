"""Wake nodes that failed a health check, and wait until they pass one."""

import asyncio
from collections.abc import Callable, Collection
from typing import Final

from sphero_probe.probing.health import HealthCheck
from sphero_probe.session.identify import wake
from sphero_probe.session.reconnect import PAUSES, Reconnector

RECOVERY: Final = 20.0
"""Seconds after which a node that fails every health check is given up."""


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
