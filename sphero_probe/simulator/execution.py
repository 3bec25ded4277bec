"""Run a command on a fake robot: it changes the state and gets a reply.

For most commands the catalogue row is enough: a setter is remembered, a getter answers what was set or a
plausible reading. The behaviours of a generation describe the others.
"""

from typing import Final, NamedTuple

from sphero_probe.catalogue import notification_row
from sphero_probe.catalogue.payload.layout import Layout
from sphero_probe.catalogue.risk import Risk
from sphero_probe.protocol.packets import Command, Generation, Verdict
from sphero_probe.protocol.v1 import V1
from sphero_probe.protocol.v2 import V2
from sphero_probe.simulator import behaviours_v1, behaviours_v2
from sphero_probe.simulator.calls import Behaviours, Call, News, Reply, answer
from sphero_probe.simulator.firmware import FirmwareCommand
from sphero_probe.simulator.settings import Strict
from sphero_probe.simulator.state import State


class Executed(NamedTuple):
    """One line of the ledger: a command that a robot really ran.

    Attributes:
        node: number of the processor.
        did: device id.
        cid: command id.
        payload: as it was received.
        risk: what running it does, whatever a catalogue thinks.
    """

    node: int
    did: int
    cid: int
    payload: bytes
    risk: Risk

    def as_json(self) -> dict[str, object]:
        """The line as a JSON object; the payload in hex, the risk as a word."""
        return {**self._asdict(), "payload": self.payload.hex(), "risk": self.risk.word}


BEHAVIOURS: Final[dict[Generation, Behaviours]] = {
    V1.generation: behaviours_v1.BEHAVIOURS_V1,
    V2.generation: behaviours_v2.BEHAVIOURS_V2,
}
"""What the commands of each generation do beyond what their catalogue rows say."""


class Attempt(NamedTuple):
    """How a command ended at the node that took it.

    Attributes:
        reply: what it gets.
        ran: the command, if it was executed.
    """

    reply: Reply
    ran: FirmwareCommand | None = None


def attempt(state: State, node: int, asked: Command, mask: frozenset[int], *, now: float) -> Attempt:
    """Look a command up on a node, check the length of its payload, and run it.

    Args:
        state: of the robot.
        node: number of the node.
        asked: the command as it was received.
        mask: devices that refuse lengths even of commands that they do not have.
        now: seconds of the caller's clock.
    """
    did, cid, payload, *_ = asked
    bootloader = BEHAVIOURS[state.model.generation].bootloader
    shut_out = state.in_bootloader and did != bootloader
    if shut_out or not state.firmware.has_device(node, did):
        return Attempt(Reply(Verdict.NO_DEVICE))
    command = state.firmware.find(node, did, cid)
    if command is None:
        return Attempt(Reply(Verdict.BAD_LENGTH if payload and did in mask else Verdict.NO_COMMAND))
    if not _takes(command, len(payload), state.strict):
        return Attempt(Reply(Verdict.BAD_LENGTH))
    reply = execute(Call(state, command, command.lengths.fit(payload), now))
    return Attempt(reply, command if reply.verdict is Verdict.OK else None)


def _takes(command: FirmwareCommand, length: int, strict: Strict) -> bool:
    match strict:
        case Strict.EXACT:
            return command.lengths.accepts(length)
        case Strict.MINIMUM:
            return length >= command.lengths.minimum
        case Strict.NONE:
            return True


def execute(call: Call) -> Reply:
    """Run a command with a payload of a length that it takes."""
    state, command, payload, _ = call
    behaviours = BEHAVIOURS[state.model.generation]
    pair = (command.did, command.cid)
    if pair in behaviours.refused:
        return behaviours.refused[pair]
    if command.row and command.row.request and _has_foreign_value(command.row.request, payload):
        return Reply(Verdict.BAD_VALUE)
    leds = state.model.leds
    is_masked = leds is not None and leds.mask_bytes > 0 and (leds.did, leds.cid) == pair
    behaviour = _set_leds if is_masked else behaviours.special.get(pair, answer)
    reply = behaviour(call)
    if reply.verdict is not Verdict.OK:
        return reply
    if command.risk is not Risk.READ:
        state.memory[command.node, command.did, command.cid] = payload
    return reply._replace(news=reply.news + _follow_up(state, command, behaviours))


def _has_foreign_value(layout: Layout, payload: bytes) -> bool:
    """Return whether a field with named values has one that is none of them; masks may hold anything."""
    values = layout.decode(payload).fields
    return any(field.values and isinstance(values.get(field.name), int) for field in layout.fields)


def _follow_up(state: State, command: FirmwareCommand, behaviours: Behaviours) -> tuple[News, ...]:
    follow = behaviours.follows.get((command.did, command.cid))
    if follow is None:
        return ()
    if follow.enabled_by and not any(state.memory.get((command.node, *follow.enabled_by), b"")):
        return ()
    row = notification_row(state.model.generation, *follow.pair, state.model)
    payload = state.readings.payload(row, command.node) if row and row.response else b""
    return (News(command.node, follow.pair, payload),)


def _set_leds(call: Call) -> Reply:
    """Set the channels that the mask selects, values in rising bit order [reference]."""
    state = call.state
    width = state.model.leds.mask_bytes if state.model.leds else 0
    mask = int.from_bytes(call.payload[:width], "big")
    values = call.payload[width:]
    chosen = [bit for bit in range(8 * width) if mask >> bit & 1]
    surplus = len(values) - len(chosen)
    if (surplus and state.strict is Strict.EXACT) or (surplus < 0 and state.strict is Strict.MINIMUM):
        return Reply(Verdict.BAD_LENGTH)
    if not state.channels.keys() >= set(chosen):
        return Reply(Verdict.BAD_VALUE)
    state.light(chosen, values)
    return Reply()
