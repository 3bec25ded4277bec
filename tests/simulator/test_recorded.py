"""A recorded robot: which answer a command gets, when, and that it never makes one up."""

from typing import Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.errors import BadInputFileError
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation, Malformed, Response, Role, SendOptions, Verdict
from sphero_probe.simulator.recorded import (
    NOT_RECORDED,
    Manner,
    RecordedExchange,
    RecordedRobot,
    Unknown,
    is_not_recorded,
)

V2, V1 = Generation.V2, Generation.V1
BATTERY: Final = Command(0x13, 0x10, b"", 0x11)
FRESH: Final = Response(1, 0, b"\x31", 0x13, 0x10, 0x01, 0x11, 0x08)


def recorded(command: Command, code: int, payload: bytes = b"", delay: float = 0.0) -> RecordedExchange:
    response = FRESH._replace(code=code, payload=payload, did=command.did, cid=command.cid)
    return RecordedExchange(command, response, delay)


PLAIN: Final = Manner()


def robot_of(
    *exchanges: RecordedExchange, manner: Manner = PLAIN, generation: Generation = V2
) -> RecordedRobot:
    return RecordedRobot("run.jsonl", generation, exchanges, manner)


def said(robot: RecordedRobot, generation: Generation = V2, now: float = 1e6) -> list[Response]:
    packets = CODECS[generation].decoder(Role.HOST).feed(b"".join(robot.speak(now=now)))
    assert all(isinstance(packet, Response) for packet in packets)
    return [packet for packet in packets if isinstance(packet, Response)]


def ask(robot: RecordedRobot, command: Command, seq: int = 9) -> tuple[int, bytes] | None:
    """Code and payload of the answer, None for silence."""
    robot.hear(CODECS[V2].encode_command(command, seq), now=0.0)
    answers = said(robot)
    assert len(answers) <= 1
    assert all(answer.seq == seq for answer in answers)
    return (answers[0].code, answers[0].payload) if answers else None


NOTHING: Final = (NOT_RECORDED, b"not recorded")
LED: Final = Command(0x1A, 0x1C, b"\0\1\xff", 0x11)
UNKNOWN: Final = Command(0x77, 0x01, b"\1", 0x11)
ROBOT: Final = (
    recorded(BATTERY, 0, b"\x31"),
    recorded(BATTERY._replace(payload=bytes(11)), 5),
    recorded(LED, 0),
    recorded(UNKNOWN, 0, b"\7"),
    recorded(UNKNOWN._replace(payload=b"\2"), 7),
    recorded(Command(0x13, 0x50, bytes(11), 0x11), 2),
    recorded(Command(0x13, 0x60, b"", 0x12), 6),
    recorded(Command(0x10, 0x00, b"\1\2", 0x11), 0, b"\1\2"),
    RecordedExchange(Command(0x13, 0x70, b"", 0x11), None),
)


@pytest.mark.parametrize(
    ("command", "expected"),
    [
        pytest.param(BATTERY, (0, b"\x31"), id="exact"),
        pytest.param(BATTERY._replace(payload=bytes(11)), (5, b""), id="exact-wrong-length"),
        pytest.param(BATTERY._replace(payload=b"x" * 11), (5, b""), id="same-length"),
        pytest.param(BATTERY._replace(payload=bytes(40)), (5, b""), id="nearest-length"),
        pytest.param(BATTERY._replace(payload=bytes(5)), NOTHING, id="a-success-proves-no-other-length"),
        pytest.param(LED._replace(payload=b"\0\1\x80"), (0, b""), id="success-of-the-same-length"),
        pytest.param(LED._replace(payload=b"\0\3\x80\x80"), (0, b""), id="of-a-length-that-the-layout-takes"),
        pytest.param(UNKNOWN._replace(payload=b"\2"), (7, b""), id="by-payload"),
        pytest.param(UNKNOWN._replace(payload=b"\3"), (0, b"\7"), id="first-of-the-same-length"),
        pytest.param(UNKNOWN._replace(payload=b"\3\3"), NOTHING, id="length-of-an-unknown-command"),
        pytest.param(Command(0x13, 0x50, b"", 0x11), (2, b""), id="the-code-of-the-pair"),
        pytest.param(Command(0x13, 0x51, b"", 0x11), NOTHING, id="never-recorded"),
        pytest.param(Command(0x13, 0x60, b"", 0x11), NOTHING, id="on-another-node"),
        pytest.param(Command(0x13, 0x60, b"", 0x02), (6, b""), id="the-node-behind-another-port"),
        pytest.param(Command(0x13, 0x60, b"", 0x10), (6, b""), id="any-node"),
        pytest.param(BATTERY._replace(target=None), (0, b"\x31"), id="the-node-that-receives"),
        pytest.param(Command(0x10, 0x00, b"\7\7\7", 0x11), (0, b"\7\7\7"), id="echo"),
        pytest.param(Command(0x13, 0x70, b"", 0x11), None, id="silence"),
        pytest.param(Command(0x13, 0x70, b"\1", 0x11), None, id="silence-at-another-length"),
        pytest.param(BATTERY._replace(options=SendOptions(answer=False)), None, id="no-answer-wanted"),
        pytest.param(BATTERY._replace(options=SendOptions(only_errors=True)), None, id="only-errors-wanted"),
    ],
)
def test_a_command_gets(command: Command, expected: tuple[int, bytes] | None) -> None:
    assert ask(robot_of(*ROBOT), command) == expected


@pytest.mark.parametrize("generation", [V1, V2])
def test_the_code_for_what_was_never_recorded_is_in_no_document(generation: Generation) -> None:
    assert CODECS[generation].verdict(NOT_RECORDED) is Verdict.UNLISTED


@pytest.mark.parametrize(
    ("unknown", "expected"), [(2, (2, b"")), (Unknown.SILENT, None), (Unknown.TOLD, NOTHING)]
)
def test_what_was_never_recorded_gets_what_was_chosen(
    unknown: Unknown | int, expected: tuple[int, bytes] | None
) -> None:
    assert ask(robot_of(*ROBOT, manner=Manner(unknown)), Command(1, 2, b"", 0x11)) == expected


def test_or_it_ends_the_conversation() -> None:
    robot = robot_of(*ROBOT, manner=Manner(Unknown.ERROR))
    with pytest.raises(BadInputFileError, match=r"run\.jsonl: 0x01:0x02 to node 1 was never recorded"):
        ask(robot, Command(1, 2, b"", 0x11))
    assert ask(robot, BATTERY) == (0, b"\x31")


def test_repeated_questions_get_their_answers_in_order_and_the_last_one_again() -> None:
    robot = robot_of(recorded(BATTERY, 0, b"\1"), recorded(BATTERY, 8), recorded(BATTERY, 0, b"\3"))
    expected = [(0, b"\1"), (8, b""), (0, b"\3"), (0, b"\3")]
    assert [ask(robot, BATTERY) for _ in expected] == expected
    robot.connect(now=0.0)
    assert [ask(robot, BATTERY) for _ in expected] == expected


@pytest.mark.parametrize(("speed", "due"), [(1.0, 0.25), (2.0, 0.125), (0.5, 0.5), (0.0, 0.0)])
def test_answers_take_the_recorded_time(speed: float, due: float) -> None:
    robot = robot_of(recorded(BATTERY, 0, delay=0.25), manner=Manner(speed=speed))
    assert robot.next_time() is None
    robot.hear(CODECS[V2].encode_command(BATTERY, 9), now=3.0)
    assert robot.next_time() == 3.0 + due
    assert not robot.speak(now=3.0 + due - 0.001)
    assert len(robot.speak(now=3.0 + due)) == 1


def test_a_node_answers_in_order_and_does_not_wait_for_another() -> None:
    slow, quick, other = (
        Command(0x13, cid, b"", target) for cid, target in ((1, 0x11), (2, 0x11), (3, 0x12))
    )
    robot = robot_of(
        recorded(slow, 0, delay=0.3), recorded(quick, 0, delay=0.1), recorded(other, 0, delay=0.2)
    )
    for command in (slow, quick, other):
        robot.hear(CODECS[V2].encode_command(command, command.cid), now=0.0)
    assert [response.cid for response in said(robot)] == [3, 1, 2]


def test_damage_and_pieces_are_taken_as_a_robot_takes_them() -> None:
    robot = robot_of(*ROBOT)
    frame = CODECS[V2].encode_command(BATTERY, 9)
    for piece in (b"\x8d\xff\xd8", frame[:3], frame[3:]):
        robot.hear(piece, now=0.0)
    assert [response.payload for response in said(robot)] == [b"\x31"]


EXCHANGES = st.lists(
    st.tuples(
        st.sampled_from([0x11, 0x12, None]),
        st.integers(0, 3),
        st.binary(max_size=3),
        st.none() | st.tuples(st.integers(0, 10), st.binary(max_size=4)),
    ),
    min_size=1,
    max_size=12,
)


@given(EXCHANGES, st.sampled_from([V1, V2]), st.data())
def test_what_was_recorded_comes_back_byte_for_byte(
    rows: list[tuple[int | None, int, bytes, tuple[int, bytes] | None]],
    generation: Generation,
    data: st.DataObject,
) -> None:
    codec = CODECS[generation]
    first: dict[Command, bytes] = {}
    exchanges: list[RecordedExchange] = []
    for target, cid, payload, answer in rows:
        command = Command(0x20, cid, payload, target if codec.has_addresses else None)
        frame = b""
        response = None
        if answer:
            response = Response(5, *answer)
            if codec.answers_name_commands:
                response = response._replace(did=0x20, cid=cid, flags=0x08)
            if command.target is not None:
                response = response._replace(source=command.target & 0x0F, target=0x11)
            frame = codec.encode_response(response)
            (response,) = [one for one in codec.decoder(Role.HOST).feed(frame) if isinstance(one, Response)]
        exchanges.append(RecordedExchange(command, response))
        first.setdefault(command, frame)
    robot = robot_of(*exchanges, generation=generation)
    for command, frame in first.items():
        robot.connect(now=0.0)
        robot.hear(codec.encode_command(command, 5), now=0.0)
        assert b"".join(robot.speak(now=0.0)) == frame
    stranger = Command(0x21, 1, data.draw(st.binary(max_size=9)), None)
    robot.hear(codec.encode_command(stranger, 6), now=0.0)
    assert [is_not_recorded(response) for response in said(robot, generation)] == [True]


@given(st.lists(st.binary(max_size=40), max_size=5))
def test_no_bytes_make_it_raise(pieces: list[bytes]) -> None:
    robot = robot_of(*ROBOT)
    for piece in pieces:
        robot.hear(piece, now=0.0)
    packets = CODECS[V2].decoder(Role.HOST).feed(b"".join(robot.speak(now=9.0)))
    assert not any(isinstance(packet, Malformed) for packet in packets)
