"""What commands do that listen to a robot: wait for an end, and switch off again what they switched on."""

import asyncio
from collections.abc import Iterable
from contextlib import suppress

from sphero_probe.catalogue.risk import Risk
from sphero_probe.catalogue.switches import taken_back
from sphero_probe.errors import LinkLostError
from sphero_probe.probing.oneshot import send_once
from sphero_probe.protocol.packets import Command
from sphero_probe.session.session import Session


async def wait_for_end(session: Session, stop: asyncio.Event, seconds: float | None) -> None:
    """Wait until ``stop`` is set, the time is up, or the link is lost.

    Raises:
        LinkLostError: the robot is gone.
    """
    ended = asyncio.create_task(stop.wait())
    gone = asyncio.create_task(session.link.closed())
    try:
        done, _ = await asyncio.wait({ended, gone}, timeout=seconds, return_when=asyncio.FIRST_COMPLETED)
        if gone in done:
            gone.result()
    finally:
        ended.cancel()
        gone.cancel()
        await asyncio.gather(ended, gone, return_exceptions=True)


async def switch_off(session: Session, executed: Iterable[Command]) -> None:
    """Send what takes back the commands that switched on a stream or a notification.

    The consent to switch it on covers this. A lost link ends it quietly.
    """
    link = session.link
    commands = taken_back(link.codec.generation, executed)
    with suppress(LinkLostError), link.policy.implying(Risk.WRITE, *commands):
        for command in commands:
            await send_once(link, command)
