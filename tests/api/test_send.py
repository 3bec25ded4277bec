"""Sending one command: arguments, answers and errors; the API blocks what the command line blocks."""

import copy
import pickle
from collections.abc import Awaitable, Callable
from contextlib import nullcontext
from typing import TypeVar

import pytest

from sphero_probe import Command, ConnectedRobot, Consent, Outcome, connect
from sphero_probe.api.answer import Answer
from sphero_probe.errors import (
    CommandSilentError,
    LinkLostError,
    NoAnswerError,
    RefusedByPolicyError,
    RobotRefusedError,
    SpheroProbeError,
    UsageError,
)
from tests.support.cli import Cli
from tests.support.virtual_clock import run

T = TypeVar("T")


def with_robot(
    device: str, use: Callable[[ConnectedRobot], Awaitable[T]], consent: Consent | list[str] | None = None
) -> T:
    """Connect on a virtual clock, use the robot, return the result; no task may be left behind."""

    async def work() -> T:
        async with connect(device, consent=consent or []) as robot:
            return await use(robot)

    result: T = run(work())
    return result


def sent(device: str, *words: object, **options: object) -> Answer:
    return with_robot(device, lambda robot: robot.send(*words, **options))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "words",
    [
        pytest.param(("power.get_battery_percentage",), id="name"),
        pytest.param(("get-battery-percentage",), id="short name"),
        pytest.param(("0x13:0x10",), id="pair"),
        pytest.param((0x13, 0x10), id="numbers"),
        pytest.param((0x13, 0x10, b""), id="empty payload"),
        pytest.param((Command(0x13, 0x10),), id="command"),
        pytest.param((Command(0x13, 0x10, target=0x11),), id="command with node"),
    ],
)
def test_a_command_can_be_written_in_several_ways(words: tuple[object, ...]) -> None:
    answer = sent("fake:bolt-plus", *words)
    assert answer.ok
    assert (answer.name, answer.outcome) == ("power.get_battery_percentage", Outcome.EXISTS)
    assert (answer.code, answer.code_name, answer.payload) == (0, "success", b"\x31")
    assert answer.percentage == answer["percentage"] == 49
    assert answer.units == {"percentage": "%"}
    assert answer.command.target == 0x11
    assert answer.finding.fields == answer.fields
    assert answer.rtt is not None
    assert str(answer) == "power.get_battery_percentage: success: percentage 49 %"
    assert copy.copy(answer) == answer == pickle.loads(pickle.dumps(answer))


def test_a_field_that_is_not_there_says_which_are() -> None:
    answer = sent("fake:bolt-plus", "power.get_battery_percentage")
    assert "percentage" in answer
    with pytest.raises(KeyError, match=r"no field 'percent'; the fields are percentage"):
        answer["percent"]
    with pytest.raises(AttributeError, match=r"no field 'percent'; the fields are percentage"):
        _ = answer.percent
    with pytest.raises(AttributeError, match="no fields were decoded"):
        _ = sent("fake:bolt-plus", "power.wake").percent


def test_a_payload_and_a_node_are_sent_as_given() -> None:
    assert sent("fake:rvr", 0x10, 0x00, b"hello").payload == b"hello"
    for target in ("secondary", 2 | 1 << 4):
        answer = sent("fake:rvr", "system_info.get_main_app_version", target=target)
        assert (answer.command.target, answer.major) == (0x12, 6)
    assert sent("fake:rvr", 0x10, 0x00, b"hello", target="none").command.target is None


def test_text_from_the_robot_is_quoted() -> None:
    answer = sent("fake:bolt-plus", "api_and_shell.ping", payload=b"\x1b[2J")
    assert answer.payload == b"\x1b[2J"
    assert "\x1b" not in str(answer)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        pytest.param(("power.get_batery_percentage",), "no command named", id="misspelt"),
        pytest.param((0x13,), "a DID alone", id="no CID"),
        pytest.param((0x13, 0x100), "CID: 256 is larger", id="large CID"),
        pytest.param((-1, 0x10), "DID: '-1'", id="negative DID"),
        pytest.param(("power.wake", 1), "names a whole command", id="name and CID"),
        pytest.param((Command(0x13, 0x10), 1), "has its CID", id="command and CID"),
        pytest.param(("drive.set_raw_motors",), "takes arguments", id="no arguments"),
    ],
)
def test_invalid_arguments_are_a_usage_error(words: tuple[object, ...], said: str) -> None:
    with pytest.raises(UsageError, match=said):
        sent("fake:rvr", *words)


def test_a_robots_refusal_is_an_error_unless_unchecked() -> None:
    with pytest.raises(RobotRefusedError, match="0x05 bad data length"):
        sent("fake:bolt-plus", 0x13, 0x10, bytes(3))
    answer = sent("fake:bolt-plus", "power.get_battery_percentage", payload=bytes(3), check=False)
    assert (answer.ok, answer.code, answer.code_name) == (False, 5, "bad data length")
    assert answer.fields == {}


def test_silence_is_an_error_unless_unchecked() -> None:
    device = "fake:bolt-plus?silent=0x13:0x10"
    with pytest.raises(CommandSilentError, match="0x13:0x10 in 3 attempts; the robot answers") as caught:
        sent(device, 0x13, 0x10)
    assert "--" not in caught.value.hint
    answer = sent(device, 0x13, 0x10, check=False)
    assert (answer.ok, answer.code, answer.rtt, answer.finding.attempts) == (False, None, None, 3)
    assert str(answer).startswith("power.get_battery_percentage: ")


def test_a_robot_that_answers_nothing_at_all_is_told_from_a_silent_command() -> None:
    device = "fake:bolt-plus?silent=0x13:0x10,0x13:0x0d,0x10:0x00"
    with pytest.raises(NoAnswerError, match="nor to an echo") as caught:
        sent(device, 0x13, 0x10)
    assert "--" not in caught.value.hint
    assert sent(device, 0x13, 0x10, check=False).outcome is Outcome.SILENT


def test_a_lost_link_is_an_error_and_can_be_opened_again() -> None:
    async def use(robot: ConnectedRobot) -> int:
        with pytest.raises(LinkLostError):
            await robot.send(0x13, 0x10)
        await robot.reconnect()
        return int((await robot.send(0x13, 0x0D)).code or 0)

    assert with_robot("fake:bolt-plus?disconnect_after=2&silent=0x13:0x10", use) == 0


# Every class, on several models; names, numbers and unknown pairs. The CLI is the independent source.
TABLE = [
    ("fake:bolt-plus", "power.get_battery_percentage", ""),
    ("fake:bolt-plus", "power.wake", ""),
    ("fake:bolt-plus", "power.sleep", ""),
    ("fake:bolt-plus", "power.enter_deep_sleep", "00"),
    ("fake:bolt-plus", "user_io.set_all_leds_with_8_bit_mask", "3f000000000000"),
    ("fake:bolt-plus", "drive.set_raw_motors", "00000000"),
    ("fake:bolt-plus", "0x13:0x42", ""),
    ("fake:bolt-plus", "0x13:0x11", "0000000000000000000000"),
    ("fake:bolt-plus", "0x1d:0x01", ""),
    ("fake:bolt-plus", "0x1f:0x99", "00"),
    ("fake:rvr", "connection.set_bluetooth_name", "4142"),
    ("fake:rvr", "drive.reset_yaw", ""),
    ("fake:rvr", "system_info.get_mac_address", ""),
    ("fake:bb8", "sphero.roll", "00000000"),
    ("fake:bb8", "core.ping", ""),
    ("fake:bb8", "0x01:0x00", ""),
]
CONSENTS = [[], ["write"], ["motion"], ["persist"], ["write", "motion", "persist"]]


@pytest.mark.parametrize("allowed", CONSENTS, ids=lambda allowed: "+".join(allowed) or "default")
@pytest.mark.parametrize(("device", "name", "payload"), TABLE)
def test_the_api_refuses_what_the_command_line_refuses(
    cli: Cli, device: str, name: str, payload: str, allowed: list[str]
) -> None:
    options = [word for risk in allowed for word in ("--allow", risk)]
    ran = cli("send", name, *([payload] if payload else []), *options, "--device", device, "--no-journal")
    assert ran.code in (0, 6, 7), ran.err
    kinds: dict[int, type[SpheroProbeError]] = {6: RefusedByPolicyError, 7: RobotRefusedError}
    with pytest.raises(kinds[ran.code]) if ran.code else nullcontext() as caught:
        with_robot(device, lambda robot: robot.send(name, payload=bytes.fromhex(payload)), allowed)
    if caught:
        assert str(caught.value) in ran.err
        assert ("consent=" in caught.value.hint) is (ran.code == 6)


def test_the_table_has_both_kinds() -> None:
    def codes(allowed: list[str]) -> set[bool]:
        refused = set()
        for device, name, payload in TABLE:
            answer = with_robot(
                device,
                lambda robot, name=name, payload=payload: robot.send(  # type: ignore[misc]
                    name, payload=bytes.fromhex(payload), check=False
                ),
                allowed,
            )
            refused.add(answer.outcome is Outcome.SKIPPED)
        return refused

    assert codes([]) == codes(["write"]) == {True, False}


def test_brick_needs_the_name_of_the_robot_too() -> None:
    async def use(robot: ConnectedRobot) -> str:
        return robot.name

    name = with_robot("fake:bolt-plus", use)
    for confirmed, refused in (("", True), ("BP-0000", True), (name, False)):
        consent = Consent.of(["brick"], confirmed)
        answer = with_robot(
            "fake:bolt-plus",
            lambda robot: robot.send("power.enter_deep_sleep", payload=b"\0", check=False),
            consent,
        )
        assert (answer.outcome is Outcome.SKIPPED) is refused


def test_an_unknown_risk_class_is_a_usage_error() -> None:
    with pytest.raises(UsageError, match="no risk class 'wrlte'"):
        with_robot("fake:bolt", lambda robot: robot.firmware(), ["wrlte"])
