"""RVR's streaming services: configurations and delivered values."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue import rows_of
from sphero_probe.catalogue.streaming_services import (
    BITS,
    CLEAR,
    CONFIGURE,
    DELIVER,
    SERVICES,
    START,
    STOP,
    Channel,
    Configurations,
    Slot,
    configuration,
    configured_after,
    delivered_fields,
    raw_of,
    value_of,
)
from sphero_probe.protocol.packets import Command, Generation, Notification, Request, Role
from sphero_probe.protocol.v2 import V2

SDK_SERVICES = {
    0x00: ("quaternion", {2}, [(-1, 1)] * 4),
    0x01: ("imu", {2}, [(-180, 180), (-90, 90), (-180, 180)]),
    0x02: ("accelerometer", {2}, [(-16, 16)] * 3),
    0x03: ("color_detection", {1}, [(0, 255)] * 4 + [(0, 1)]),
    0x04: ("gyroscope", {2}, [(-2000, 2000)] * 3),
    0x06: ("locator", {2}, [(-16000, 16000)] * 2),
    0x07: ("velocity", {2}, [(-5, 5)] * 2),
    0x08: ("speed", {2}, [(0, 5)]),
    0x09: ("core_time", {1, 2}, [(0, 2**32 - 1)] * 2),
    0x0A: ("ambient_light", {1}, [(0, 120_000)]),
    0x0B: ("encoders", {2}, [(0, 2**32 - 1)] * 2),
}
"""Id -> name, nodes, and the range of every value: sensor_streaming_control.py of the maker's Python SDK."""


def test_the_services_are_those_of_the_makers_sdk() -> None:
    ours = {
        number: (
            service.name,
            set(service.nodes),
            [(channel.minimum, channel.maximum) for channel in service.channels],
        )
        for number, service in SERVICES.items()
    }
    assert ours == SDK_SERVICES
    names = [channel.name for service in SERVICES.values() for channel in service.channels]
    assert len(set(names)) == len(names)


def test_the_pairs_are_rows_of_the_catalogue() -> None:
    names = {pair: rows_of(Generation.V2, *pair)[0].name for pair in (CONFIGURE, START, STOP, CLEAR, DELIVER)}
    assert names == {
        CONFIGURE: "sensor.configure_streaming_service",
        START: "sensor.start_streaming_service",
        STOP: "sensor.stop_streaming_service",
        CLEAR: "sensor.clear_streaming_service",
        DELIVER: "sensor.streaming_service_data_notify",
    }


def test_the_published_example_reads_as_the_sdk_logged_it() -> None:
    """Frames and logged values of the maker's Python SDK."""
    asked, delivered = V2.decoder(Role.OBSERVER).feed(
        bytes.fromhex("8d1802183902010001028ed8 8d2802183dff018655d300814c13008794eb00ecd8")
    )
    assert isinstance(asked, Request)
    assert isinstance(delivered, Notification)
    configured = configured_after({}, asked.command)
    assert configured == {(2, 1): (Slot(SERVICES[1], 32),)}
    decoded = delivered_fields(configured, delivered.payload, delivered.source)
    assert decoded is not None
    assert {name: round(value, 3) for name, value in decoded.fields.items() if isinstance(value, float)} == {
        "pitch": 8.909,
        "roll": 0.912,
        "yaw": 10.662,
    }
    assert decoded.units == dict.fromkeys(("pitch", "roll", "yaw"), "deg")


@pytest.mark.parametrize(
    ("payload", "node", "problem"),
    [
        pytest.param("01 0001 02", 2, "", id="one"),
        pytest.param("01 0000 02 0001 01 0002 00 0004 02", 2, "", id="several sizes"),
        pytest.param("03 0009 02", 1, "", id="the clock of either node"),
        pytest.param("02 000a 02", None, "", id="any node"),
        pytest.param("02 000a 01", None, "", id="any size, where only the form counts"),
        pytest.param("", 2, "token 0 is not in 1-4", id="nothing"),
        pytest.param("00 0001 02", 2, "token 0 is not in 1-4", id="token 0"),
        pytest.param("05 0001 02", 2, "token 5 is not in 1-4", id="token 5"),
        pytest.param("01", 2, "0 bytes are not 1-5 services of 3 bytes", id="no service"),
        pytest.param("01 0001", 2, "2 bytes are not 1-5 services of 3 bytes", id="cut off"),
        pytest.param(
            "01" + "0000020001020002020004020006020007 02",
            2,
            "18 bytes are not 1-5 services of 3 bytes",
            id="six",
        ),
        pytest.param("01 0005 02", 2, "service 0x0005 in size 2 is not known", id="unknown service"),
        pytest.param("01 0001 03", 2, "service 0x0001 in size 3 is not known", id="unknown size"),
        pytest.param("01 0001 02", 1, "node 1 does not have imu", id="wrong node"),
        pytest.param("01 0001 02 0001 01", 2, "a service is named twice", id="twice"),
        pytest.param(
            "03 000a 01", 1, "ambient_light in 16 bits was rejected by a real robot", id="RVR 8.3.432, real"
        ),
    ],
)
def test_configuration(payload: str, node: int | None, problem: str) -> None:
    asked = configuration(bytes.fromhex(payload), node)
    assert asked.problem == problem
    assert bool(asked.slots) is not bool(problem)


def configure(node: int | None, payload: str) -> Command:
    return Command(*CONFIGURE, bytes.fromhex(payload), node)


def test_what_is_configured_is_kept_per_node_and_token() -> None:
    configured: Configurations = {}
    for command in (
        configure(0x02, "01 0001 02"),
        configure(0x12, "02 0008 01"),
        configure(0x01, "01 0003 00"),
        Command(0x18, 0x38, b"\1", 0x02),
        Command(*START, b"\0\x64", 0x02),
    ):
        configured = configured_after(configured, command)
    assert {key: [slot.service.name for slot in slots] for key, slots in configured.items()} == {
        (2, 1): ["imu"],
        (2, 2): ["speed"],
        (1, 1): ["color_detection"],
    }
    speed = delivered_fields(configured, b"\x02\xff\xff", 0x12)
    assert speed is not None
    assert speed.fields == {"token": 2, "speed": 5.0}
    colour = delivered_fields(configured, b"\x11\x01\x02\xff\x04\xff", 0x01)
    assert colour is not None
    assert colour.fields == {
        "token": 1,
        "valid": False,
        "red": 1,
        "green": 2,
        "blue": 255,
        "color_index": 4,
        "color_confidence": 1.0,
    }
    assert configured_after(configured, Command(*CLEAR, b"", 0x02)).keys() == {(1, 1)}
    assert configured_after(configured, Command(*CLEAR)) == {}
    assert configured_after(configured, configure(0x02, "01 0001"))[2, 1] == ()


@pytest.mark.parametrize(
    ("payload", "source"),
    [
        pytest.param("", 2, id="nothing"),
        pytest.param("01 ffff", 2, id="too short"),
        pytest.param("01 ffffffff ffffffff ffffffff ff", 2, id="too long"),
        pytest.param("02 ffff", 2, id="another token"),
        pytest.param("01 ffffffff ffffffff ffffffff", 1, id="another node"),
        pytest.param("01 ffffffff ffffffff ffffffff", None, id="any of two nodes"),
    ],
)
def test_values_without_a_configuration_have_no_names(payload: str, source: int | None) -> None:
    configured = configured_after({}, configure(2, "01 0001 02"))
    configured = configured_after(configured, configure(1, "01 0003 00"))
    assert delivered_fields(configured, bytes.fromhex(payload), source) is None


def test_a_delivery_without_a_source_is_decoded_if_only_one_node_has_the_token() -> None:
    configured = configured_after({}, configure(2, "01 0008 00"))
    decoded = delivered_fields(configured, b"\1\0", None)
    assert decoded is not None
    assert decoded.fields == {"token": 1, "speed": 0.0}
    unaddressed = configured_after({}, configure(None, "01 0008 00"))
    assert delivered_fields(unaddressed, b"\1\0", 2) == decoded


CHANNELS = [
    pytest.param(channel, id=channel.name) for service in SERVICES.values() for channel in service.channels
]


@pytest.mark.parametrize("bits", BITS.values())
@pytest.mark.parametrize("channel", CHANNELS)
def test_a_value_is_a_fraction_of_its_range_and_back(channel: Channel, bits: int) -> None:
    largest = (1 << bits) - 1
    assert value_of(channel, 0, bits) == channel.minimum
    assert value_of(channel, largest, bits) == channel.maximum
    step = (channel.maximum - channel.minimum) / largest
    for raw in {0, 1, largest // 3, largest // 2, largest - 1, largest}:
        rounding = (0.5 if channel.whole else 1e-6) / step
        assert raw_of(channel, value_of(channel, raw, bits), bits) == pytest.approx(raw, abs=1 + rounding)
    assert raw_of(channel, channel.maximum + 1, bits) == largest
    assert raw_of(channel, channel.minimum - 1, bits) == 0


@given(st.binary(max_size=30), st.binary(max_size=60), st.sampled_from([None, 0, 1, 2, 0x12, 0xFF]))
def test_any_bytes_give_plain_json_or_nothing(configured: bytes, delivered: bytes, node: int | None) -> None:
    command = Command(*CONFIGURE, configured, node)
    decoded = delivered_fields(configured_after({}, command), delivered, node)
    if decoded is not None:
        json.dumps(decoded.fields, allow_nan=False)
