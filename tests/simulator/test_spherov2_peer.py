"""spherov2 0.12.1 as a peer: its commands, its toy classes and its parser, compared with ours."""

import inspect
import struct
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from enum import IntEnum
from functools import cache, partialmethod
from itertools import islice
from queue import SimpleQueue
from typing import Any, NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st
from spherov2.commands.drive import MotorIndexes
from spherov2.commands.firmware import ResetStrategies
from spherov2.commands.io import SpecdrumsColorPaletteIndicies
from spherov2.commands.sensor import InfraredSensorLocations
from spherov2.controls.v2 import Packet as TheirPacket
from spherov2.controls.v2 import Processors
from spherov2.toy import Toy
from spherov2.toy.bb9e import BB9E
from spherov2.toy.bolt import BOLT
from spherov2.toy.mini import Mini
from spherov2.toy.r2d2 import R2D2
from spherov2.toy.rvr import RVR
from spherov2.utils import ToyUtil

from sphero_probe.catalogue import ROBOTS, commands_of, lookup
from sphero_probe.catalogue.gatt import ANTI_DOS_CHARACTERISTIC, ANTI_DOS_PHRASE, API_CHARACTERISTIC
from sphero_probe.catalogue.model import CommandRow, Kind
from sphero_probe.catalogue.payload.enums import VALUE_NAMES
from sphero_probe.catalogue.payload.fields import Field
from sphero_probe.catalogue.payload.layout import Layout
from sphero_probe.catalogue.risk import Risk
from sphero_probe.catalogue.streaming_services import CONFIGURE, configuration
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation, Notification, Request, Response, Role, Verdict
from sphero_probe.simulator import FakeRobot, parse_settings
from sphero_probe.simulator.readings import Readings
from tests.support.fake_robot import said_by
from tests.support.narrowing import every, known
from tests.support.spherov2_adapter import session
from tests.support.tables import rows

V2 = CODECS[Generation.V2]
TOYS: dict[str, type[Toy]] = {"bolt": BOLT, "rvr": RVR, "r2d2": R2D2, "mini": Mini, "bb9e": BB9E}
EACH_TOY = [pytest.param(key, id=key) for key in TOYS]

MARKERS = (0x8D, 0xAB, 0xD8)
"""The bytes that are escaped inside a frame."""

# The commands of spherov2: found in its classes, called with plausible arguments, caught before sending.

COMMANDS = {"bolt": 82, "rvr": 116, "r2d2": 63, "mini": 40, "bb9e": 50}
"""How many commands each class of spherov2 0.12.1 has, the broken ones included."""

BROKEN = {
    "get_config_block": "it calls itself with a packet for a toy and never comes to sending",
    "set_config_block": "the toy is missing from its call of _encode",
    "enable_desktoy_mode": "it asks for __encode, whose name Python mangles",
    "enable_out_of_box_state": "it asks for __encode, whose name Python mangles",
}
"""Commands that spherov2 itself cannot build."""
BROKEN_OF = {
    "bolt": {"get_config_block", "set_config_block"},
    "rvr": {"get_config_block", "set_config_block", "enable_out_of_box_state"},
    "r2d2": set(),
    "mini": {"enable_desktoy_mode"},
    "bb9e": set(),
}

_BYTE = (0x00, 0x01, 0x7F, 0x8D, 0xAB, 0xD8, 0xFF)
_WORD = (0x0000, 0x0001, 0x8DAB, 0xD8FF, 0xFFFF)
_LONG = (0x00000000, 0x00000001, 0x8DABD8FF, 0xFFFFFFFF)
_BYTES = (b"\x8d\xab\xd8", bytes(range(16)), b"\xff")
_FLOATS = (0.0, -90.5, 0.1, 3.4028234663852886e38)
_SWITCH = (False, True)
_LEDS = [(), (0,), (0, 2), tuple(range(5))]

SAMPLES: dict[str, tuple[object, ...]] = {
    "application_data": _BYTES,
    "challenge": _LONG,
    "compressed_frame": (bytes(8), b"\x8d\xab\xd8\x00\x01\x02\x03\xff"),
    "configuration": (b"\x00\x00\x02", b"\x00\x01\x02\x00\x02\x02"),
    "data": (b"\x8d\xab\xd8", b"\x01"),
    "enable": _SWITCH,
    "f_arr": ([], [0.5], [-1.5, 2.0, 0.1]),
    "fps": (1, 30),
    "frame_index": _WORD,
    "frames_indexes": ([], [0], [0x8D, 0xABD8]),
    "heading": (0, 0x8D, 0xAB, 0xD8, 0x0101, 359),
    "i": _WORD,
    "i2": _WORD,
    "i3": _WORD,
    "i4": _WORD,
    "i5": _WORD,
    "i_arr": ([], [7], [0x8D, 0xABD8]),
    "interval": _WORD,
    "j": _LONG,
    "j2": _LONG,
    "loop": _SWITCH,
    "mask": tuple(sum(1 << bit for bit in bits) for bits in _LEDS),
    "motor_index": tuple(MotorIndexes),
    "palette_colors": (b"", b"\x8d\xab\xd8", bytes(6)),
    "palette_index": tuple(SpecdrumsColorPaletteIndicies),
    "period": _WORD,
    "rgb_index_bytes": _BYTES,
    "s_arr": _BYTES,
    "sensor_masks": _LONG,
    "sound": _WORD,
    "str_to_display": ("", "Hello", "twenty-five characters ok"),
    "strategy": tuple(ResetStrategies),
    "timeout": _WORD,
    "values": tuple(bytes((0xFF, 0x8D, 0xAB, 0xD8, 0x00))[: len(bits)] for bits in _LEDS),
    "z": _SWITCH,
    "assign_compressed_frame_player_frames_to_animation.i": (0, 1, 2),
    "generic_raw_motor.speed": (b"\x00", b"\x8d\xab"),
    "listen_for_robot_to_robot_infrared_message.j": _BYTE,
    "ping.data": (None, b"\x8d\xab\xd8", bytes(range(16))),
    "set_compressed_frame_player_text_scrolling.speed": (0, 1, 30),
}
"""Values by the name of a parameter, where its annotation does not say enough; zipped, not multiplied."""
TIED = {"mask": "values", "i": "i_arr"}
"""Parameter -> the one whose length depends on it: their samples go together, all others go round."""
BY_TYPE: dict[object, tuple[object, ...]] = {
    bool: _SWITCH,
    float: _FLOATS,
    bytes: (b"", b"Sphero", b"\x7e 25 bytes and no more..."),
    str: ("S", "~"),
    int: _BYTE,
    inspect.Parameter.empty: _BYTE,
}


class Build(NamedTuple):
    """One command of spherov2 as it was built."""

    arguments: dict[str, object]
    packet: TheirPacket

    @property
    def frame(self) -> bytes:
        return bytes(self.packet.build())


def _theirs(chunks: Iterable[bytes]) -> list[TheirPacket]:
    """The packets that spherov2 decodes from the chunks of a robot."""
    packets: list[TheirPacket] = []
    collector = TheirPacket.Collector(packets.append)
    for chunk in chunks:
        collector.add(chunk)
    return packets


class _Sent(Exception):  # noqa: N818 - it is no error, it ends the call
    """Stops a command of spherov2 before it is sent."""


@cache
def _commands(key: str) -> dict[str, Callable[..., object]]:
    """Method name -> the function of ``spherov2.commands`` behind it, for one robot."""
    found: dict[str, Callable[..., object]] = {}
    for name in dir(TOYS[key]):
        bound = inspect.getattr_static(TOYS[key], name)
        function = bound.func if isinstance(bound, partialmethod) else bound
        if inspect.isfunction(function) and function.__module__.startswith("spherov2.commands."):
            found[name] = function
    return found


def _samples(key: str, method: str, parameter: inspect.Parameter) -> tuple[object, ...]:
    kind = parameter.annotation
    by_name = SAMPLES.get(f"{method}.{parameter.name}", SAMPLES.get(parameter.name))
    if by_name is not None:
        return by_name
    if kind is IntEnum:  # an animation: which there are depends on the robot
        return tuple(TOYS[key].Animations)
    return BY_TYPE.get(kind) or tuple(kind.__members__.values())


def _arguments(key: str, method: str) -> Iterator[dict[str, object]]:
    """Return sets of arguments with every sample of every parameter, for every node."""
    _, *parameters = inspect.signature(_commands(key)[method]).parameters.values()
    samples = {one.name: _samples(key, method, one) for one in parameters if one.name != "proc"}
    tied = {name for pair in TIED.items() if samples.keys() >= set(pair) for name in pair}
    sets = [
        {
            name: values[(at + (0 if name in tied else place)) % len(values)]
            for place, (name, values) in enumerate(samples.items())
        }
        for at in range(max(map(len, samples.values()), default=1))
    ]
    if isinstance(inspect.getattr_static(TOYS[key], method), partialmethod):  # its node is settled
        yield from sets
    else:
        last = Processors.SECONDARY if 2 in ROBOTS[key].nodes else Processors.PRIMARY
        nodes = [None, *islice(Processors, 1, last + 1)][TOYS[key]._require_target :]
        yield from ({**arguments, "proc": node} for arguments in sets for node in nodes)


@cache
def _unheard(key: str) -> FakeRobot:
    """An owner for objects that never send."""
    return FakeRobot(parse_settings(key))


def _offline(key: str, packets: list[TheirPacket], ahead: int = 0) -> Toy:
    """One of spherov2's robots that keeps what it would send; its sequence numbers start at ``ahead``."""

    def catch(packet: TheirPacket) -> None:
        packets.append(packet)
        raise _Sent

    toy = TOYS[key](_unheard(key), None)
    toy._execute = catch
    for _ in range(ahead):
        toy._packet_manager.new_packet(0, 0)
    return toy


@cache
def _builds(key: str, method: str) -> tuple[Build, ...]:
    """Call one command of spherov2 with every set of arguments."""
    packets: list[TheirPacket] = []
    toy = _offline(key, packets, ahead=sum(method.encode()) % 0xFF)
    sets = list(_arguments(key, method))
    for arguments in sets:
        with suppress(_Sent):
            getattr(toy, method)(**arguments)
    return tuple(Build(arguments, packet) for arguments, packet in zip(sets, packets, strict=True))


EVERY_COMMAND = [
    pytest.param(key, method, id=f"{key} {method}")
    for key in TOYS
    for method in _commands(key)
    if method not in BROKEN
]


@pytest.mark.parametrize("key", EACH_TOY)
def test_every_command_of_a_class_is_found(key: str) -> None:
    assert len(_commands(key)) == COMMANDS[key]
    assert {method for method in _commands(key) if method in BROKEN} == BROKEN_OF[key]


@pytest.mark.parametrize(
    ("key", "method"),
    [
        pytest.param(key, method, id=f"{key} {method}")
        for key, methods in BROKEN_OF.items()
        for method in sorted(methods)
    ],
)
def test_what_spherov2_cannot_build_it_still_cannot(key: str, method: str) -> None:
    packets: list[TheirPacket] = []
    toy = _offline(key, packets)
    for arguments in _arguments(key, method):
        with pytest.raises(AttributeError):
            getattr(toy, method)(**arguments)
    assert not packets


@rows(EVERY_COMMAND)
def test_commands_of_spherov2_decode_to_the_same_fields(key: str, method: str) -> None:
    builds = _builds(key, method)
    packets = V2.decoder(Role.ROBOT).feed(b"".join(build.frame for build in builds))
    assert packets == [
        Request(
            Command(their.did, their.cid, bytes(their.data), their.tid),
            their.seq,
            source=their.sid,
            flags=int(their.flags),
            wants_answer=True,
        )
        for _, their in builds
    ]
    assert [V2.encode_command(packet.command, packet.seq) for packet in every(Request, packets)] == [
        build.frame for build in builds
    ]


# The same commands, in the catalogue and on the fake robot.

UNPAIRED = {
    "save_compressed_frame_player_animation": "the catalogue keeps palette and frames as one run of bytes",
    "save_compressed_frame_player_animation_without_frames": "likewise",
}
"""Commands with parameters that are not a field in the catalogue."""


def _row(key: str, build: Build) -> CommandRow | None:
    return lookup(Generation.V2, build.packet.did, build.packet.cid, ROBOTS[key])


def _is_served(key: str, build: Build) -> bool:
    """Whether the command goes to a node that has it; spherov2 may leave the choice to the caller."""
    target = build.packet.tid
    return target is None or target & 0x0F in known(_row(key, build)).nodes[key]


def _pairs(method: str, arguments: dict[str, object], layout: Layout) -> dict[str, str]:
    """Parameter -> field: of the same name, or both in the order in which they are left over."""
    parameters = [name for name in arguments if name != "proc"]
    fields = [field.name for field in layout.fields]
    pairs = {name: name for name in parameters if name in fields}
    if method not in UNPAIRED:
        left = (
            [name for name in parameters if name not in pairs],
            [name for name in fields if name not in pairs],
        )
        pairs |= zip(*left, strict=True)
    return pairs


def _same(
    field: Field,
    ours: Any,
    theirs: Any,
) -> bool:
    """Whether a decoded value equals spherov2's."""
    if field.values:
        names = VALUE_NAMES[field.values]
        word = (getattr(theirs, "name", None) or "").lower()
        shared = word in names.names.values()  # spherov2 has longer names for some
        return names.number(ours) == int(theirs) and (ours in (word, [word]) or not shared)
    if field.type == "cstring":
        assert isinstance(ours, str)
        return ours.encode() == (theirs.encode() if isinstance(theirs, str) else bytes(theirs).rstrip(b"\0"))
    if field.type == "bytes":
        return bool(ours == bytes(theirs or b"").hex())
    if isinstance(theirs, bytes | bytearray):  # a number that spherov2 leaves as it came
        return bool(ours == int.from_bytes(theirs, "big"))
    if isinstance(theirs, str):
        return bool(ours == ord(theirs))
    if field.unit == "ms" and isinstance(theirs, float):  # spherov2 has made seconds of it
        return bool(ours == theirs * 1000)
    pack: Callable[[Any], object] = struct.Struct(">f").pack if field.type == "f32" else float
    if field.to_end and field.type != "uint":
        assert isinstance(ours, list)
        return list(map(pack, ours)) == list(map(pack, theirs))
    return pack(ours) == pack(theirs)


REFUSED = {
    "enter_factory_mode": Verdict.RESTRICTED,
    "enable_extended_life_test": Verdict.RESTRICTED,
    "send_robot_to_robot_infrared_message": Verdict.NOT_IMPLEMENTED,
}
"""Commands that the fake robot has but never executes."""


@rows(EVERY_COMMAND)
def test_the_catalogue_knows_the_commands_of_spherov2(key: str, method: str) -> None:
    for build in _builds(key, method):
        row = known(_row(key, build))
        device, _, name = row.name.partition(".")
        assert row.kind is Kind.COMMAND
        assert method in (name, *row.aliases), device
        assert key in row.nodes
        if "proc" not in build.arguments:  # spherov2 says which node serves it, or leaves addresses out
            assert build.packet.tid is None or build.packet.tid & 0x0F in row.nodes[key]
        assert row.request is not None
        assert row.request.accepts(len(build.packet.data))


@rows(EVERY_COMMAND)
def test_layouts_give_back_the_arguments(key: str, method: str) -> None:
    for build in _builds(key, method):
        layout = known(_row(key, build)).request
        assert layout is not None
        decoded = layout.decode(bytes(build.packet.data))
        assert not decoded.problem
        by_name = {field.name: field for field in layout.fields}
        for parameter, name in _pairs(method, build.arguments, layout).items():
            theirs, ours = build.arguments[parameter], decoded.fields[name]
            assert _same(by_name[name], ours, theirs), f"{parameter}={theirs!r} reads {name}={ours!r}"


def _is_bad_configuration(build: Build) -> bool:
    """Tell whether streaming services are asked for that this node does not have, or with a token of none."""
    if (build.packet.did, build.packet.cid) != CONFIGURE:
        return False
    return bool(configuration(bytes(build.packet.data), build.packet.tid & 0x0F).problem)


@pytest.mark.unmeasured
@rows(EVERY_COMMAND)
def test_the_fake_robot_takes_the_commands_of_spherov2(key: str, method: str) -> None:
    served = 0
    for build in _builds(key, method):
        robot = FakeRobot(parse_settings(f"{key}?matrix=1"))
        robot.hear(build.frame, now=0.0)
        answer, *_ = said_by(robot, 0.0)
        assert (answer.did, answer.cid, answer.seq) == build.packet.id
        if _is_served(key, build):
            served += 1
            assert isinstance(answer, Response)
            refused = Verdict.FAILED if _is_bad_configuration(build) else REFUSED.get(method, Verdict.OK)
            assert V2.verdict(answer.code) is refused, build.arguments
        else:
            assert isinstance(answer, Response)
            assert V2.verdict(answer.code) in (Verdict.NO_DEVICE, Verdict.NO_COMMAND), build.arguments
    assert served


class Listener(NamedTuple):
    """A notification as spherov2 knows it: its (did, cid), and how it hands over what it reads, if it can."""

    pair: tuple[int, int]
    hand_over: Callable[..., None] | None


def _listeners(key: str) -> dict[str, Listener]:
    """Method that adds a listener -> what it listens to, for one class of spherov2."""
    found: dict[str, Listener] = {}
    for name in dir(TOYS[key]):
        bound = inspect.getattr_static(TOYS[key], name)
        if isinstance(bound, partialmethod) and bound.func is Toy._add_listener:
            match bound.args[0]:
                case ((did, cid, 0xFF), hand_over):
                    found[name] = Listener((did, cid), hand_over)
                case (did, cid, _):  # spherov2 has forgotten a pair of brackets, or what is to be called
                    found[name] = Listener((did, cid), None)
    return found


PAYLOADS = {(0x18, 0x12): struct.pack(">3hB3hBL", -4096, 2048, 1, 2, -300, 200, 100, 40, 123_500)}
"""Notifications that the fake robot has no reading for: a collision along the y axis."""
EVERY_LISTENER = [pytest.param(key, name, id=f"{key} {name}") for key in TOYS for name in _listeners(key)]


@pytest.mark.parametrize(
    ("key", "number", "deaf"),
    [
        ("bolt", 11, {(0x10, 0x03)}),
        ("rvr", 17, {(0x10, 0x03)}),
        ("r2d2", 13, {(0x10, 0x03), (0x11, 0x18), (0x11, 0x25)}),
        ("mini", 7, {(0x10, 0x03)}),
        ("bb9e", 12, {(0x10, 0x03), (0x11, 0x18), (0x11, 0x25)}),
    ],
    ids=list(TOYS),
)
def test_every_listener_of_a_class_is_found(key: str, number: int, deaf: set[tuple[int, int]]) -> None:
    listeners = _listeners(key)
    assert len(listeners) == number
    refused = set()
    for name, listener in listeners.items():
        try:
            getattr(_offline(key, []), name)(print)
        except TypeError:
            refused.add(listener.pair)
    assert refused == deaf == {one.pair for one in listeners.values() if one.hand_over is None}


@rows(EVERY_LISTENER)
def test_the_catalogue_knows_the_notifications_of_spherov2(key: str, name: str) -> None:
    row = known(lookup(Generation.V2, *_listeners(key)[name].pair, ROBOTS[key]))
    assert row.kind is Kind.NOTIFICATION
    assert key in row.nodes


@rows(EVERY_LISTENER)
def test_spherov2_reads_our_notifications_as_we_do(key: str, name: str) -> None:
    (did, cid), hand_over = _listeners(key)[name]
    row = known(lookup(Generation.V2, did, cid, ROBOTS[key]))
    payload = PAYLOADS.get((did, cid)) or Readings(ROBOTS[key], seed=3).payload(row, node=1)
    frame = V2.encode_notification(Notification(did, cid, payload, source=2))
    (packet,) = _theirs([frame])
    assert (packet.id, bytes(packet.data), packet.sid) == ((did, cid, 0xFF), payload, 2)
    if hand_over is None or row.response is None:
        return
    heard: list[tuple[object, ...]] = []
    hand_over(lambda *values: heard.append(values), packet)
    (values,) = heard
    decoded = row.response.decode(payload)
    assert not decoded.problem
    fields = {field.name: field for field in row.response.fields}
    if not values:  # spherov2 only tells that it came
        return
    named = values[-1]._asdict() if hasattr(values[-1], "_asdict") else {next(iter(fields)): values[-1]}
    flags = [word for value in decoded.fields.values() if isinstance(value, list) for word in value]
    for part, their_value in named.items():
        if part in fields:
            assert _same(fields[part], decoded.fields[part], their_value), part
        else:  # spherov2 has one part per bit
            assert their_value is (part in flags), part


# The classes of spherov2 on the fake robot.


def _fake(key: str, ran: list[tuple[int, int]] | None = None, **settings: object) -> FakeRobot:
    query = "&".join(f"{name}={value}" for name, value in settings.items())
    note = None if ran is None else lambda executed: ran.append((executed.did, executed.cid))
    return FakeRobot(parse_settings(f"{key}?{query}" if query else key), on_execute=note)


def _told(key: str, frame: bytes) -> dict[Field, object]:
    """The response of an identical fake robot to a frame, by our own decoder and catalogue.

    Where the answer is empty and a notification brings the news, that one counts.
    """
    twin = _fake(key)
    twin.hear(frame, now=0.0)
    *_, last = said_by(twin, 0.0)
    row = known(lookup(Generation.V2, known(last.did), known(last.cid), ROBOTS[key]))
    assert row.response is not None
    decoded = row.response.decode(last.payload)
    assert not decoded.problem
    return {field: decoded.fields[field.name] for field in row.response.fields}


def _ask(key: str, did: int, cid: int, payload: bytes = b"", node: int | None = None) -> list[object]:
    target = None if node is None else 0x10 | node
    return list(_told(key, V2.encode_command(Command(did, cid, payload, target), 7)).values())


@pytest.mark.parametrize("key", EACH_TOY)
def test_a_class_wakes_the_robot_and_puts_it_to_sleep(key: str) -> None:
    ran: list[tuple[int, int]] = []
    robot = _fake(key, ran)
    robot.hear(V2.encode_command(Command(0x13, 0x01), 1), now=0.0)
    robot.speak(now=0.0)
    asleep = robot.asleep
    with session(TOYS[key], robot) as (toy, adapter):
        slept: SimpleQueue[bool] = SimpleQueue()
        toy.add_did_sleep_notify_listener(lambda: slept.put(robot.asleep))
        toy.wake()
        awake = not robot.asleep
        toy.sleep()
        adapter.settle()
        assert slept.get(timeout=10)
        handshake = [(ANTI_DOS_CHARACTERISTIC, ANTI_DOS_PHRASE)] if ROBOTS[key].handshake else []
        assert adapter.greetings == handshake
    assert (asleep, awake, robot.asleep) == (True, True, True)
    assert ran == [(0x13, 0x01), (0x13, 0x0D), (0x13, 0x01)]


@pytest.mark.parametrize("key", EACH_TOY)
def test_a_class_works_on_a_slow_and_fragmented_line(key: str) -> None:
    robot = _fake(key, latency="800ms", split=1)
    with session(TOYS[key], robot) as (toy, adapter):
        toy.wake()
        assert adapter.now == pytest.approx(0.8)
        assert toy.ping(bytes(MARKERS), proc=Processors.PRIMARY) == bytes(MARKERS)
        assert adapter.now == pytest.approx(1.6)


@pytest.mark.parametrize("key", EACH_TOY)
def test_a_class_hears_nothing_from_a_robot_asleep(key: str) -> None:
    with session(TOYS[key], _fake(key)) as (toy, _):
        toy.sleep()
        with pytest.raises(TimeoutError):
            toy.get_main_app_version(proc=Processors.PRIMARY)
        toy.wake()
        assert len(toy.get_main_app_version(proc=Processors.PRIMARY)) == 3


@pytest.mark.parametrize("key", ["bolt", "r2d2", "mini", "bb9e"])
def test_a_class_streams_sensors_in_the_order_it_thinks(key: str) -> None:
    samples: SimpleQueue[dict[str, dict[str, float]]] = SimpleQueue()
    with session(TOYS[key], _fake(key)) as (toy, adapter):
        toy.sensor_control.add_sensor_data_listener(samples.put)
        toy.sensor_control.set_count(3)
        toy.sensor_control.enable("accelerometer", "attitude", "gyroscope")
        adapter.settle()
    assert samples.qsize() == 3
    for sample in (samples.get() for _ in range(3)):
        assert sample.keys() == {"attitude", "accelerometer", "gyroscope"}
        lying = sample["accelerometer"]
        assert (lying["x"], lying["y"], lying["z"]) == pytest.approx((0, 0, 1), abs=0.1)
        assert sample["attitude"].keys() == {"pitch", "roll", "yaw"}


@pytest.mark.parametrize("key", EACH_TOY)
def test_spherov2_reaches_the_characteristics_we_know(key: str) -> None:
    assert TOYS[key]._send_uuid == TOYS[key]._response_uuid == API_CHARACTERISTIC
    assert TOYS[key].toy_type.prefix == ROBOTS[key].prefix


@pytest.mark.parametrize(
    ("key", "method", "arguments", "asked"),
    [
        pytest.param("bolt", "get_battery_voltage", {}, (0x13, 0x03), id="bolt volts"),
        pytest.param("bolt", "get_battery_voltage_state", {}, (0x13, 0x17), id="bolt state"),
        pytest.param("mini", "get_battery_percentage", {}, (0x13, 0x10), id="mini percentage"),
        pytest.param("mini", "get_battery_voltage", {}, (0x13, 0x03), id="mini volts"),
        pytest.param("r2d2", "get_battery_voltage", {}, (0x13, 0x03), id="r2d2 volts"),
        pytest.param("bb9e", "get_battery_voltage", {}, (0x13, 0x03), id="bb9e volts"),
        pytest.param("rvr", "get_battery_percentage", {}, (0x13, 0x10, b"", 1), id="rvr percentage"),
        pytest.param(
            "rvr",
            "get_battery_voltage_in_volts",
            {"reading_type": 1},
            (0x13, 0x25, b"\x01", 1),
            id="rvr volts",
        ),
    ],
)
def test_a_class_reads_the_battery(
    key: str, method: str, arguments: dict[str, int], asked: tuple[Any, ...]
) -> None:
    with session(TOYS[key], _fake(key)) as (toy, _):
        theirs = getattr(toy, method)(**arguments)
    (ours,) = _ask(key, *asked)
    if isinstance(ours, str):
        assert ours == theirs.name.lower()
    else:
        assert ours == pytest.approx(theirs, rel=1e-6)


@pytest.mark.parametrize(
    ("key", "node"),
    [*((key, None) for key in TOYS if key != "rvr"), ("bolt", 2), ("rvr", 1), ("rvr", 2)],
)
def test_a_class_reads_the_version(key: str, node: int | None) -> None:
    with session(TOYS[key], _fake(key)) as (toy, _):
        assert list(toy.get_main_app_version(proc=node)) == _ask(key, 0x11, 0x00, node=node)


@pytest.mark.parametrize("key", ["bolt", "r2d2", "bb9e"])
def test_a_class_reads_the_version_that_comes_as_a_notification(key: str) -> None:
    with session(TOYS[key], _fake(key)) as (toy, _):
        assert list(toy.get_secondary_main_app_version()) == _ask(key, 0x11, 0x17)


@pytest.mark.parametrize("key", EACH_TOY)
def test_a_class_sets_every_led(key: str) -> None:
    robot = _fake(key)
    wanted = {led: 0xFF - 7 * led for led in TOYS[key].LEDs}
    with session(TOYS[key], robot) as (toy, _):
        set_leds = getattr(toy, f"set_all_leds_with_{8 * known(ROBOTS[key].leds).mask_bytes}_bit_mask")
        set_leds(sum(1 << led for led in wanted), [*wanted.values()])
    assert robot.leds == {led.name.lower().removesuffix("_white"): value for led, value in wanted.items()}


def _leds(key: str, word: str) -> list[str]:
    """The names of the LEDs that a word means in our table."""
    return [group.name for group in known(ROBOTS[key].leds).groups if word in (group.name, *group.aliases)]


RVR_LEDS = pytest.param(
    "rvr",
    id="rvr",
    marks=pytest.mark.skipif(
        not hasattr(RVR.sleep, "_partialmethod"),
        reason="from Python 3.13 on spherov2 does not find out what its RVR implements",
    ),
)


@pytest.mark.parametrize("key", ["bolt", RVR_LEDS, "r2d2", "mini"])
def test_what_spherov2_calls_front_is_front(key: str) -> None:
    robot = _fake(key)
    with session(TOYS[key], robot) as (toy, _):
        ToyUtil.set_front_led(toy, 0x8D, 0xAB, 0xD8)
    colour = {"red": 0x8D, "green": 0xAB, "blue": 0xD8}
    lit = {f"{led}_{name}": value for led in _leds(key, "front") for name, value in colour.items()}
    assert {channel: value for channel, value in robot.leds.items() if value} == lit


@pytest.mark.parametrize("key", ["bolt", RVR_LEDS, "r2d2", "mini", "bb9e"])
def test_what_spherov2_calls_back_is_back(key: str) -> None:
    robot = _fake(key)
    with session(TOYS[key], robot) as (toy, _):
        ToyUtil.set_back_led_brightness(toy, 0xAB)
    lit = {channel: value for channel, value in robot.leds.items() if value}
    assert set(lit.values()) == {0xAB}
    assert {channel.removesuffix("_blue") for channel in lit} == set(_leds(key, "back"))


READS_OF = {"bolt": 28, "rvr": 46, "r2d2": 26, "mini": 20, "bb9e": 21}
"""How many reads each class has that it can build and does not misread."""
MISREAD = {"get_bot_to_bot_infrared_readings": "spherov2 takes four bits of what are four bytes"}
"""Reads of which spherov2 makes something else than its own tables say."""
READS = [
    pytest.param(key, method, id=f"{key} {method}")
    for key in TOYS
    for method in _commands(key)
    if method not in BROKEN | MISREAD and known(_row(key, _builds(key, method)[0])).risk is Risk.READ
]


def test_every_read_is_found() -> None:
    assert Counter(param.values[0] for param in READS) == READS_OF


@pytest.mark.unmeasured
@rows(READS)
def test_spherov2_reads_what_we_read(key: str, method: str) -> None:
    builds = [build for build in _builds(key, method) if _is_served(key, build)]
    ran: list[tuple[int, int]] = []
    with session(TOYS[key], _fake(key, ran)) as (toy, _):
        results = [getattr(toy, method)(**build.arguments) for build in builds]
    assert ran == [(build.packet.did, build.packet.cid) for build in builds]
    for build, theirs in zip(builds, results, strict=True):
        if theirs is None:  # spherov2 sends it and looks at nothing
            continue
        ours = _told(key, build.frame)
        values = [theirs] if len(ours) == 1 else theirs
        for (field, value), their_value in zip(ours.items(), values, strict=True):
            assert _same(field, value, their_value), (
                f"{field.name}: {value!r}, spherov2 reads {their_value!r}"
            )


@pytest.mark.parametrize("key", ["bolt", "rvr"])
def test_infrared_readings_lie_where_the_table_of_spherov2_has_them(key: str) -> None:
    payload = bytes((0x11, 0x22, 0x33, 0x44))
    (row,) = [
        row for row in commands_of(ROBOTS[key]) if row.name == "sensor.get_bot_to_bot_infrared_readings"
    ]
    assert row.response is not None
    readings = row.response.decode(payload).fields
    raw = int.from_bytes(payload, "big")
    assert readings == {
        name.lower(): (raw & where) // (where & -where)
        for name, where in InfraredSensorLocations.__members__.items()
    }


# What spherov2 and we make of the same frames.


class Seen(NamedTuple):
    """The contents of a robot's frame, independent of the decoder."""

    answer: bool
    did: int | None
    cid: int | None
    seq: int | None
    code: int
    target: int | None
    source: int | None
    flags: int
    data: bytes


def _seen_by_them(chunks: Iterable[bytes]) -> list[Seen]:
    return [
        Seen(bool(one.flags & 1), did, cid, seq, int(one.err), one.tid, one.sid, one.flags, bytes(one.data))
        for one in _theirs(chunks)
        for did, cid, seq in [one.id]
    ]


def _seen_by_us(chunks: Iterable[bytes]) -> list[Seen]:
    decoder = V2.decoder(Role.HOST)
    seen = []
    for packet in (packet for chunk in chunks for packet in decoder.feed(chunk)):
        match packet:
            case Response(seq, code, payload, did, cid, source, target, flags):
                seen.append(Seen(True, did, cid, seq, code, target, source, flags, payload))
            case Notification(did, cid, payload, source, target, seq, flags):
                seen.append(Seen(False, did, cid, seq, 0, target, source, flags, payload))
            case other:
                pytest.fail(f"a fake robot said {other}")
    return seen


STREAM = bytes.fromhex("0032 03 0003e000")
"""Every 50 ms, three times: attitude and acceleration."""


def _conversation(key: str) -> Iterator[tuple[Command, int]]:
    """Every documented read at every node, with sequence numbers to escape; then errors, then news."""
    robot = ROBOTS[key]
    number = 0
    for row in commands_of(robot):
        if row.kind is Kind.COMMAND and row.risk is Risk.READ:
            payload = (row.request.zeros() if row.request else b"") if row.sample is None else row.sample
            for node in row.nodes[key]:
                number += 1
                for seq in (number % 0xFF, *MARKERS, 0xFF):
                    yield Command(row.did, row.cid, payload, 0x10 | node), seq
                    yield Command(row.did, row.cid, payload), seq
    for command in (
        Command(0x77, 0x00),
        Command(0x13, 0xEE),
        Command(0x13, 0x03, b"?"),
        Command(0x13, 0x03, b"", 0x19),
    ):
        yield command, 5
    yield from ((Command(0x10, 0x09, bytes([code])), code) for code in range(0x0B))
    yield Command(0x18, 0x00, STREAM, 0x10 if ROBOTS[key].addressed else None), 6
    yield Command(0x11, 0x17), 7
    yield Command(0x13, 0x01), 8
    yield Command(0x13, 0x0D), 9


def _say(robot: FakeRobot, conversation: Iterable[tuple[Command, int]]) -> list[bytes]:
    """What a robot says to commands, each heard when all is said to the one before."""
    now, chunks = 0.0, []
    for command, seq in conversation:
        robot.hear(V2.encode_command(command, seq), now=now)
        while (due := robot.next_time()) is not None:
            now = max(now, due)
            chunks += robot.speak(now=now)
    return chunks


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    "settings", [{}, {"split": 1}, {"split": 7, "latency": "15ms"}], ids=["whole", "1", "7"]
)
@pytest.mark.parametrize("key", EACH_TOY)
def test_spherov2_parses_the_fake_robot_as_we_do(key: str, settings: dict[str, Any]) -> None:
    conversation = list(_conversation(key))
    chunks = _say(_fake(key, **settings), conversation)
    ours, theirs = _seen_by_us(chunks), _seen_by_them(chunks)
    assert theirs == ours
    assert sum(seen.answer for seen in ours) == len(conversation)
    said = {seen[1:3] for seen in ours if not seen.answer}
    assert said >= {(0x13, 0x1A), (0x13, 0x11)} | ({(0x18, 0x02)} if key != "rvr" else set())
    assert {seen.code for seen in ours} >= {0x00, 0x01, 0x02, 0x05}
    stream = b"".join(chunks)
    assert all(stream.count(bytes((0xAB, marker & ~0x88))) > len(conversation) // 10 for marker in MARKERS)


def test_spherov2_knows_every_code_of_the_table() -> None:
    chunks = _say(_fake("rvr"), ((Command(0x10, 0x09, bytes([code])), code) for code in range(0x0B)))
    ours, theirs = _seen_by_us(chunks), _theirs(chunks)
    assert [seen.code for seen in ours] == [int(one.err) for one in theirs] == list(range(0x0B))
    for seen, one in zip(ours, theirs, strict=True):
        assert V2.code_name(seen.code).replace(" ", "_") == one.err.name.removeprefix("command_is_")


BYTE = st.integers(0, 0xFF)
DATA = st.binary(max_size=64) | st.lists(st.sampled_from((*MARKERS, 0x05, 0x23, 0x50)), max_size=32).map(
    bytes
)
ADDRESS = st.none() | BYTE


@given(BYTE, BYTE, BYTE, DATA, ADDRESS, ADDRESS, st.sampled_from([0x02, 0x06, 0x08, 0x0A, 0x0E, 0x00]))
def test_any_command_of_spherov2_decodes(
    did: int, cid: int, seq: int, data: bytes, target: int | None, source: int | None, flags: int
) -> None:
    flags |= (0x10 if target is not None else 0) | (0x20 if source is not None else 0)
    frame = TheirPacket(flags, did, cid, seq, target, source, bytearray(data)).build()
    (packet,) = V2.decoder(Role.ROBOT).feed(bytes(frame))
    assert packet[:4] == (Command(did, cid, data, target), seq, source, flags)
    assert V2.frame_of(packet) == bytes(frame)


@given(BYTE, BYTE, BYTE, DATA, ADDRESS, ADDRESS, st.integers(0, 0x0A))
def test_any_answer_of_ours_reads_alike(
    did: int, cid: int, seq: int, data: bytes, target: int | None, source: int | None, code: int
) -> None:
    frame = V2.encode_response(Response(seq, code, data, did, cid, source, target))
    assert _seen_by_them([frame]) == _seen_by_us([frame])
    (packet,) = _theirs([frame])
    assert packet.build() == frame


@given(BYTE, BYTE, BYTE, DATA, ADDRESS, ADDRESS)
def test_any_notification_of_ours_reads_alike(
    did: int, cid: int, seq: int, data: bytes, target: int | None, source: int | None
) -> None:
    frame = V2.encode_notification(Notification(did, cid, data, source, target, seq))
    assert _seen_by_them([frame]) == _seen_by_us([frame])


def test_spherov2_counts_as_far_as_we_do() -> None:
    manager = TheirPacket.Manager()
    turns = [manager.new_packet(0x10, 0x00).seq for _ in range(2 * len(V2.sequence_numbers))]
    assert turns == [*V2.sequence_numbers, *V2.sequence_numbers]
