"""Descriptions of unsolicited packets: one shape, streams decoded by what the robot was seen to accept."""

import asyncio
import struct

import pytest

from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.exchange import LateResponse, Silent, Unsolicited
from sphero_probe.link.link import Link
from sphero_probe.link.policy import Consent, Policy
from sphero_probe.link.unsolicited import describe_unsolicited
from sphero_probe.probing.finding import Note
from sphero_probe.probing.notes import note_of
from sphero_probe.protocol.packets import Command, Malformed, Notification, Request, Response, Role
from sphero_probe.protocol.v2 import V2
from tests.support.virtual_clock import run

ATTITUDE = Command(0x18, 0x00, bytes.fromhex("00960000070000"))
STREAM = V2.frame_of(Notification(0x18, 0x02, struct.pack(">3f", 1.0, -2.0, 90.0), 0x02, None, 0xFF, 0x28))
PITCH_ROLL_YAW = {"pitch": 1.0, "roll": -2.0, "yaw": 90.0}
SPOILT = bytes.fromhex("8d09130d0000d7d8")

Heard = list[tuple[Unsolicited, dict[str, object]]]


class Line:
    """A robot that answers a command with a code after a delay in seconds."""

    def __init__(self, code: int, delay: float) -> None:
        self._code = code
        self._delay = delay
        self._coming: asyncio.Queue[bytes] = asyncio.Queue()
        self._decoder = V2.decoder(Role.ROBOT)

    async def write(self, data: bytes) -> None:
        (request,) = self._decoder.feed(data)
        assert isinstance(request, Request)
        did, cid = request.command[:2]
        answer = V2.encode_response(Response(request.seq, self._code, b"", did, cid, flags=0x09))
        asyncio.get_running_loop().call_later(self._delay, self.say, answer)

    async def read(self) -> bytes:
        return await self._coming.get()

    def say(self, data: bytes) -> None:
        self._coming.put_nowait(data)


def heard_from(line: Line, *commands: Command, then: bytes = b"") -> Heard:
    """What is told while commands are asked and the robot says something a second after them."""
    heard: Heard = []

    async def scenario() -> None:
        policy = Policy(V2.generation, None, Consent(frozenset(Risk)), ())
        async with Link(line, V2, policy, timeout=0.5) as link:
            with describe_unsolicited(link, lambda *told: heard.append(told)):
                for command in commands:
                    await link.ask(command)
                await asyncio.sleep(1.0)
                line.say(then or STREAM)
                await asyncio.sleep(0.1)
            line.say(then or STREAM)
            await asyncio.sleep(0.1)

    run(scenario())
    return heard


@pytest.mark.parametrize(
    ("code", "delay", "decoded"),
    [
        pytest.param(0x00, 0.1, True, id="accepted"),
        pytest.param(0x06, 0.1, False, id="refused"),
        pytest.param(0x00, 0.75, True, id="accepted, told late"),
        pytest.param(0x06, 0.75, False, id="refused, told late"),
        pytest.param(0x00, 9.0, False, id="never answered"),
    ],
)
def test_a_stream_is_read_by_what_the_robot_accepted(code: int, delay: float, decoded: bool) -> None:
    heard = heard_from(Line(code, delay), ATTITUDE)
    unsolicited, described = heard[-1]
    assert isinstance(unsolicited, Notification)
    assert (described.get("fields") == PITCH_ROLL_YAW) == decoded
    assert bytes.fromhex(str(described["raw"])) == STREAM
    assert len(heard) == (2 if delay == 0.75 else 1), "once each, and nothing after leaving the context"


def test_a_late_response_is_described_as_a_response_and_noted_as_late() -> None:
    (late, described), _ = heard_from(Line(0x00, 0.75), Command(0x13, 0x10))
    assert isinstance(late, LateResponse)
    assert isinstance(late.earlier, Silent)
    assert described["kind"] == "response"
    kind, text, details = note_of(late, described)
    assert (kind, text) == ("late", "late or repeated answer to 0x13:0x10 seq 0")
    assert details == {key: value for key, value in described.items() if key != "kind"}
    assert (details["code_name"], details["raw"]) == ("success", late.received.hex())


def test_a_foreign_answer_names_what_it_names() -> None:
    foreign = V2.encode_response(Response(9, 0x00, b"", 0x13, 0x11, flags=0x09))
    ((late, described),) = heard_from(Line(0x00, 0.1), then=foreign)
    assert note_of(late, described).text == "foreign answer to 0x13:0x11 seq 9"
    assert isinstance(late, LateResponse)
    without_ids = late._replace(response=late.response._replace(did=None, cid=None))
    assert note_of(without_ids, described).text == "foreign answer seq 9"


def test_a_malformed_frame_keeps_its_bytes_and_the_reason() -> None:
    ((spoilt, described),) = heard_from(Line(0x00, 0.1), then=SPOILT)
    assert isinstance(spoilt, Malformed)
    time = described["time"]
    reason = "checksum 0xd7, expected 0xd6"
    assert described == {
        "time": time, "generation": "v2", "kind": "malformed", "raw": SPOILT.hex(), "reason": reason
    }  # fmt: skip
    expected = {"time": time, "generation": "v2", "raw": SPOILT.hex(), "reason": reason}
    assert note_of(spoilt, described) == Note("malformed", reason, expected)
