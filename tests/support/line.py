"""A transport for the tests of the link; a function plays the robot."""

import asyncio
from collections.abc import Callable

from sphero_probe.protocol.packets import Command, Request, Response, Role
from sphero_probe.protocol.v2 import V2
from tests.support.narrowing import only

Robot = Callable[[Request], list[tuple[float, bytes]]]
"""The packets that a robot sends after a request, each with its delay in seconds."""


def answer_to(request: Request, payload: bytes = b"") -> bytes:
    """The frame of a plain "success"."""
    command = request.command
    return V2.encode_response(Response(request.seq, 0x00, payload, command.did, command.cid, flags=0x09))


def after(delay: float) -> Robot:
    """A robot that answers everything after this many seconds."""
    return lambda request: [(delay, answer_to(request))]


def never(_: Request) -> list[tuple[float, bytes]]:
    """A robot that never answers."""
    return []


def clock() -> float:
    """Seconds on the clock of the running loop."""
    return asyncio.get_running_loop().time()


class Line:
    """A transport with a robot: a function that takes a request and returns packets with their delays.

    Attributes:
        requests: what was heard, each with its time.
        written: the same as it was written.
        unanswered: requests that the robot has not said anything to yet.
        most_unanswered: the most there ever were.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.requests: list[tuple[float, Request]] = []
        self.written: list[bytes] = []
        self.unanswered = 0
        self.most_unanswered = 0
        self._coming: asyncio.Queue[bytes | Exception] = asyncio.Queue()
        self._decoder = V2.decoder(Role.ROBOT)

    async def write(self, data: bytes) -> None:
        self.written.append(data)
        request = only(Request, self._decoder.feed(data))
        self.requests.append((clock(), request))
        self.unanswered += 1
        self.most_unanswered = max(self.most_unanswered, self.unanswered)
        for delay, said in self.robot(request):
            asyncio.get_running_loop().call_later(delay, self.say, said)

    async def read(self) -> bytes:
        said = await self._coming.get()
        if isinstance(said, Exception):
            raise said
        return said

    def say(self, said: bytes | Exception) -> None:
        """Make the link read this: bytes, ``b""`` for "the connection is lost", or an exception."""
        self.unanswered -= 1
        self._coming.put_nowait(said)

    @property
    def commands(self) -> list[Command]:
        return [request.command for _, request in self.requests]

    @property
    def seqs(self) -> list[int]:
        return [request.seq for _, request in self.requests]
