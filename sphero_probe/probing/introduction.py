"""Start a run: wake the robot, read its firmware, and explain if its answers match no command."""

import asyncio
from collections.abc import Callable, Sequence
from typing import Final

from sphero_probe.catalogue.well_known import WellKnown
from sphero_probe.errors import NoAnswerError
from sphero_probe.link.concurrent import ask_together
from sphero_probe.link.events import ExchangeEnded
from sphero_probe.link.exchange import Answered, LateResponse, Silent, Unsolicited
from sphero_probe.link.wrong_lengths import IMPOSSIBLE_DIDS, WRONG_PAYLOAD
from sphero_probe.protocol.address import Address
from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Command, Notification
from sphero_probe.session.identify import ask_well_known, read_firmware, wake
from sphero_probe.session.reconnect import Reconnector

FIRST_ANSWER_TIMEOUT: Final = 12.0
"""Seconds after which a robot that answers nothing is given up."""
_NO_ANSWER: Final = (
    "shake it, or put it on its charger and take it off; then run: sphero-probe doctor --device …"
)
_ECHOES: Final = 12
"""The most echoes that are sent to a robot that answers nothing."""
_SHOWN: Final = 40
"""Bytes of a frame that a message shows."""
_TOLERANCE: Final = {0: "source", 1: "seq"}
"""Rank of a difference -> the tolerance that accepts it."""


class SeenClient:
    """Learns from the targets of a robot's answers under which address it sees the client.

    Attributes:
        address: the address byte, None while no answer names it.
    """

    def __init__(self) -> None:
        self.address: int | None = None

    def hear(self, event: ExchangeEnded) -> None:
        """Take in an exchange."""
        if isinstance(event.exchange, Answered) and event.exchange.response.target is not None:
            self.address = event.exchange.response.target


async def introduce(
    line: Reconnector, target: int | None, on_step: Callable[[str], None], unsolicited: Sequence[Unsolicited]
) -> dict[str, str]:
    """Wake the robot and return its firmware, node name -> version.

    Args:
        line: to the robot.
        target: the address byte of its usual node.
        on_step: called with the name of each step as it begins.
        unsolicited: the unsolicited packets so far; the caller adds to it.

    Raises:
        NoAnswerError: no answer matches a command; the message says what arrived instead.
        LinkLostError: the link was lost.
    """
    now = asyncio.get_running_loop().time
    began = now()
    on_step("wake")
    answers: list[dict[str, str] | None] = await ask_together(
        [wake(line.link, target), read_firmware(line.link, target)]
    )
    on_step("first answer")
    firmware = answers[-1] or {}
    silent: list[Silent] = []
    while not firmware and len(silent) < _ECHOES and (not silent or now() - began < FIRST_ANSWER_TIMEOUT):
        exchange = await ask_well_known(line.link, WellKnown.ECHO, target, attempts=1)
        if not isinstance(exchange, Silent):
            return firmware or await read_firmware(line.link, target)
        silent.append(exchange)
        if oddity := _oddity(silent, unsolicited, line.link.codec):
            text, tolerance = oddity
            hint = f"if this robot always answers so: --tolerate {tolerance}" if tolerance else _NO_ANSWER
            raise NoAnswerError(f"first answer: {text}", hint)
    if firmware or line.link.matched:
        return firmware  # it answers, only later than the user's timeout
    impossible = Command(IMPOSSIBLE_DIDS[0], 0, WRONG_PAYLOAD, target)
    error = await line.link.ask(impossible, alone=True)
    if isinstance(error, Answered):
        frame = _shown(error.received)
        raise NoAnswerError(f"first answer: the robot answers errors only, as here: {frame}", _NO_ANSWER)
    raise NoAnswerError("first answer: the robot is connected and answers nothing", _NO_ANSWER)


def _oddity(
    silent: Sequence[Silent], unsolicited: Sequence[Unsolicited], codec: Codec
) -> tuple[str, str] | None:
    """Return how what came differs from an answer in one thing, in words; None where nothing is close.

    With it comes the tolerance that would accept it, empty where there is none.
    """
    oddities: list[tuple[int, str, str]] = []
    for exchange in silent:
        for packet in unsolicited:
            if isinstance(packet, Notification):
                frame = codec.frame_of(packet)
                if codec.may_answer(frame, exchange.command, exchange.seq):
                    text = f"answers carry the flags of a command (0x{packet.flags:02x}): {_shown(frame)}"
                    oddities.append((0, text, "flags"))
            elif isinstance(packet, LateResponse) and packet.earlier is None:
                differing = _differences(exchange, packet)
                if len(differing) == 1:
                    rank, text = differing[0]
                    oddities.append(
                        (rank, f"answers {text}: {_shown(packet.received)}", _TOLERANCE.get(rank, ""))
                    )
    return min(oddities)[1:] if oddities else None


def _differences(exchange: Silent, packet: LateResponse) -> list[tuple[int, str]]:
    """Return in which fields a response differs from the answer to a command; the likeliest has rank 0."""
    command, response = exchange.command, packet.response
    found: list[tuple[int, str]] = []
    if response.did is None or response.cid is None:
        return found
    if response.source is not None and command.target is not None:
        source, target = Address.from_byte(response.source), Address.from_byte(command.target)
        if source.node != target.node:
            found.append((0, f"come from node {source.node}, but node {target.node} was asked"))
    if response.seq != exchange.seq:
        found.append((1, f"carry sequence number {response.seq}, but {exchange.seq} was sent"))
    if response.did != command.did:
        found.append((2, f"name device 0x{response.did:02x}, but 0x{command.did:02x} was asked"))
    if response.cid != command.cid:
        found.append((3, f"name command 0x{response.cid:02x}, but 0x{command.cid:02x} was asked"))
    return found


def _shown(frame: bytes) -> str:
    return frame[:_SHOWN].hex(" ")
