"""What V2 commands do beyond what their catalogue rows say."""

from random import Random
from struct import Struct
from typing import Final

from sphero_probe.catalogue import streaming_services
from sphero_probe.catalogue.sensors import STREAM_IDS, Masks, stream_layout
from sphero_probe.protocol.packets import Verdict
from sphero_probe.protocol.v2 import V2
from sphero_probe.simulator.calls import Behaviours, Call, Follow, Idleness, News, Reply, answer
from sphero_probe.simulator.services import ServiceStream
from sphero_probe.simulator.streaming import MASK_STREAM, Stream, StreamRequest

_WAKE: Final = (0x13, 0x0D)
_AWAKE: Final = (0x13, 0x11)
_WILL_SLEEP: Final = (0x13, 0x19)
_DID_SLEEP: Final = (0x13, 0x1A)
_SET_EXTENDED_MASK: Final = (0x18, 0x0C)
_STREAM: Final = Struct(">HBI")
"""Interval in ms, number of samples (0: endless), mask."""
_TEMPERATURE: Final = Struct(">Bf")
"""Id of a sensor, degrees Celsius."""


def _echo(call: Call) -> Reply:
    return Reply(payload=call.payload)


def _list_devices(call: Call) -> Reply:
    return Reply(payload=call.state.firmware.claimed_devices(call.command.node))


def _list_commands(call: Call) -> Reply:
    return Reply(payload=call.state.firmware.claimed_commands(call.command.node, call.payload[0]))


def _make_error(call: Call) -> Reply:
    return Reply(code=call.payload[0])


def _sleep(call: Call) -> Reply:
    call.state.fall_asleep()
    return Reply()


def _deep_sleep(call: Call) -> Reply:
    call.state.off = True
    return _sleep(call)


def _wake(call: Call) -> Reply:
    news = (News(call.command.node, _AWAKE),) if call.state.asleep else ()
    call.state.asleep = False
    return Reply(news=news)


def _stream(call: Call) -> Reply:
    state, node = call.state, call.command.node
    extended = int.from_bytes(state.memory.get((node, *_SET_EXTENDED_MASK), b""), "big")
    interval, count, mask = _STREAM.unpack(call.payload.ljust(_STREAM.size, b"\0"))
    layout = stream_layout(V2.generation, Masks(mask, extended), state.model)
    request = StreamRequest(node, STREAM_IDS[V2.generation], interval / 1000, count, layout)
    state.streams[node, MASK_STREAM] = Stream(request, seed=state.seed, now=call.now)
    return Reply()


def _configure_services(call: Call) -> Reply:
    """Store the services of a token; real robots answer 0x06 to what they cannot stream [real]."""
    asked = streaming_services.configuration(call.payload, call.command.node)
    if asked.problem:
        return Reply(Verdict.FAILED)
    call.state.services[call.command.node, asked.token] = asked.slots
    return Reply()


def _start_services(call: Call) -> Reply:
    """Stream what this node has configured; the maker's SDK also starts nodes with nothing configured."""
    state, node = call.state, call.command.node
    period = int.from_bytes(call.payload, "big") / 1000
    _end_services(call)
    for (owner, token), slots in state.services.items():
        if owner == node and period:
            state.streams[node, token] = ServiceStream(
                node, token, slots, state.sensors, period=period, now=call.now
            )
    return Reply()


def _end_services(call: Call) -> Reply:
    for token in streaming_services.TOKENS:
        call.state.streams.pop((call.command.node, token), None)
    return Reply()


def _clear_services(call: Call) -> Reply:
    for token in streaming_services.TOKENS:
        call.state.services.pop((call.command.node, token), None)
    return _end_services(call)


def _answer_temperatures(call: Call) -> Reply:
    """Echo the ids that were asked for; a real RVR gives plausible numbers for any id [real]."""
    temperatures = (
        (number, round(Random(f"{call.state.seed} temperature {number}").uniform(18, 36), 2))
        for number in call.payload
    )
    return Reply(payload=b"".join(_TEMPERATURE.pack(*one) for one in temperatures))


def _save_frame(call: Call) -> Reply:
    call.state.frames.add(int.from_bytes(call.payload[:2], "big"))
    return answer(call)


def _list_frames(call: Call) -> Reply:
    return Reply(payload=b"".join(frame.to_bytes(2, "big") for frame in sorted(call.state.frames)))


def _delete_frames(call: Call) -> Reply:
    call.state.frames.clear()
    return Reply()


BEHAVIOURS_V2: Final = Behaviours(
    special={
        (0x10, 0x00): _echo,
        (0x10, 0x05): _list_devices,
        (0x10, 0x06): _list_commands,
        (0x10, 0x09): _make_error,
        (0x13, 0x00): _deep_sleep,
        (0x13, 0x01): _sleep,
        _WAKE: _wake,
        (0x18, 0x00): _stream,
        streaming_services.CONFIGURE: _configure_services,
        streaming_services.START: _start_services,
        streaming_services.STOP: _end_services,
        streaming_services.CLEAR: _clear_services,
        (0x18, 0x4A): _answer_temperatures,
        (0x1A, 0x30): _save_frame,
        (0x1A, 0x34): _list_frames,
        (0x1A, 0x35): _delete_frames,
        (0x1A, 0x4D): _save_frame,
    },
    follows={
        (0x11, 0x17): Follow((0x11, 0x18)),
        (0x11, 0x24): Follow((0x11, 0x25)),
        (0x11, 0x3F): Follow((0x11, 0x3E)),
        (0x13, 0x01): Follow(_DID_SLEEP),
        (0x17, 0x05): Follow((0x17, 0x11)),
        (0x17, 0x0D): Follow((0x17, 0x26), enabled_by=(0x17, 0x2A)),
        (0x18, 0x25): Follow((0x18, 0x26)),
        (0x18, 0x37): Follow((0x18, 0x36)),
        (0x1D, 0x16): Follow((0x1D, 0x17)),
        (0x1D, 0x18): Follow((0x1D, 0x19)),
    },
    refused={
        (0x1F, 0x14): Reply(Verdict.RESTRICTED),  # what only a factory may do
        (0x1F, 0x31): Reply(Verdict.RESTRICTED),
        (0x12, 0x29): Reply(Verdict.NOT_IMPLEMENTED),  # stubs
        (0x18, 0x2A): Reply(Verdict.NOT_IMPLEMENTED),
    },
    wake=_WAKE,
    name_setter=(0x19, 0x03),
    idleness=Idleness(None, 10.0, warning=_WILL_SLEEP, asleep=_DID_SLEEP),
    awake=_AWAKE,
)
"""What V2 commands do beyond what their catalogue rows say."""
