"""What V1 commands do beyond what their catalogue rows say.

Nothing that comes over the line wakes a sleeping V1 robot: a BLE client writes to a characteristic that is
there for it, a person touches the robot. Both are ``FakeRobot.wake``.
"""

from random import Random
from struct import Struct
from typing import Final

from sphero_probe.catalogue import lookup
from sphero_probe.catalogue.sensors import STREAM_IDS, Masks, stream_layout
from sphero_probe.protocol.packets import Verdict
from sphero_probe.protocol.v1 import V1
from sphero_probe.simulator.calls import Behaviours, Call, Idleness, News, Reply, answer
from sphero_probe.simulator.streaming import MASK_STREAM, Stream, StreamRequest

INACTIVITY: Final = 600.0
"""Seconds without a command until a robot sleeps, from the factory [vendor]."""
SHORTEST_INACTIVITY: Final = 60
"""Seconds; the robot takes no shorter inactivity timeout [vendor]."""
NOTICE: Final = 10.0
"""Seconds before that in which it warns [vendor]."""
SAMPLING: Final = 400
"""Sensor readings in a second [vendor]."""
PROMPT: Final = b"u>"
"""What a robot sends after a restart, outside any packet."""

_POWER, _DIAGNOSTICS, _CONFIG_BLOCK, _WILL_SLEEP, _LEVELLED, _SOUL, _DID_SLEEP = (
    (None, message) for message in (0x01, 0x02, 0x04, 0x05, 0x0B, 0x0D, 0x14)
)
_GET_POWER_STATE: Final = (0x00, 0x20)
_CONFIGURE_LOCATOR: Final = (0x02, 0x13)
_SET_MAIN_LED: Final = (0x02, 0x20)
_SET_BLUETOOTH_NAME: Final = (0x00, 0x10)
_FOREVER: Final = 0
_DEEP_SLEEP: Final = 0xFFFF
_STREAM: Final = Struct(">HHIBI")
"""Divisor of the sampling rate, frames in a packet, mask, number of packets (0: endless), extended mask."""
_LONGEST_MESSAGE: Final = 1024
"""Bytes of sensor readings that a robot collects for one packet."""
_CONFIG_BYTES: Final = 254
_SOUL_BYTES: Final = 0x440
_EXECUTION_FAILED: Final = 0x08
_REFUSED: Final = Reply(Verdict.FAILED, code=_EXECUTION_FAILED)
_WRONG_PASSWORD: Final = Reply(Verdict.RESTRICTED)


def _news(call: Call, pair: tuple[None, int], payload: bytes = b"") -> tuple[News, ...]:
    return (News(call.command.node, pair, payload),)


def _answer_identity(call: Call) -> Reply:
    """Answer name and address in fixed widths; of a longer name, the first 16 bytes."""
    state, node = call.state, call.command.node
    name = state.memory.get((node, *_SET_BLUETOOTH_NAME), state.readings.identity.name.encode())
    address = state.readings.identity.address.replace(":", "").encode()
    return Reply(payload=name.partition(b"\0")[0][:16].ljust(16, b"\0") + address)


def _switch_power_notify(call: Call) -> Reply:
    """Send the power state once; real robots repeat it every ten seconds."""
    state = call.state
    row = lookup(V1.generation, *_GET_POWER_STATE, state.model)
    if not call.payload[0] or row is None:
        return Reply()
    return Reply(news=_news(call, _POWER, state.readings.payload(row, call.command.node)[1:2]))


def _sleep(call: Call) -> Reply:
    seconds = int.from_bytes(call.payload[:2], "big")
    call.state.off = seconds == _DEEP_SLEEP
    wakes = None if seconds in (_FOREVER, _DEEP_SLEEP) else call.now + seconds
    call.state.fall_asleep(wakes=wakes)
    return Reply(news=_news(call, _DID_SLEEP))


def _set_inactivity_timeout(call: Call) -> Reply:
    seconds = int.from_bytes(call.payload, "big")
    if seconds < SHORTEST_INACTIVITY:
        return Reply(Verdict.BAD_VALUE)
    call.state.rest.set_timeout(seconds)
    return Reply()


def _restart(call: Call) -> Reply:
    call.state.restart()
    return Reply(prompt=PROMPT)


def _jump_to_bootloader(call: Call) -> Reply:
    call.state.in_bootloader = True
    call.state.rest.sleep()
    return _restart(call)


def _jump_to_main(call: Call) -> Reply:
    call.state.in_bootloader = False
    call.state.rest.touch(now=call.now)
    return _restart(call)


def _run_diagnostics(call: Call) -> Reply:
    """Send diagnostics as text."""
    state = call.state
    leds = " ".join(f"{led} {brightness}" for led, brightness in state.leds.items())
    lines = [f"{state.model.name} {state.readings.identity.name}", f"LEDs: {leds}", "faults: none", ""]
    return Reply(news=_news(call, _DIAGNOSTICS, "\r\n".join(lines).encode()))


def _answer_times(call: Call) -> Reply:
    clock = int(call.now * 1000) % (1 << 32)
    return Reply(payload=call.payload + clock.to_bytes(4, "big") * 2)


def _level(call: Call) -> Reply:
    """Level at once, or stop levelling."""
    start, succeeded, aborted = 0x01, b"\6", b"\4"
    return Reply(news=_news(call, _LEVELLED, succeeded if call.payload[0] & start else aborted))


def _stream(call: Call) -> Reply:
    divisor, frames, mask, count, extended = _STREAM.unpack(call.payload.ljust(_STREAM.size, b"\0"))
    layout = stream_layout(V1.generation, Masks(mask, extended), call.state.model)
    if layout.fields and not (divisor and 0 < frames * layout.minimum_length <= _LONGEST_MESSAGE):
        return Reply(Verdict.BAD_VALUE)
    pair = STREAM_IDS[V1.generation]
    request = StreamRequest(call.command.node, pair, divisor * frames / SAMPLING, count, layout, frames)
    call.state.streams[call.command.node, MASK_STREAM] = Stream(request, seed=call.state.seed, now=call.now)
    return Reply()


def _read_locator(call: Call) -> Reply:
    """Answer the position that was configured; the robot rests."""
    told = call.state.memory.get((call.command.node, *_CONFIGURE_LOCATOR), b"")
    return Reply(payload=told[1:5].ljust(10, b"\0"))


def _set_led(call: Call) -> Reply:
    """Set the LED that belongs to this command."""
    state = call.state
    for group in state.model.leds.groups if state.model.leds else ():
        if group.cid == call.command.cid:
            state.light(group.bits, call.payload)
    return Reply()


def _set_main_led(call: Call) -> Reply:
    if any(call.payload[3:]):
        call.state.colour = call.payload[:3]
    return _set_led(call)


def _get_main_led(call: Call) -> Reply:
    """Answer the colour that is stored, not the one that is shown [vendor]."""
    return Reply(payload=call.state.colour) if call.state.colour else answer(call)


def _send_config_block(call: Call) -> Reply:
    return Reply(news=_news(call, _CONFIG_BLOCK, _block(call, _CONFIG_BYTES)))


def _send_soul(call: Call) -> Reply:
    return Reply(news=_news(call, _SOUL, _block(call, _SOUL_BYTES)))


def _block(call: Call, size: int) -> bytes:
    return Random(f"{call.state.seed} {call.command.cid} {call.payload.hex()}").randbytes(size)


BEHAVIOURS_V1: Final = Behaviours(
    special={
        (0x00, 0x11): _answer_identity,
        (0x00, 0x21): _switch_power_notify,
        (0x00, 0x22): _sleep,
        (0x00, 0x25): _set_inactivity_timeout,
        (0x00, 0x30): _jump_to_bootloader,
        (0x00, 0x40): _run_diagnostics,
        (0x00, 0x51): _answer_times,
        (0x01, 0x04): _jump_to_main,
        (0x02, 0x09): _level,
        (0x02, 0x11): _stream,
        (0x02, 0x15): _read_locator,
        _SET_MAIN_LED: _set_main_led,
        (0x02, 0x21): _set_led,
        (0x02, 0x22): _get_main_led,
        (0x02, 0x40): _send_config_block,
        (0x02, 0x46): _send_soul,
    },
    follows={},
    refused={
        (0x00, 0x42): _REFUSED,  # outside the developer mode
        (0x02, 0x08): _REFUSED,  # outside the factory
        (0x02, 0x41): _WRONG_PASSWORD,
        (0x02, 0x47): _WRONG_PASSWORD,
        (0x02, 0x4B): _WRONG_PASSWORD,
        (0x02, 0x4C): _WRONG_PASSWORD,
        (0x02, 0x4D): _WRONG_PASSWORD,
    },
    wake=None,
    name_setter=_SET_BLUETOOTH_NAME,
    prompt=PROMPT,
    bootloader=0x01,
    idleness=Idleness(INACTIVITY, NOTICE, warning=_WILL_SLEEP, asleep=_DID_SLEEP),
)
"""What V1 commands do beyond what their catalogue rows say."""
