"""Sends commands to a fake robot of either generation, and returns its packets."""

from collections.abc import Callable

from sphero_probe.catalogue.model import CommandRow
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Notification, Response, Role
from sphero_probe.simulator import Executed, FakeRobot, parse_settings

Said = Response | Notification


def fake(text: str, on_execute: Callable[[Executed], None] | None = None) -> FakeRobot:
    return FakeRobot(parse_settings(text), on_execute)


def said_by(robot: FakeRobot, now: float) -> list[Said]:
    """All packets that a robot has sent by then; none may be damaged."""
    said: list[Said] = []
    for packet in CODECS[robot.model.generation].decoder(Role.HOST).feed(b"".join(robot.speak(now=now))):
        assert isinstance(packet, Said), packet
        said.append(packet)
    return said


def tell(robot: FakeRobot, command: Command, *, seq: int = 7, now: float = 0.0, **flags: bool) -> list[Said]:
    """The packets that a robot sends after a command."""
    robot.hear(CODECS[robot.model.generation].encode_command(command, seq, **flags), now=now)
    return said_by(robot, now)


def ask(
    robot: FakeRobot, did: int, cid: int, payload: bytes = b"", *, node: int | None = None, now: float = 0.0
) -> Response:
    """A robot's one response to a command, of any node if none is named; notifications left out."""
    anyone = 0x10 if robot.model.addressed else None
    target = anyone if node is None else 0x10 | node
    said = tell(robot, Command(did, cid, payload, target), now=now)
    (response,) = [packet for packet in said if isinstance(packet, Response)]
    return response


def code_of(
    robot: FakeRobot, did: int, cid: int, payload: bytes = b"", *, node: int | None = None, now: float = 0.0
) -> int:
    """The code of a robot's one response to a command."""
    return ask(robot, did, cid, payload, node=node, now=now).code


def sample_of(row: CommandRow) -> bytes:
    """Arguments that a command accepts."""
    if row.sample is not None:
        return row.sample
    return row.request.zeros() if row.request else b""
