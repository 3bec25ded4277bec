"""The catalogue, compared row by row with the tables of others; each difference has a reason."""

import ast
import inspect
from collections.abc import Iterator
from enum import IntEnum, IntFlag
from pathlib import Path
from types import ModuleType
from typing import Final, NamedTuple

import pytest
import spherov2.commands.animatronic
import spherov2.commands.api_and_shell
import spherov2.commands.async_
import spherov2.commands.bootloader
import spherov2.commands.connection
import spherov2.commands.core
import spherov2.commands.drive
import spherov2.commands.factory_test
import spherov2.commands.firmware
import spherov2.commands.io
import spherov2.commands.power
import spherov2.commands.sensor
import spherov2.commands.sphero
import spherov2.commands.system_info
import spherov2.commands.system_mode
from spherov2.toy import Toy
from spherov2.toy.bb9e import BB9E
from spherov2.toy.bolt import BOLT
from spherov2.toy.mini import Mini
from spherov2.toy.r2d2 import R2D2
from spherov2.toy.sphero import Sphero

from sphero_probe.catalogue import ROBOTS, rows_of
from sphero_probe.catalogue.model import NO_DEVICE, CommandRow, Kind
from sphero_probe.catalogue.payload.enums import VALUE_NAMES
from sphero_probe.catalogue.payload.layout import Layout
from sphero_probe.catalogue.sensors import sensors_of
from sphero_probe.protocol.packets import Generation

V1, V2 = Generation.V1, Generation.V2

# The maker's Python SDK for RVR.

SDK_TYPES: Final = {
    "uint8_t": "u8",
    "uint16_t": "u16",
    "uint32_t": "u32",
    "uint64_t": "u64",
    "int8_t": "i8",
    "int16_t": "i16",
    "int32_t": "i32",
    "float": "f32",
    "bool": "bool",
    "std::string": "cstring",
}
SDK_DIFFERENCES: Final = {
    (0x10, 0x00): "the SDK always sends 16 bytes; robots echo any number up to that",
    (0x18, 0x22): "the SDK masks one u32; here it is the four bytes that its masks pick",
    (0x18, 0x39): "the SDK's 15 is the most it can hold; it sends three bytes per service",
    (0x18, 0x3D): "the SDK reads 9999 bytes at most; here all that are there",
    (0x1A, 0x1A): "the SDK's 32 is the most; a value per bit of the mask is sent",
    (0x1A, 0x44): "the SDK's 48 is the palette of today; here all that is there",
    (0x1A, 0x45): "the SDK's 48 is the palette of today; here all that is there",
    (0x1A, 0x46): "the SDK's 24 is the palette of today; here all that is there",
}
"""Pairs whose layouts differ from those of the SDK, and why."""


class SdkCommand(NamedTuple):
    pair: tuple[int, int]
    name: str
    inputs: list[str]
    outputs: list[str]


def sdk_commands() -> Iterator[SdkCommand]:
    file = Path(__file__).parents[1] / "data" / "sdk_rvr.txt"
    for line in file.read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            did, cid, name, inputs, outputs = line.split()
            yield SdkCommand((int(did, 16), int(cid, 16)), name, _types(inputs), _types(outputs))


def _types(text: str) -> list[str]:
    """``a:uint8_t,b:int32_t*2`` as ``["u8", "i32*2"]``."""
    words = []
    for word in text.split(",") if text != "-" else ():
        kind, star, count = word.partition(":")[2].partition("*")
        words.append(SDK_TYPES[kind] + star + count)
    return words


def _shape(layout: Layout | None) -> list[str] | None:
    if layout is None:
        return None
    return [field.type + (f"*{field.count}" if field.count else "") for field in layout.fields]


SDK: Final = list(sdk_commands())


@pytest.mark.parametrize("command", SDK, ids=lambda command: command.name)
def test_the_catalogue_has_what_the_makers_sdk_has(command: SdkCommand) -> None:
    (row,) = [row for row in rows_of(V2, *command.pair) if "rvr" in row.nodes]
    assert "sdk" in row.sources
    plain = command.name.removeprefix("on_") if row.kind is Kind.NOTIFICATION else command.name
    assert {command.name, plain} & {row.name.partition(".")[2], *row.aliases}
    same = _shape(row.response) == command.outputs and (
        row.kind is Kind.NOTIFICATION or _shape(row.request) == command.inputs
    )
    assert same is (command.pair not in SDK_DIFFERENCES), SDK_DIFFERENCES.get(command.pair)


def test_every_difference_from_the_sdk_is_one_of_its_commands() -> None:
    assert len(SDK) == 93
    assert SDK_DIFFERENCES.keys() <= {command.pair for command in SDK}


def test_a_command_of_one_node_in_the_sdk_is_on_that_node() -> None:
    """sphero_rvr_async.py calls it with target=1."""
    (row,) = rows_of(V2, 0x18, 0x54)
    assert row.nodes["rvr"] == row.nodes["rvr-plus"] == (1,)


# spherov2 0.12.1.

MODULES: Final[tuple[ModuleType, ...]] = (
    spherov2.commands.animatronic,
    spherov2.commands.api_and_shell,
    spherov2.commands.bootloader,
    spherov2.commands.connection,
    spherov2.commands.core,
    spherov2.commands.drive,
    spherov2.commands.factory_test,
    spherov2.commands.firmware,
    spherov2.commands.io,
    spherov2.commands.power,
    spherov2.commands.sensor,
    spherov2.commands.sphero,
    spherov2.commands.system_info,
    spherov2.commands.system_mode,
)
V1_DEVICES: Final = {0x00, 0x01, 0x02}
V1_MODULES: Final = (spherov2.commands.core, spherov2.commands.sphero, spherov2.commands.bootloader)
"""Enums that share names with those of V2 but differ in meaning; ours have other names, from the maker."""


class TheirCommand(NamedTuple):
    generation: Generation
    pair: tuple[int, int]
    name: str
    is_notification: bool


def their_commands() -> Iterator[TheirCommand]:
    """Read names and ids from the source: ``_encode(toy, CID, …)`` in a method, ``((DID, CID, 0xff), …)``.

    One method forgets the toy, two call an ``__encode`` that is not there: they cannot be run.
    """
    for module in MODULES:
        for node in ast.walk(ast.parse(inspect.getsource(module))):
            if isinstance(node, ast.ClassDef):
                yield from _of_class(node)


def _numbers(nodes: list[ast.expr]) -> list[int]:
    values = [node.value for node in nodes if isinstance(node, ast.Constant)]
    return [value for value in values if isinstance(value, int)]


def _of_class(node: ast.ClassDef) -> Iterator[TheirCommand]:
    did = next(
        (
            ast.literal_eval(statement.value)
            for statement in node.body
            if isinstance(statement, ast.Assign) and ast.unparse(statement.targets[0]) == "_did"
        ),
        None,
    )
    if did is None:
        return
    generation = V1 if did in V1_DEVICES else V2
    for statement in node.body:
        match statement:
            case ast.FunctionDef(name=name):
                for call in ast.walk(statement):
                    if isinstance(call, ast.Call) and ast.unparse(call.func).endswith("_encode"):
                        numbers = _numbers(call.args[:2])
                        yield TheirCommand(generation, (did, numbers[0]), name, is_notification=False)
            case ast.Assign(targets=[ast.Name(id=name)], value=ast.Tuple(elts=elements)):
                ids = elements[0].elts if isinstance(elements[0], ast.Tuple) else elements
                numbers = _numbers(ids)
                if len(numbers) == len(ids):
                    yield TheirCommand(generation, (numbers[0], numbers[1]), name, is_notification=True)


THEIRS: Final = list(their_commands())


@pytest.mark.parametrize("command", THEIRS, ids=lambda command: f"{command.generation} {command.name}")
def test_the_catalogue_has_what_spherov2_has(command: TheirCommand) -> None:
    rows: tuple[CommandRow, ...] = rows_of(command.generation, *command.pair)
    names = {name for row in rows for name in (row.name.partition(".")[2], *row.aliases)}
    assert command.name in names
    assert any("spherov2" in row.sources for row in rows)
    kinds = {row.kind for row in rows if command.name in (row.name.partition(".")[2], *row.aliases)}
    assert kinds == {Kind.NOTIFICATION if command.is_notification else Kind.COMMAND}


def test_as_many_commands_of_spherov2_as_were_surveyed() -> None:
    pairs = {(command.generation, *command.pair) for command in THEIRS}
    assert (
        len({pair for pair in pairs if pair[0] is V2}) == 206 - 1
    )  # 10/03 lacks the brackets around its ids
    assert len({pair for pair in pairs if pair[0] is V1}) == 34


OTHER_ENUMS: Final = {"DeviceModes": "ours are those of V1, as the maker describes them; theirs are of 0x11"}
"""Enums that share only their name, and why."""


def test_the_named_values_of_spherov2_are_ours() -> None:
    """Every enum that shares its name with one of ours has the same numbers."""
    compared = 0
    for module in MODULES:
        if module in V1_MODULES:
            continue
        for name, enum in inspect.getmembers(module, inspect.isclass):
            if not issubclass(enum, IntEnum | IntFlag) or enum.__module__ != module.__name__:
                continue
            if name in VALUE_NAMES and name not in OTHER_ENUMS:
                theirs = {int(value) for value in enum.__members__.values()}
                if VALUE_NAMES[name].flags:
                    theirs -= {0}
                assert VALUE_NAMES[name].names.keys() == theirs, name
                compared += 1
    assert compared > 15


def test_the_sos_messages_are_numbered_as_the_makers_sdk_and_spherov2_number_them() -> None:
    """SosMessagesEnum of the SDK's commits 315b48b to 031a216, SosMessages of spherov2."""
    theirs = spherov2.commands.system_info.SosMessages
    assert {int(value): word.lower() for word, value in theirs.__members__.items()} == {
        0: "unknown",
        1: "subprocessor_crashed",
    }
    assert VALUE_NAMES["SosMessages"].names == {0: "unknown", 1: "subprocessor_crashed"}


# Sensor masks of spherov2.

SENSOR_NAMES: Final = {"r2_head_angle": "head_angle"}
SWAPPED: Final = {"back_emf_left": "back_emf_right", "back_emf_right": "back_emf_left"}
"""spherov2 has the motors of V1 swapped; the catalogue follows the maker's tables, and gobot agrees."""


@pytest.mark.parametrize(
    ("key", "toy"), [("bolt", BOLT), ("mini", Mini), ("r2d2", R2D2), ("bb9e", BB9E), ("sphero", Sphero)]
)
def test_every_sensor_bit_of_spherov2_is_ours(key: str, toy: type[Toy]) -> None:
    robot = ROBOTS[key]
    ours = {
        (sensor.extended, 1 << sensor.bit): sensor.field.partition(":")[0]
        for sensor in sensors_of(robot.generation, robot)
    }
    for extended, groups in ((False, toy.sensors), (True, toy.extended_sensors)):
        for group, parts in groups.items():
            for part, sensor in parts.items():
                name = part if group in (part, "attitude") else f"{group}_{part}"
                name = SENSOR_NAMES.get(name, name)
                assert ours[extended, sensor.bit] == SWAPPED.get(name, name)


def test_messages_of_spherov2_are_ours() -> None:
    source = ast.parse(inspect.getsource(spherov2.commands.async_))
    ids = {
        ast.literal_eval(node.value.elts[0])[1]: ast.unparse(node.targets[0])
        for node in ast.walk(source)
        if isinstance(node, ast.Assign)
        and isinstance(node.value, ast.Tuple)
        and isinstance(node.value.elts[0], ast.Tuple)
    }
    assert ids
    for number, name in ids.items():
        (row,) = rows_of(V1, NO_DEVICE, number)
        assert row.name == f"async.{name}"
