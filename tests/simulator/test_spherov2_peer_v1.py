"""spherov2 0.12.1 as a V1 peer: its commands, its toy classes and its parser, compared with ours."""

import inspect
import struct
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache, partialmethod
from itertools import pairwise
from queue import SimpleQueue
from typing import Any, NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st
from spherov2.commands import core as their_core
from spherov2.commands.bootloader import Bootloader
from spherov2.commands.core import Core, IntervalOptions
from spherov2.commands.sphero import CollisionDetectionMethods
from spherov2.commands.sphero import Sphero as SpheroCommands
from spherov2.controls.v1 import Packet as TheirPacket
from spherov2.listeners.core import BluetoothInfo, PowerState, Versions
from spherov2.listeners.sphero import Options
from spherov2.toy import Toy
from spherov2.toy.bb8 import BB8
from spherov2.toy.ollie import Ollie
from spherov2.toy.sphero import Sphero
from spherov2.toy.sprk2 import Sprk2
from spherov2.utils import ToyUtil

from sphero_probe.catalogue import ROBOTS, commands_of, lookup, notification_row
from sphero_probe.catalogue.gatt import (
    V1_COMMAND_CHARACTERISTIC,
    V1_HANDSHAKE,
    V1_RESPONSE_CHARACTERISTIC,
    V1_WAKE_CHARACTERISTIC,
)
from sphero_probe.catalogue.model import CommandRow, Kind
from sphero_probe.catalogue.payload.enums import VALUE_NAMES
from sphero_probe.catalogue.payload.fields import Field
from sphero_probe.catalogue.risk import Risk
from sphero_probe.catalogue.sensors import Masks, streaming_fields
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import (
    Command,
    Generation,
    Malformed,
    Notification,
    Request,
    Response,
    Role,
    Verdict,
)
from sphero_probe.simulator import Executed, FakeRobot, parse_settings
from sphero_probe.simulator.readings import Readings
from tests.support.fake_robot import Said, said_by
from tests.support.narrowing import every, known
from tests.support.spherov2_adapter import FakeAdapter, session
from tests.support.tables import rows

V1 = CODECS[Generation.V1]
TOYS: dict[str, type[Toy]] = {"bb8": BB8, "ollie": Ollie, "sprk-plus": Sprk2, "sphero": Sphero}
EACH_TOY = [pytest.param(key, id=key) for key in TOYS]
OVER_BLE = [pytest.param(key, id=key) for key in ("bb8", "ollie", "sprk-plus")]
"""The classes whose robots are reached over BLE: spherov2 opens a Sphero as if it were one of them."""

# The commands of spherov2: found in its classes, called with plausible arguments, caught before sending.

COMMANDS = {"bb8": 33, "ollie": 32, "sprk-plus": 33, "sphero": 31}
"""How many commands each class of spherov2 0.12.1 has."""
IN_NO_CLASS = {"get_temporary_options": SpheroCommands.get_temporary_options}
"""Commands that spherov2 can build but that are in none of its classes."""
NEVER_SENT = {"ping": "it gives the packet back and does not send it"}
"""Commands that spherov2 builds and forgets to send."""
UNBUILDABLE = [
    pytest.param(
        "configure_locator",
        {"flags": 0, "x": -1, "y": 0, "yaw_tare": 0},
        OverflowError,
        id="a place left of the origin: it writes coordinates without a sign",
    ),
    pytest.param(
        "configure_locator",
        {"flags": 0, "x": 0, "y": -1, "yaw_tare": 0},
        OverflowError,
        id="a place behind the origin: likewise",
    ),
    pytest.param("here_is_page", {"page": bytes(64)}, TypeError, id="a page: it takes no argument for it"),
    pytest.param(
        "set_main_led",
        {"r": 1, "g": 2, "b": 3, "persist": 1},
        TypeError,
        id="a colour to keep: it takes no argument for it",
    ),
    pytest.param("set_bluetooth_name", {"name": "Ball"}, TypeError, id="a name as text: it wants bytes"),
    pytest.param("set_bluetooth_name", {"name": bytes(255)}, ValueError, id="a name of more than a packet"),
]
"""What spherov2 cannot build of commands that it has."""

_BYTE = (0x00, 0x01, 0x7F, 0xFE, 0xFF)
_WORD = (0x0000, 0x0001, 0xFFFE, 0x8DAB, 0xFFFF)
_DEGREES = (0, 0xFE, 0xFF, 0x0100, 359)
_OPTIONS = tuple(Options(*(bit == at for bit in range(7))) for at in range(7))

SAMPLES: dict[str, tuple[object, ...]] = {
    "count": (0, 1, 0xFF),
    "extended_mask": (0x00000000, 0x0D800000, 0xF0000000),
    "heading": _DEGREES,
    "interval": (1, 250, 0xFFFE),
    "interval_option": tuple(IntervalOptions),
    "mask": (0x00000000, 0x0007E000, 0x00001C60),
    "name": (b"", b"BB-8", b"\xff\xfe\xff\xff more bytes than a write holds"),
    "num_samples_per_packet": (1, 2, 8),
    "options": (Options(*[False] * 7), Options(*[True] * 7), *_OPTIONS),
    "s2": _DEGREES,
    "set_inactivity_timeout.timeout": (60, 600, 0xFFFF),
    "set_motion_timeout.timeout": _WORD,
    "unk2": _WORD,
    "x": (0, 1, 0x7FFF, 0xFFFF),
    "y": (0, 0xFF, 0x8000, 0xFFFE),
    "yaw_tare": _DEGREES,
}
"""Values by the name of a parameter, where its annotation does not say enough; zipped, not multiplied."""
BY_TYPE: dict[object, tuple[object, ...]] = {bool: (False, True), int: _BYTE, inspect.Parameter.empty: _BYTE}


class Build(NamedTuple):
    """One command of spherov2 as it was built."""

    arguments: dict[str, Any]
    packet: TheirPacket.Request

    @property
    def frame(self) -> bytes:
        return bytes(self.packet.build())


class _Sent(Exception):  # noqa: N818 - it is no error, it ends the call
    """Stops a command of spherov2 before it is sent."""


@cache
def _commands(key: str) -> dict[str, Callable[..., object]]:
    """Name -> the function of ``spherov2.commands`` behind it, for one robot; those in no class included."""
    found = dict(IN_NO_CLASS)
    for name in dir(TOYS[key]):
        function = inspect.getattr_static(TOYS[key], name)
        if inspect.isfunction(function) and function.__module__.startswith("spherov2.commands."):
            found[name] = function
    return found


def _samples(method: str, parameter: inspect.Parameter) -> tuple[object, ...]:
    kind = parameter.annotation
    by_name = SAMPLES.get(f"{method}.{parameter.name}", SAMPLES.get(parameter.name))
    return by_name or BY_TYPE.get(kind) or tuple(kind.__members__.values())


def _arguments(key: str, method: str) -> Iterator[dict[str, object]]:
    """Return sets of arguments with every sample of every parameter."""
    _, *parameters = inspect.signature(_commands(key)[method]).parameters.values()
    samples = {one.name: _samples(method, one) for one in parameters if one.name != "proc"}
    for at in range(max(map(len, samples.values()), default=1)):
        yield {
            name: values[(at + place) % len(values)] for place, (name, values) in enumerate(samples.items())
        }


def _offline(key: str, packets: list[TheirPacket.Request], ahead: int = 0) -> Toy:
    """One of spherov2's robots that keeps what it would send; its sequence numbers start at ``ahead``."""

    def catch(packet: TheirPacket.Request) -> None:
        packet.build()
        packets.append(packet)
        raise _Sent

    toy = TOYS[key](_fake(key), None)
    toy._execute = catch
    for _ in range(ahead):
        toy._packet_manager.new_packet(0, 0, None)
    return toy


@cache
def _builds(key: str, method: str) -> tuple[Build, ...]:
    """Call one command of spherov2 with every set of arguments."""
    packets: list[TheirPacket.Request] = []
    toy = _offline(key, packets, ahead=sum(method.encode()) % 0x100)
    sets = list(_arguments(key, method))
    for arguments in sets:
        try:
            unsent = _commands(key)[method](toy, **arguments)
        except _Sent:
            continue
        assert method in NEVER_SENT
        packets.append(unsent)
    return tuple(Build(arguments, packet) for arguments, packet in zip(sets, packets, strict=True))


def _fake(key: str, ran: list[Executed] | None = None, **settings: object) -> FakeRobot:
    query = "&".join(f"{name}={value}" for name, value in settings.items())
    return FakeRobot(
        parse_settings(f"{key}?{query}" if query else key), on_execute=None if ran is None else ran.append
    )


def _row(key: str, build: Build) -> CommandRow:
    row = lookup(Generation.V1, build.packet.did, build.packet.cid, ROBOTS[key])
    assert row is not None
    return row


EVERY_COMMAND = [pytest.param(key, method, id=f"{key} {method}") for key in TOYS for method in _commands(key)]


@pytest.mark.parametrize("key", EACH_TOY)
def test_every_command_of_a_class_is_found(key: str) -> None:
    assert len(_commands(key).keys() - IN_NO_CLASS.keys()) == COMMANDS[key]
    assert not any(hasattr(TOYS[key], method) for method in IN_NO_CLASS)


def test_every_command_of_spherov2_is_in_some_class() -> None:
    functions = {
        name
        for device in (Core, Bootloader, SpheroCommands)
        for name, function in vars(device).items()
        if isinstance(function, staticmethod)
    }
    assert functions == {name for key in TOYS for name in _commands(key)}
    assert len(functions) >= 34
    assert sum(len(_builds(*param.values)) for param in EVERY_COMMAND) >= 421


@rows(EVERY_COMMAND)
def test_commands_of_spherov2_decode_to_the_same_fields(key: str, method: str) -> None:
    builds = _builds(key, method)
    packets = V1.decoder(Role.ROBOT).feed(b"".join(build.frame for build in builds))
    assert packets == [
        Request(
            Command(their.did, their.cid, bytes(their.data)),
            their.seq,
            flags=TheirPacket.SOP,
            wants_answer=True,
        )
        for _, their in builds
    ]
    assert [V1.encode_command(packet.command, packet.seq) for packet in every(Request, packets)] == [
        build.frame for build in builds
    ]
    assert [V1.frame_of(packet) for packet in packets] == [build.frame for build in builds]


@rows(EVERY_COMMAND)
def test_the_node_makes_no_difference_to_a_v1_command(key: str, method: str) -> None:
    packets: list[TheirPacket.Request] = []
    toy = _offline(key, packets)
    arguments = next(_arguments(key, method))
    for proc in (None, 1):
        try:
            packets.append(_commands(key)[method](toy, **arguments, proc=proc))
        except _Sent:
            continue
    assert packets[0]._replace(seq=1) == packets[1]


@pytest.mark.parametrize(("method", "arguments", "error"), UNBUILDABLE)
@pytest.mark.parametrize("key", EACH_TOY)
def test_what_spherov2_cannot_build_it_still_cannot(
    key: str,
    method: str,
    arguments: dict[str, Any],
    error: type[Exception],
) -> None:
    packets: list[TheirPacket.Request] = []
    toy = _offline(key, packets)
    with pytest.raises(error):
        getattr(toy, method)(**arguments)
    assert not packets


@pytest.mark.parametrize("key", EACH_TOY)
def test_what_spherov2_forgets_to_send_it_still_forgets(key: str) -> None:
    packets: list[TheirPacket.Request] = []
    toy = _offline(key, packets)
    forgotten = [method for method in NEVER_SENT if isinstance(getattr(toy, method)(), TheirPacket.Request)]
    assert forgotten == [*NEVER_SENT]
    assert not packets


# The same commands, in the catalogue and on the fake robot.

LAYOUT_UNKNOWN = {
    "here_is_page": "spherov2 builds it without the page, and no source says what one looks like"
}
"""Commands whose arguments are in no layout."""
NAMED_OTHERWISE = {"configure_collision_detection": {"y_threshold": "x_speed", "x_speed": "y_threshold"}}
"""Command -> parameter -> field in its place: spherov2 has them in another order than the maker's table."""
REFUSED = {"here_is_page": Verdict.BAD_LENGTH}
"""Commands that the fake robot does not take as spherov2 sends them: there is no page in it."""
BITS = {
    "self_level": ("opt1", "opt2", "opt3", "opt4"),
    "set_persistent_options": ("options",),
    "set_temporary_options": ("options",),
}
"""Commands whose first field is a set of bits, and the parameters that these are in spherov2."""
PERSISTENT_BITS = dict(zip(Options._fields, (0, 1, 2, 3, 4, 8, 10), strict=True))


@rows(EVERY_COMMAND)
def test_the_catalogue_knows_the_commands_of_spherov2(key: str, method: str) -> None:
    for build in _builds(key, method):
        row = _row(key, build)
        assert row.kind is Kind.COMMAND
        assert method in (row.name.partition(".")[2], *row.aliases)
        assert key in row.nodes
        assert "spherov2" in row.sources
        if method in LAYOUT_UNKNOWN:
            assert row.request is None
        else:
            assert row.request is not None
            assert row.request.accepts(len(build.packet.data))


def _their_numbers(method: str, arguments: dict[str, Any]) -> list[object]:
    """What spherov2 was given, as one value for each field of the command."""
    values = dict(arguments)
    first = []
    parts = [values.pop(name) for name in BITS.get(method, ())]
    if method == "self_level":
        first = [sum(int(on) << bit for bit, on in enumerate(parts))]
    elif parts:
        (options,) = parts
        first = [sum(on << PERSISTENT_BITS[name] for name, on in options._asdict().items())]
    return [*first, *values.values()]


def _same(field: Field, ours: object, theirs: object) -> bool:
    """Tell whether a decoded value stands for the number (or the text) that spherov2 was given."""
    if isinstance(theirs, bytes):
        return theirs.decode(errors="backslashreplace") == ours
    if field.values:
        return VALUE_NAMES[field.values].number(ours) == theirs
    assert isinstance(ours, int | float)
    assert isinstance(theirs, int)
    bits = 8 * field.width
    return (round(ours * field.scale) - theirs) % (1 << bits) == 0  # spherov2 has no negative numbers


@rows([param for param in EVERY_COMMAND if param.values[1] not in LAYOUT_UNKNOWN])
def test_layouts_give_back_the_arguments(key: str, method: str) -> None:
    for build in _builds(key, method):
        layout = _row(key, build).request
        assert layout is not None
        decoded = layout.decode(bytes(build.packet.data))
        assert not decoded.problem
        fields = [field for field in layout.fields if field.name in decoded.fields]
        for field, theirs in zip(fields, _their_numbers(method, build.arguments), strict=True):
            ours = decoded.fields[field.name]
            assert _same(field, ours, theirs), f"{field.name} reads {ours!r}, spherov2 was given {theirs!r}"


@rows([param for param in EVERY_COMMAND if param.values[1] not in BITS | LAYOUT_UNKNOWN])
def test_what_both_call_alike_lies_in_the_same_place(key: str, method: str) -> None:
    build = _builds(key, method)[0]
    fields = [field.name for field in known(_row(key, build).request).fields]
    crossed = {
        parameter: field
        for parameter, field in zip(build.arguments, fields, strict=False)
        if parameter != field and parameter in fields
    }
    assert crossed == NAMED_OTHERWISE.get(method, {})


@rows(EVERY_COMMAND)
def test_the_fake_robot_takes_the_commands_of_spherov2(key: str, method: str) -> None:
    for build in _builds(key, method):
        ran: list[Executed] = []
        robot = _fake(key, ran)
        robot.hear(build.frame, now=0.0)
        answer, *_ = said_by(robot, 0.0)
        assert isinstance(answer, Response)
        assert answer.seq == build.packet.seq
        assert V1.verdict(answer.code) is REFUSED.get(method, Verdict.OK), build.arguments
        expected = [] if method in REFUSED else [(*build.packet[:2], build.packet.data)]
        assert [(run.did, run.cid, run.payload) for run in ran] == expected


# Notifications.


class Listener(NamedTuple):
    """A notification as spherov2 knows it: its id, and how it hands over what it reads."""

    number: int
    hand_over: Callable[..., None]


def _listeners(key: str) -> dict[str, Listener]:
    """Method that adds a listener -> what it listens to, for one class of spherov2."""
    found = {}
    for name in dir(TOYS[key]):
        bound = inspect.getattr_static(TOYS[key], name)
        if isinstance(bound, partialmethod) and bound.func is Toy._add_listener:
            ((sop2, number), hand_over) = bound.args[0]
            assert sop2 == TheirPacket.ASYNC
            found[name] = Listener(number, hand_over)
    return found


EVERY_LISTENER = [pytest.param(key, name, id=f"{key} {name}") for key in TOYS for name in _listeners(key)]


@pytest.mark.parametrize("key", EACH_TOY)
def test_every_listener_of_a_class_is_found(key: str) -> None:
    assert {listener.number for listener in _listeners(key).values()} == {1, 3, 5, 7, 12, 20}
    assert len(_listeners(key)) == 6


@rows(EVERY_LISTENER)
def test_spherov2_reads_our_notifications_as_we_do(key: str, name: str) -> None:
    number, hand_over = _listeners(key)[name]
    row = known(notification_row(Generation.V1, None, number, ROBOTS[key]))
    assert row.kind is Kind.NOTIFICATION
    assert key in row.nodes
    assert name.removeprefix("add_").removesuffix("_listener") == row.name.partition(".")[2]
    for seed in range(8):
        payload = Readings(ROBOTS[key], seed).payload(row, node=1)
        (packet,) = _theirs([V1.encode_notification(Notification(None, number, payload))])
        assert (packet.id, bytes(packet.data)) == ((TheirPacket.ASYNC, number), payload)
        heard: list[tuple[object, ...]] = []
        hand_over(lambda *values, heard=heard: heard.append(values), packet)
        assert row.response is not None
        decoded = row.response.decode(payload)
        assert not decoded.problem
        assert heard == [_as_theirs(row, decoded.fields)]


def _as_theirs(row: CommandRow, fields: Mapping[str, Any]) -> tuple[object, ...]:
    """Our reading of a notification in the shape that spherov2 has for it."""
    assert row.response is not None
    values = {
        field.name: VALUE_NAMES[field.values].number(fields[field.name])
        if field.values
        else fields[field.name]
        for field in row.response.fields
    }
    if row.cid == 0x07:  # one part per axis, and seconds
        axes = values.pop("axes")
        acceleration, power = [*values.values()][:3], [*values.values()][3:6]
        return ((*acceleration, bool(axes & 1), bool(axes & 2), *power, values["time"] / 1000),)
    return tuple(values.values())


def test_a_collision_lies_where_both_have_it() -> None:
    payload = struct.pack(">3hB2hBL", -4096, 2048, 1, 2, -300, 200, 40, 123_500)
    row = known(notification_row(Generation.V1, None, 0x07, ROBOTS["bb8"]))
    assert row.response is not None
    decoded = row.response.decode(payload)
    assert decoded.fields == {
        "acceleration_x": -1.0,
        "acceleration_y": 0.5,
        "acceleration_z": 1 / 4096,
        "axes": ["y_axis"],
        "power_x": -300,
        "power_y": 200,
        "speed": 40,
        "time": 123_500,
    }
    heard: list[tuple[object, ...]] = []
    (packet,) = _theirs([V1.encode_notification(Notification(None, 0x07, payload))])
    _listeners("bb8")["add_collision_detected_notify_listener"].hand_over(heard.append, packet)
    assert heard == [(-1.0, 0.5, 1 / 4096, False, True, -300, 200, 40, 123.5)]


# The classes of spherov2 on the fake robot.


def _told(key: str, did: int, cid: int) -> Mapping[str, Any]:
    """What a twin of the fake robot answers to a read, by our own decoder and catalogue."""
    twin = _fake(key)
    twin.hear(V1.encode_command(Command(did, cid), 7), now=0.0)
    (answer,) = said_by(twin, 0.0)
    decoded = known(known(lookup(Generation.V1, did, cid, ROBOTS[key])).response).decode(answer.payload)
    assert not decoded.problem
    return decoded.fields


def _send(toy: Toy, did: int, cid: int, data: bytes = b"") -> TheirPacket.Response:
    """Send what spherov2 has no method for (or forgets to send) by spherov2's own ways."""
    return toy._execute(toy._packet_manager.new_packet(did, cid, None, data))


@pytest.mark.parametrize("key", OVER_BLE)
def test_spherov2_reaches_the_characteristics_we_know(key: str) -> None:
    toy = TOYS[key]
    assert (toy._send_uuid, toy._response_uuid) == (V1_COMMAND_CHARACTERISTIC, V1_RESPONSE_CHARACTERISTIC)
    assert tuple((uuid, bytes(data)) for uuid, data in toy._handshake) == V1_HANDSHAKE[:2]
    assert toy.toy_type.prefix == ROBOTS[key].prefix


@pytest.mark.parametrize("key", OVER_BLE)
def test_a_class_greets_the_robot_and_wakes_it(key: str) -> None:
    with session(TOYS[key], _fake(key)) as (toy, adapter):
        assert adapter.greetings == [*V1_HANDSHAKE[:2]]
        toy.wake()
        assert adapter.greetings == [*V1_HANDSHAKE]
        answer = toy._execute(toy.ping())
    assert (answer.mrsp, answer.data) == (TheirPacket.Error.command_succeeded, b"")


@pytest.mark.parametrize(
    "greetings",
    [
        pytest.param([], id="nothing"),
        pytest.param([(V1_HANDSHAKE[0][0], b"011i4")], id="wrong phrase"),
        pytest.param(V1_HANDSHAKE[1:], id="all but the phrase"),
    ],
)
def test_without_its_phrase_a_robot_is_not_to_be_had(greetings: Sequence[tuple[str, bytes]]) -> None:
    robot = _fake("ollie")
    adapter = FakeAdapter(robot, robot.address)
    for uuid, data in greetings:
        adapter.write(uuid, data)
    adapter.write(V1_COMMAND_CHARACTERISTIC, V1.encode_command(Command(0x00, 0x01), 0))
    with pytest.raises(ConnectionError):
        adapter.settle()


def test_a_characteristic_of_another_generation_is_not_there() -> None:
    robot = _fake("ollie")
    with pytest.raises(LookupError):
        FakeAdapter(robot, robot.address).write("00010002-574f-4f20-5370-6865726f2121", b"")


@pytest.mark.parametrize("key", OVER_BLE)
def test_a_class_puts_the_robot_to_sleep_and_wakes_it(key: str) -> None:
    ran: list[Executed] = []
    robot = _fake(key, ran)
    slept: SimpleQueue[bool] = SimpleQueue()
    with session(TOYS[key], robot) as (toy, adapter):
        toy.add_did_sleep_notify_listener(lambda: slept.put(robot.asleep))
        toy.sleep(IntervalOptions.NONE, 0, 0)
        adapter.settle()
        assert slept.get(timeout=10)
        with pytest.raises(TimeoutError):
            toy.get_versions()
        asleep = robot.asleep
        toy.wake()
        assert isinstance(toy.get_versions(), Versions)
    assert (asleep, robot.asleep) == (True, False)
    assert [(run.did, run.cid) for run in ran] == [(0x00, 0x22), (0x00, 0x02)]
    assert adapter.greetings[-1][0] == V1_WAKE_CHARACTERISTIC
    assert [seen for seen in _seen_by_us(adapter.heard) if not seen.answer] == [Seen(False, 0x14, None, b"")]


@pytest.mark.parametrize("key", OVER_BLE)
def test_from_deep_sleep_a_class_wakes_nobody(key: str) -> None:
    robot = _fake(key)
    with session(TOYS[key], robot) as (toy, _):
        toy.sleep(IntervalOptions.DEEP_SLEEP, 0, 0)
        toy.wake()
        with pytest.raises(TimeoutError):
            toy.get_versions()
    assert robot.asleep


@pytest.mark.parametrize("key", OVER_BLE)
def test_a_class_hears_an_idle_robot_doze_off(key: str) -> None:
    robot = _fake(key)
    heard: SimpleQueue[str] = SimpleQueue()
    with session(TOYS[key], robot) as (toy, adapter):
        toy.add_will_sleep_notify_listener(lambda: heard.put("will sleep"))
        toy.add_did_sleep_notify_listener(lambda: heard.put("did sleep"))
        toy.set_inactivity_timeout(120)
        adapter.idle(115)
        assert heard.get(timeout=10) == "will sleep"
        assert not robot.asleep
        adapter.idle(5)
        assert (heard.get(timeout=10), robot.asleep) == ("did sleep", True)
    assert heard.empty()


@pytest.mark.parametrize("key", OVER_BLE)
def test_a_class_works_on_a_slow_and_fragmented_line(key: str) -> None:
    with session(TOYS[key], _fake(key, latency="800ms", split=1)) as (toy, adapter):
        info = toy.get_bluetooth_info()
        assert adapter.now == pytest.approx(0.8)
        assert toy.get_bluetooth_info() == info
        assert adapter.now == pytest.approx(1.6)
    assert set(map(len, adapter.heard)) == {1}
    assert info.name.decode() == _fake(key).name


@pytest.mark.parametrize("key", OVER_BLE)
def test_a_class_renames_the_robot(key: str) -> None:
    robot = _fake(key)
    name = "it has 15 bytes"  # 23 with what is around it: two writes
    with session(TOYS[key], robot) as (toy, _):
        toy.set_bluetooth_name(name.encode())
        info = toy.get_bluetooth_info()
    assert robot.name == name
    assert info == BluetoothInfo(name.encode(), robot.address.replace(":", "").encode())


@pytest.mark.parametrize("key", OVER_BLE)
def test_a_class_loses_its_way_in_a_name_that_fills_its_place(key: str) -> None:
    with session(TOYS[key], _fake(key)) as (toy, _):
        toy.set_bluetooth_name(b"it has 16 bytes!")
        with pytest.raises(ValueError, match="not enough values"):  # spherov2 looks for a NUL behind it
            toy.get_bluetooth_info()


@pytest.mark.parametrize("key", OVER_BLE)
def test_a_class_sets_the_leds(key: str) -> None:
    robot = _fake(key)
    with session(TOYS[key], robot) as (toy, _):
        toy.set_main_led(0x8D, 0xFF, 0xFE)
        toy.set_back_led_brightness(0xAB)
    assert robot.leds == {"main_red": 0x8D, "main_green": 0xFF, "main_blue": 0xFE, "back": 0xAB}


@pytest.mark.parametrize("key", OVER_BLE)
def test_what_spherov2_calls_main_and_back_we_do(key: str) -> None:
    robot = _fake(key)
    with session(TOYS[key], robot) as (toy, _):
        ToyUtil.set_main_led(toy, 1, 2, 3, is_user_color=False)
        ToyUtil.set_back_led_brightness(toy, 4)
    assert robot.leds == {"main_red": 1, "main_green": 2, "main_blue": 3, "back": 4}


@pytest.mark.parametrize("key", OVER_BLE)
def test_a_class_reads_the_colour_that_was_to_be_kept(key: str) -> None:
    robot = _fake(key)
    with session(TOYS[key], robot) as (toy, _):
        _send(toy, 0x02, 0x20, b"\xff\x80\x01\x01")
        toy.set_main_led(9, 9, 9)
        answer = _send(toy, 0x02, 0x22)
    row = known(lookup(Generation.V1, 0x02, 0x22, ROBOTS[key]))
    assert row.response is not None
    decoded = row.response.decode(bytes(answer.data))
    assert (decoded.fields, decoded.problem) == ({"red": 0xFF, "green": 0x80, "blue": 0x01}, "")
    assert robot.leds["main_red"] == 9


@pytest.mark.parametrize("key", OVER_BLE)
def test_a_class_configures_collisions(key: str) -> None:
    ran: list[Executed] = []
    robot = _fake(key, ran)
    with session(TOYS[key], robot) as (toy, _):
        toy.configure_collision_detection(CollisionDetectionMethods.DEFAULT, 100, 101, 102, 103, 10)
        toy.configure_collision_detection(CollisionDetectionMethods.OFF, 0, 0, 0, 0, 0)
    layout = known(lookup(Generation.V1, 0x02, 0x12, ROBOTS[key])).request
    assert layout is not None
    on, off = (layout.decode(run.payload).fields for run in ran)
    assert on == {
        "method": "accelerometer_based_detection",
        "x_threshold": 100,
        "x_speed": 101,  # spherov2 calls it y_threshold
        "y_threshold": 102,
        "y_speed": 103,
        "dead_time": 10,
    }
    assert off["method"] == "no_collision_detection"


@pytest.mark.parametrize("key", OVER_BLE)
def test_a_class_is_told_the_power_state(key: str) -> None:
    told: SimpleQueue[their_core.PowerStates] = SimpleQueue()
    with session(TOYS[key], _fake(key)) as (toy, adapter):
        toy.add_battery_state_changed_notify_listener(told.put)
        toy.enable_battery_state_changed_notify(True)
        adapter.settle()
        state = toy.get_power_state().state
    assert told.get(timeout=10) == state


# Reads, side by side.


def _dotted(number: int) -> str:
    return f"{number >> 4}.{number & 0x0F}"


def _options(fields: Mapping[str, Any]) -> Options:
    """The options in the shape of spherov2, which names those of both commands alike."""
    for name in ("PersistentOptions", "TemporaryOptions"):
        try:
            number = VALUE_NAMES[name].number(fields["options"])
        except ValueError:
            continue
        return Options(*(bool(number >> bit & 1) for bit in PERSISTENT_BITS.values()))
    raise AssertionError(f"{fields} are no options")


READS: dict[str, Callable[[Mapping[str, Any]], object]] = {
    "get_versions": lambda told: Versions(
        told["record_version"],
        told["model"],
        told["hardware"],
        told["main_app_major"],
        told["main_app_minor"],
        *(_dotted(told[name]) for name in ("bootloader", "orbbasic", "overlay")),
    ),
    "get_bluetooth_info": lambda told: BluetoothInfo(told["name"].encode(), told["address"].encode()),
    "get_power_state": lambda told: PowerState(
        told["record_version"],
        their_core.PowerStates[told["state"].upper()],
        told["battery_voltage"],
        told["charges"],
        told["time_since_charge"],
    ),
    "get_factory_config_block_crc": lambda told: told["crc"],
    "get_chassis_id": lambda told: told["chassis_id"],
    "get_temperature": lambda told: told["degrees"] + told["tenths"] / 10,
    "get_persistent_options": _options,
    "get_temporary_options": _options,
    "get_sku": lambda told: list(reversed(bytes.fromhex(told["sku"]))),
}
"""Read -> our reading of its answer in the shape that spherov2 gives back."""
MISREAD = {"get_charger_state": "spherov2 numbers the contacts out, in, unknown; the maker unknown, out, in"}
"""Reads of which spherov2 makes something else than the maker's table says."""
EVERY_READ = [
    pytest.param(key, method, id=f"{key} {method}")
    for key in ("bb8", "ollie", "sprk-plus")
    for method in _commands(key)
    if _row(key, _builds(key, method)[0]).risk is Risk.READ and method not in MISREAD | NEVER_SENT
]


def test_every_read_is_found() -> None:
    assert {param.values[1] for param in EVERY_READ} == READS.keys()
    assert len(EVERY_READ) == 26


@rows(EVERY_READ)
def test_spherov2_reads_what_we_read(key: str, method: str) -> None:
    (build,) = _builds(key, method)
    ran: list[Executed] = []
    with session(TOYS[key], _fake(key, ran)) as (toy, _):
        theirs: Any = _commands(key)[method](toy)
    assert [(run.did, run.cid) for run in ran] == [(build.packet.did, build.packet.cid)]
    ours = READS[method](_told(key, build.packet.did, build.packet.cid))
    assert (list(theirs) if method == "get_sku" else theirs) == ours


@pytest.mark.parametrize("key", OVER_BLE)
def test_spherov2_and_the_maker_number_the_charger_otherwise(key: str) -> None:
    with session(TOYS[key], _fake(key)) as (toy, _):
        theirs = toy.get_charger_state()
    words = VALUE_NAMES["ChargerContacts"]
    assert words.number(_told(key, 0x00, 0x26)["state"]) == theirs
    assert {number: name.split("_")[0] for number, name in words.names.items()} != {
        one.value: one.name.lower() for one in their_core.ChargerStates
    }


# Sensor streams.


class Streamed(NamedTuple):
    """A stream as spherov2 and we decode it; spherov2 delivers in any order, from one thread per packet."""

    payloads: list[bytes]
    numbers: list[list[int]]
    samples: list[dict[str, dict[str, float]]]
    ours: list[dict[str, object]]
    masks: Masks


ALL_SENSORS = (*Sphero.sensors, *Sphero.extended_sensors)


def _streamed(key: str, *sensors: str, **settings: object) -> Streamed:
    ran: list[Executed] = []
    robot = _fake(key, ran, **settings)
    numbers: SimpleQueue[list[int]] = SimpleQueue()
    samples: SimpleQueue[dict[str, dict[str, float]]] = SimpleQueue()
    with session(TOYS[key], robot) as (toy, adapter):
        toy.sensor_control.add_sensor_data_listener(samples.put)
        toy.add_sensor_streaming_data_notify_listener(lambda values: numbers.put([*values]))
        toy.sensor_control.set_interval(100)
        toy.sensor_control.set_count(3)
        toy.sensor_control.enable(*sensors)
        adapter.settle()
    _, _, mask, _, extended = struct.unpack(">HHIBI", ran[-1].payload)
    masks = Masks(mask, extended)
    payloads = [seen.data for seen in _seen_by_us(adapter.heard) if not seen.answer]
    decoded = [streaming_fields(Generation.V1, masks, payload) for payload in payloads]
    assert not any(one.problem or one.rest for one in decoded)
    return Streamed(
        payloads,
        [numbers.get() for _ in range(numbers.qsize())],
        [samples.get() for _ in range(samples.qsize())],
        [one.fields for one in decoded],
        masks,
    )


def _in_their_words(key: str, ours: Mapping[str, Any]) -> dict[str, dict[str, float]]:
    """Our sample in the shape of spherov2: per sensor, its parts; an Ollie's axes turned.

    spherov2 leaves ``accel_one`` in thousandths, and has the motors of bits 6 and 5 the other way round than
    the maker.
    """
    sample: dict[str, dict[str, float]] = {}
    toy = TOYS[key]
    for sensor, parts in (toy.sensors | toy.extended_sensors).items():
        values = {
            part: ours[name]
            for part in parts
            for name in (f"{sensor}_{part}", part)
            if name in ours and (name == part) == (sensor in ("attitude", "accel_one", "speed"))
        }
        if key == "ollie" and sensor in ("locator", "velocity") and values:
            values = {"x": -values["y"], "y": values["x"]}
        if sensor == "back_emf" and values:
            values = {"left": values["right"], "right": values["left"]}
        if sensor == "accel_one" and values:
            values = {"accel_one": values["accel_one"] * 1000}
        if values:
            sample[sensor] = values
    return sample


def _flat(sample: dict[str, dict[str, float]]) -> list[tuple[str, str, float]]:
    return [
        (sensor, part, round(value, 6)) for sensor, parts in sample.items() for part, value in parts.items()
    ]


@pytest.mark.parametrize(
    "settings", [{}, {"split": 1}, {"latency": "30ms", "split": 7}], ids=["20", "1", "7"]
)
@pytest.mark.parametrize(
    "sensors",
    [
        pytest.param(("attitude",), id="attitude"),
        pytest.param(("accelerometer", "gyroscope"), id="inertia"),
        pytest.param(("back_emf", "speed"), id="motors"),
        pytest.param(("locator", "velocity"), id="place"),
        pytest.param(ALL_SENSORS, id="all"),
    ],
)
@pytest.mark.parametrize("key", OVER_BLE)
def test_a_stream_reads_alike(key: str, sensors: tuple[str, ...], settings: dict[str, Any]) -> None:
    streamed = _streamed(key, *sensors, **settings)
    assert len(streamed.ours) == len(streamed.numbers) == len(streamed.samples) == 3
    ours = sorted(_flat(_in_their_words(key, fields)) for fields in streamed.ours)
    theirs = sorted(map(_flat, streamed.samples))
    assert {sensor for sample in theirs for sensor, _, _ in sample} == set(sensors)
    assert theirs == ours


@pytest.mark.parametrize("key", OVER_BLE)
def test_the_numbers_of_a_stream_lie_in_our_order(key: str) -> None:
    streamed = _streamed(key, *ALL_SENSORS)
    row = known(notification_row(Generation.V1, None, 0x03, ROBOTS[key]))
    assert row.response is not None
    read: list[Any] = [row.response.decode(payload).fields["values"] for payload in streamed.payloads]
    assert sorted(streamed.numbers) == sorted(read)
    width = streamed.masks.mask.bit_count() + streamed.masks.extended.bit_count()
    assert {len(numbers) for numbers in streamed.numbers} == {width}
    assert width == sum(map(len, (Sphero.sensors | Sphero.extended_sensors).values()))
    assert {len(fields) for fields in streamed.ours} == {width}


# What spherov2 and we make of the same frames.


class Seen(NamedTuple):
    """The contents of a robot's frame, independent of the decoder: the code of a response, else the id."""

    answer: bool
    code: int
    seq: int | None
    data: bytes


def _theirs(chunks: Iterable[bytes]) -> list[TheirPacket.Response | TheirPacket.Async]:
    """What spherov2 makes of chunks as they come from a robot."""
    packets: list[TheirPacket.Response | TheirPacket.Async] = []
    collector = TheirPacket.Collector(packets.append)
    for chunk in chunks:
        collector.add(bytearray(chunk))
    return packets


def _seen_by_them(chunks: Iterable[bytes]) -> list[Seen]:
    return [
        Seen(True, int(one.mrsp), one.seq, bytes(one.data))
        if isinstance(one, TheirPacket.Response)
        else Seen(False, one.id_code, None, bytes(one.data))
        for one in _theirs(chunks)
    ]


def _seen_by_us(chunks: Iterable[bytes], noise: list[bytes] | None = None) -> list[Seen]:
    decoder = V1.decoder(Role.HOST)
    seen = []
    for packet in (packet for chunk in chunks for packet in decoder.feed(chunk)):
        match packet:
            case Response(seq, code, payload, None, None, None, None):
                seen.append(Seen(True, code, seq, payload))
            case Notification(None, cid, payload, None, None, None):
                seen.append(Seen(False, cid, None, payload))
            case Malformed(raw) if noise is not None:
                noise.append(raw)
            case other:
                pytest.fail(f"a fake robot said {other}")
    assert not decoder.give_up()
    return seen


STREAM = struct.pack(">HHIBI", 20, 2, 0x0007E000, 3, 0xF0000000)
"""Every 100 ms, three times, two frames: attitude, acceleration and the quaternion."""


def _conversation(key: str) -> Iterator[tuple[Command, int]]:
    """Every documented read, with sequence numbers that look like starts; then errors, then news."""
    number = 0
    for row in commands_of(ROBOTS[key]):
        if row.kind is Kind.COMMAND and row.risk is Risk.READ:
            payload = (row.request.zeros() if row.request else b"") if row.sample is None else row.sample
            number += 1
            for seq in (number, 0x00, 0xFE, 0xFF):
                yield Command(row.did, row.cid, payload), seq
    yield Command(0x77, 0x00), 5  # no such device
    yield Command(0x00, 0xEE), 6  # no such command
    yield Command(0x00, 0x02, b"?"), 7  # no such length
    yield Command(0x00, 0x25, b"\0\1"), 8  # no such value
    yield Command(0x00, 0x42), 9  # it fails
    yield Command(0x02, 0x20, b"\xff\xfe\xff"), 10
    yield Command(0x00, 0x21, b"\1"), 11
    yield Command(0x00, 0x40), 12
    yield Command(0x02, 0x09, b"\1\0\0\0"), 13
    yield Command(0x02, 0x40, b"\0"), 14
    yield Command(0x02, 0x11, STREAM), 15
    yield Command(0x00, 0x22, bytes(5)), 16


def _say(robot: FakeRobot, conversation: Iterable[tuple[Command, int]]) -> list[bytes]:
    """What a robot says to commands, each heard when all is said to the one before."""
    now, chunks = 0.0, []
    for command, seq in conversation:
        robot.hear(V1.encode_command(command, seq), now=now)
        until = now + 60
        while (due := robot.next_time()) is not None and due <= until:
            now = max(now, due)
            chunks += robot.speak(now=now)
    return chunks


@pytest.mark.parametrize(
    "settings", [{}, {"split": 1}, {"split": 7, "latency": "15ms"}], ids=["whole", "1", "7"]
)
@pytest.mark.parametrize("key", EACH_TOY)
def test_spherov2_parses_the_fake_robot_as_we_do(key: str, settings: dict[str, Any]) -> None:
    conversation = list(_conversation(key))
    assert len(conversation) > 70
    chunks = _say(_fake(key, **settings), conversation)
    ours, theirs = _seen_by_us(chunks), _seen_by_them(chunks)
    assert theirs == ours
    assert [seen.seq for seen in ours if seen.answer] == [seq for _, seq in conversation]
    assert {seen.code for seen in ours if not seen.answer} >= {0x01, 0x02, 0x03, 0x04, 0x0B, 0x14}
    assert {seen.code for seen in ours if seen.answer} == {0x00, 0x04, 0x06, 0x07, 0x08, 0x09}
    (*_, stream) = [seen for seen in ours if (seen.answer, seen.code) == (False, 0x03)]
    assert len(stream.data) == 2 * 2 * 10
    assert max(len(seen.data) for seen in ours) == (0x440 if key == "sphero" else 254)


@pytest.mark.parametrize("split", [1, 20])
@pytest.mark.parametrize("key", OVER_BLE)
def test_spherov2_and_we_pass_over_the_prompt(key: str, split: int) -> None:
    jumps = [(Command(0x00, 0x30), 1), (Command(0x01, 0x04), 2), (Command(0x00, 0x01), 3)]
    chunks = _say(_fake(key, split=split), jumps)
    noise: list[bytes] = []
    ours = _seen_by_us(chunks, noise)
    assert b"".join(noise) == b"u>u>"
    assert ours == _seen_by_them(chunks) == [Seen(True, 0, seq, b"") for seq in (1, 2, 3)]


UNKNOWN_TO_SPHEROV2 = {0x0A: "memory busy", 0x0B: "bad password"}
"""Codes of the maker's table that spherov2 does not have: it gives up on the stream."""


def test_spherov2_names_its_codes_as_we_do() -> None:
    codes = {code for code in range(0x100) if V1.verdict(code) is not Verdict.UNLISTED}
    assert codes == {*TheirPacket.Error} | UNKNOWN_TO_SPHEROV2.keys()
    assert {code: V1.code_name(code) for code in UNKNOWN_TO_SPHEROV2} == UNKNOWN_TO_SPHEROV2
    assert len(codes) == 17


@pytest.mark.parametrize("code", UNKNOWN_TO_SPHEROV2)
def test_codes_that_spherov2_does_not_know_it_still_does_not(code: int) -> None:
    frame = V1.encode_response(Response(1, code))
    with pytest.raises(ValueError, match=str(code)):
        _theirs([frame])
    assert _seen_by_us([frame]) == [Seen(True, code, 1, b"")]


BYTE = st.integers(0, 0xFF)
MEAN = st.sampled_from((0xFF, 0xFE, 0x00, 0x01, 0x06, 0x03))
DATA = st.binary(max_size=64) | st.lists(MEAN, max_size=64).map(bytes) | st.binary(min_size=254, max_size=254)
ANSWERS = st.builds(Response, BYTE | MEAN, st.sampled_from([*TheirPacket.Error]).map(int), DATA)
NEWS = st.builds(Notification, st.none(), BYTE | MEAN, DATA | st.binary(min_size=250, max_size=600))


def _frame(packet: Said) -> bytes:
    return V1.encode_response(packet) if isinstance(packet, Response) else V1.encode_notification(packet)


@given(BYTE, BYTE, BYTE | MEAN, DATA)
def test_any_command_of_spherov2_decodes(did: int, cid: int, seq: int, data: bytes) -> None:
    frame = bytes(TheirPacket.Request(did, cid, seq, bytearray(data)).build())
    decoder = V1.decoder(Role.ROBOT)
    packets = decoder.feed(frame)
    if (did, cid) == (0x02, 0x47) and len(data) == 254:  # 255 stands for 1029 here
        assert not packets
        return
    (packet,) = packets
    assert packet == Request(Command(did, cid, data), seq, flags=0xFF)
    assert V1.encode_command(packet.command, seq) == V1.frame_of(packet) == frame


@given(ANSWERS | NEWS)
def test_any_frame_of_ours_is_one_of_theirs(packet: Said) -> None:
    frame = _frame(packet)
    (their,) = _theirs([frame])
    assert bytes(their.build()) == frame
    (ours,) = V1.decoder(Role.HOST).feed(frame)
    assert V1.frame_of(ours) == frame


@given(st.lists(ANSWERS | NEWS, max_size=5), st.lists(st.integers(0, 1500), max_size=8))
def test_any_conversation_in_any_cut_reads_alike(packets: list[Said], cuts: list[int]) -> None:
    stream = b"".join(map(_frame, packets))
    ends = sorted({0, len(stream), *(cut for cut in cuts if cut < len(stream))})
    chunks = [stream[start:end] for start, end in pairwise(ends)]
    ours = _seen_by_us(chunks)
    assert _seen_by_them(chunks) == ours
    assert ours == [
        Seen(True, packet.code, packet.seq, packet.payload)
        if isinstance(packet, Response)
        else Seen(False, packet.cid, None, packet.payload)
        for packet in packets
    ]


def test_spherov2_counts_as_far_as_we_do() -> None:
    manager = TheirPacket.Manager()
    turns = [manager.new_packet(0x00, 0x01, None).seq for _ in range(2 * len(V1.sequence_numbers))]
    assert turns == [*V1.sequence_numbers, *V1.sequence_numbers]
