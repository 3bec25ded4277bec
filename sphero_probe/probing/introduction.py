"""The first exchanges of a run: wake the robot, read its firmware, and tell what is odd about its answers."""

import asyncio
from collections.abc import Callable, Sequence
from typing import Final

from sphero_probe.catalogue.well_known import WellKnown
from sphero_probe.errors import NoAnswerError
from sphero_probe.link.exchange import Answered, LateResponse, Silent, Unsolicited
from sphero_probe.link.policy import IMPOSSIBLE_DIDS, WRONG_LENGTH
from sphero_probe.protocol.address import Address
from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Command, Notification
from sphero_probe.session.identify import ask_well_known, read_firmware, wake
from sphero_probe.session.reconnect import Reconnector

PATIENCE: Final = 12.0
"""Seconds after which a robot that answers nothing is given up."""
_NO_ANSWER: Final = (
    "shake it, or put it on its charger and take it off; then look with: sphero-probe doctor --device …"
)
_ECHOES: Final = 12
"""Echoes to a robot that answers nothing at most."""
_SHOWN: Final = 40
"""Bytes of a frame that are shown."""


async def introduce(
    line: Reconnector, target: int | None, on_step: Callable[[str], None], strays: Sequence[Unsolicited]
) -> dict[str, str]:
    """Wake the robot and return its firmware, node name -> version.

    Args:
        line: to the robot.
        target: the address byte of its usual node.
        on_step: told the name of each step as it begins.
        strays: what came from the robot besides answers, growing.

    Raises:
        NoAnswerError: no answer belongs to a command; the message says what came instead.
        LinkLostError: the robot is gone.
    """
    now = asyncio.get_running_loop().time
    began = now()
    on_step("wake")
    await wake(line.link, target)
    on_step("first answer")
    firmware = await read_firmware(line.link, target)
    silent: list[Silent] = []
    while not firmware and len(silent) < _ECHOES and (not silent or now() - began < PATIENCE):
        exchange = await ask_well_known(line.link, WellKnown.ECHO, target, attempts=1)
        if not isinstance(exchange, Silent):
            return firmware or await read_firmware(line.link, target)
        silent.append(exchange)
        if oddity := _oddity(silent, strays, line.link.codec):
            raise NoAnswerError(f"first answer: {oddity}", _NO_ANSWER)
    if firmware or line.link.matched:
        return firmware  # answers come, if too late for the timeout that was named
    impossible = Command(IMPOSSIBLE_DIDS[0], 0, bytes(WRONG_LENGTH), target)
    error = await line.link.ask(impossible, alone=True)
    if isinstance(error, Answered):
        frame = _shown(error.received)
        raise NoAnswerError(f"first answer: the robot answers errors only, as here: {frame}", _NO_ANSWER)
    raise NoAnswerError("first answer: the robot is connected and answers nothing", _NO_ANSWER)


def _oddity(silent: Sequence[Silent], strays: Sequence[Unsolicited], codec: Codec) -> str:
    """Return how what came differs from an answer in one thing, in words; empty where nothing is close."""
    told: list[tuple[int, str]] = []
    for asked in silent:
        for stray in strays:
            if isinstance(stray, Notification):
                frame = codec.frame_of(stray)
                if codec.may_answer(frame, asked.command, asked.seq):
                    told.append(
                        (0, f"answers carry the flags of a command (0x{stray.flags:02x}): {_shown(frame)}")
                    )
            elif isinstance(stray, LateResponse) and stray.earlier is None:
                differing = _differences(asked, stray)
                if len(differing) == 1:
                    rank, text = differing[0]
                    told.append((rank, f"answers {text}: {_shown(stray.received)}"))
    return min(told, default=(0, ""))[1]


def _differences(asked: Silent, stray: LateResponse) -> list[tuple[int, str]]:
    """Return in what an answer differs from that to a command, the likeliest oddity with the lowest rank."""
    command, response = asked.command, stray.response
    found: list[tuple[int, str]] = []
    if response.did is None or response.cid is None:
        return found
    if response.source is not None and command.target is not None:
        source, target = Address.from_byte(response.source), Address.from_byte(command.target)
        if source.node != target.node:
            found.append((0, f"come from node {source.node}, node {target.node} was asked"))
    if response.seq != asked.seq:
        found.append((1, f"carry sequence number {response.seq}, {asked.seq} was sent"))
    if response.did != command.did:
        found.append((2, f"name device 0x{response.did:02x}, 0x{command.did:02x} was asked"))
    if response.cid != command.cid:
        found.append((3, f"name command 0x{response.cid:02x}, 0x{command.cid:02x} was asked"))
    return found


def _shown(frame: bytes) -> str:
    return frame[:_SHOWN].hex(" ")
