"""What a command does to a robot: a call on its state comes in, a reply goes out, the state changes.

Most commands are told by their rows alone: a setter is remembered, a getter answers what was set or a
plausible reading. Only the pairs in ``_SPECIAL`` do more.
"""

from collections.abc import Callable
from typing import Final, NamedTuple

from sphero_probe.catalogue import lookup
from sphero_probe.catalogue.layout import Layout
from sphero_probe.catalogue.risk import Risk
from sphero_probe.protocol.packets import Verdict
from sphero_probe.simulator.firmware import FirmwareCommand
from sphero_probe.simulator.settings import Strict
from sphero_probe.simulator.state import State
from sphero_probe.simulator.streaming import REQUEST, Stream

WAKE: Final = (0x13, 0x0D)
"""All that a sleeping robot hears."""
AWAKE: Final = (0x13, 0x11)
DID_SLEEP: Final = (0x13, 0x1A)


class News(NamedTuple):
    """A notification to come after a response.

    Attributes:
        node: the processor that speaks.
        pair: its (did, cid).
        payload: its data.
    """

    node: int
    pair: tuple[int, int]
    payload: bytes = b""


class Reply(NamedTuple):
    """How a command ended.

    Attributes:
        verdict: in words; anything but OK means that nothing was executed.
        payload: the data of the response.
        news: notifications that follow it.
        code: the error code, where it is not the verdict's.
    """

    verdict: Verdict = Verdict.OK
    payload: bytes = b""
    news: tuple[News, ...] = ()
    code: int | None = None


class Call(NamedTuple):
    """One execution of a command.

    Attributes:
        state: of the robot; changed when the verdict is OK.
        command: what is run.
        payload: as long as the command wants it.
        now: seconds of the caller's clock.
    """

    state: State
    command: FirmwareCommand
    payload: bytes
    now: float


Behaviour = Callable[[Call], Reply]


class Follow(NamedTuple):
    """A notification that a command brings about.

    Attributes:
        pair: its (did, cid).
        enabled_by: the (did, cid) of the switch that must be on; None where it always comes.
    """

    pair: tuple[int, int]
    enabled_by: tuple[int, int] | None = None


_FOLLOWS: Final[dict[tuple[int, int], Follow]] = {
    (0x11, 0x17): Follow((0x11, 0x18)),
    (0x11, 0x24): Follow((0x11, 0x25)),
    (0x11, 0x3F): Follow((0x11, 0x3E)),
    (0x13, 0x01): Follow(DID_SLEEP),
    (0x17, 0x05): Follow((0x17, 0x11)),
    (0x17, 0x0D): Follow((0x17, 0x26), enabled_by=(0x17, 0x2A)),
    (0x18, 0x25): Follow((0x18, 0x26)),
    (0x18, 0x37): Follow((0x18, 0x36)),
    (0x1D, 0x16): Follow((0x1D, 0x17)),
    (0x1D, 0x18): Follow((0x1D, 0x19)),
}
"""Commands whose result comes, or is told again, as a notification."""

_REFUSED: Final[dict[tuple[int, int], Verdict]] = {
    (0x1F, 0x14): Verdict.RESTRICTED,
    (0x1F, 0x31): Verdict.RESTRICTED,
    (0x12, 0x29): Verdict.NOT_IMPLEMENTED,
    (0x18, 0x2A): Verdict.NOT_IMPLEMENTED,
}
"""Commands that exist and never run: what only a factory may do, and stubs."""


def execute(call: Call) -> Reply:
    """Run a command with a payload of a length that it takes."""
    state, command, payload, _ = call
    pair = (command.did, command.cid)
    if pair in _REFUSED:
        return Reply(_REFUSED[pair])
    if command.row and command.row.request and _has_foreign_value(command.row.request, payload):
        return Reply(Verdict.BAD_VALUE)
    leds = state.model.leds
    is_leds = leds is not None and (leds.did, leds.cid) == pair
    behaviour = _set_leds if is_leds else _SPECIAL.get(pair, _answer)
    reply = behaviour(call)
    if reply.verdict is not Verdict.OK:
        return reply
    if command.risk is not Risk.READ:
        state.memory[command.node, command.did, command.cid] = payload
    return reply._replace(news=reply.news + _follow_up(state, command))


def _has_foreign_value(layout: Layout, payload: bytes) -> bool:
    """Tell whether a field with named values has one that is none of them; masks may hold anything."""
    values = layout.decode(payload).fields
    return any(field.values and isinstance(values.get(field.name), int) for field in layout.fields)


def _follow_up(state: State, command: FirmwareCommand) -> tuple[News, ...]:
    follow = _FOLLOWS.get((command.did, command.cid))
    if follow is None:
        return ()
    if follow.enabled_by and not any(state.memory.get((command.node, *follow.enabled_by), b"")):
        return ()
    row = lookup(state.model.generation, *follow.pair, state.model)
    payload = state.readings.payload(row, command.node) if row and row.response else b""
    return (News(command.node, follow.pair, payload),)


def _answer(call: Call) -> Reply:
    """Answer what was set, or a reading."""
    state, command, _, _ = call
    setter = state.setters.get((command.node, command.did, command.cid))
    if setter in state.memory:
        return Reply(payload=state.memory[setter])
    if command.row is None:
        return Reply(payload=state.readings.secret(command.did, command.cid, command.node))
    if command.row.response is None and command.risk is not Risk.READ:
        return Reply()
    return Reply(payload=state.readings.payload(command.row, command.node))


def _echo(call: Call) -> Reply:
    return Reply(payload=call.payload)


def _tell_devices(call: Call) -> Reply:
    return Reply(payload=call.state.firmware.claimed_devices(call.command.node))


def _tell_commands(call: Call) -> Reply:
    return Reply(payload=call.state.firmware.claimed_commands(call.command.node, call.payload[0]))


def _make_error(call: Call) -> Reply:
    return Reply(code=call.payload[0])


def _sleep(call: Call) -> Reply:
    call.state.asleep = True
    call.state.stream = None
    return Reply()


def _deep_sleep(call: Call) -> Reply:
    call.state.off = True
    return _sleep(call)


def _wake(call: Call) -> Reply:
    news = (News(call.command.node, AWAKE),) if call.state.asleep else ()
    call.state.asleep = False
    return Reply(news=news)


def _stream(call: Call) -> Reply:
    state, node = call.state, call.command.node
    extended = int.from_bytes(state.memory.get((node, 0x18, 0x0C), b""), "big")
    request = call.payload.ljust(REQUEST.size, b"\0")
    state.stream = Stream(node, request, extended, seed=state.seed, now=call.now)
    return Reply()


def _save_frame(call: Call) -> Reply:
    call.state.frames.add(int.from_bytes(call.payload[:2], "big"))
    return _answer(call)


def _list_frames(call: Call) -> Reply:
    return Reply(payload=b"".join(frame.to_bytes(2, "big") for frame in sorted(call.state.frames)))


def _delete_frames(call: Call) -> Reply:
    call.state.frames.clear()
    return Reply()


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
    state.leds.update((state.channels[bit], value) for bit, value in zip(chosen, values, strict=False))
    return Reply()


_SPECIAL: Final[dict[tuple[int, int], Behaviour]] = {
    (0x10, 0x00): _echo,
    (0x10, 0x05): _tell_devices,
    (0x10, 0x06): _tell_commands,
    (0x10, 0x09): _make_error,
    (0x13, 0x00): _deep_sleep,
    (0x13, 0x01): _sleep,
    WAKE: _wake,
    (0x18, 0x00): _stream,
    (0x1A, 0x30): _save_frame,
    (0x1A, 0x34): _list_frames,
    (0x1A, 0x35): _delete_frames,
    (0x1A, 0x4D): _save_frame,
}
"""What the rows cannot say."""
