"""Text that holds packets: dumps, pasted bytes and logs, recognised line by line."""

import re
from codecs import getincrementaldecoder
from collections.abc import Iterable, Iterator
from typing import Final, NamedTuple

from sphero_probe.captures.dumps import dumped_bytes
from sphero_probe.captures.logs import LogReader, Said, may_start_frame, starts_frame
from sphero_probe.captures.pasted import pasted_bytes
from sphero_probe.errors import UsageError
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Generation, Malformed, Packet, Role

_MAX_HELD: Final = 4096
_ROLES: Final = {True: Role.ROBOT, False: Role.HOST, None: Role.OBSERVER}
_SEVERAL: Final = re.compile(r"[\s,\[]")
"""What tells several bytes from a word or a number that only looks like one."""
_CONTROL: Final = frozenset(range(0x20)) - frozenset(b"\t\n\r\x1b\x01\x02\x0c")


class Logged(NamedTuple):
    """A packet of a text.

    Attributes:
        time: as the text writes it, None where it does not.
        to_robot: as in ``Said``.
        generation: the protocol.
        packet: what it says.
    """

    time: str | None
    to_robot: bool | None
    generation: Generation
    packet: Packet


def is_text(first: bytes) -> bool:
    """Whether the start of a file is text: UTF-8 without control characters."""
    try:
        getincrementaldecoder("utf-8")().decode(first)
    except UnicodeDecodeError:
        return False
    return bool(first) and _CONTROL.isdisjoint(first)


class Unclear:
    """Lines that may stand for different bytes, and are therefore not read.

    Attributes:
        count: how many.
        line: the number of the first, from 1.
        error: what is unclear in it, None where there is none.
    """

    def __init__(self) -> None:
        """Know of none yet."""
        self.count = self.line = 0
        self.error: UsageError | None = None

    def add(self, line: int, error: UsageError) -> None:
        """Count one."""
        self.count += 1
        if self.error is None:
            self.line, self.error = line, error


def said_in(lines: Iterable[str], unclear: Unclear) -> Iterator[Said]:
    """Yield what the lines of a text say; a line of nothing that is known says nothing."""
    reader = LogReader()
    for number, line in enumerate(lines, 1):
        problem: UsageError | None = None
        if (data := dumped_bytes(line)) is None:
            try:
                data = pasted_bytes(line)
            except UsageError as error:
                problem = error if _SEVERAL.search(line.strip()) else None
        if data is None:
            try:
                said = reader.feed(line)
            except UsageError as error:
                said, problem = None, error
            if said:
                yield said
            elif problem:
                unclear.add(number, problem)
        elif data:
            yield Said(None, None, data, bare=True)


def logged_packets(
    lines: Iterable[str], fixed: Generation | None = None, unclear: Unclear | None = None
) -> Iterator[Logged]:
    """Yield the packets of a text, in the order of its lines; a frame may go over several of one direction.

    Args:
        lines: the text.
        fixed: the protocol, None to tell them apart.
        unclear: gets the lines that may stand for different bytes.
    """
    held: dict[bool | None, bytes] = {}
    spoken = (fixed,) if fixed else (Generation.V2, Generation.V1)
    last: dict[bool | None, str | None] = {}
    for said in said_in(lines, unclear or Unclear()):
        before = held.pop(said.to_robot, b"")
        if not (before or said.bare or starts_frame(said.data)):
            continue
        joined = before + said.data
        generation, packets = _best(joined, said.to_robot, spoken)
        tail = packets[-1] if packets else None
        if isinstance(tail, Malformed) and _may_go_on(tail.raw):
            held[said.to_robot] = tail.raw
            last[said.to_robot] = said.time
            packets = packets[:-1]
        for packet in packets:
            yield Logged(said.time, said.to_robot, generation, packet)
    for to_robot, raw in held.items():
        yield Logged(last[to_robot], to_robot, spoken[0], Malformed(raw, "the text ends inside a frame"))


def _may_go_on(raw: bytes) -> bool:
    return may_start_frame(raw) and len(raw) <= _MAX_HELD and not (raw[:1] == b"\x8d" and raw[-1:] == b"\xd8")


def _best(
    data: bytes, to_robot: bool | None, spoken: tuple[Generation, ...]
) -> tuple[Generation, list[Packet]]:
    """Read bytes as each generation; return what makes the most sense of them."""
    found: list[tuple[int, int, Generation, list[Packet]]] = []
    for generation in spoken:
        decoder = CODECS[generation].decoder(_ROLES[to_robot])
        packets = [*decoder.feed(data), *decoder.give_up()]
        bad = sum(isinstance(packet, Malformed) for packet in packets)
        found.append((len(packets) - bad, -bad, generation, packets))
    _, _, generation, packets = max(found, key=lambda each: each[:2])
    return generation, packets
