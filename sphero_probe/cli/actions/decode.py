"""``decode``: print the packets in hex bytes, files or standard input. It needs no robot."""

import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import nullcontext
from itertools import chain
from pathlib import Path
from typing import Final, NamedTuple

from sphero_probe.captures.dumps import begins_as_dump
from sphero_probe.captures.pasted import pasted_bytes
from sphero_probe.captures.reader import Capture, open_capture
from sphero_probe.captures.source import Reads, Source
from sphero_probe.captures.text import Unclear, is_text, logged_packets
from sphero_probe.catalogue import ROBOTS, robot_by_word
from sphero_probe.catalogue.dissection import dissect
from sphero_probe.catalogue.model import Robot
from sphero_probe.catalogue.naming import choose
from sphero_probe.catalogue.packet_reader import PacketReader
from sphero_probe.cli import hex_stream
from sphero_probe.cli.bug_report import recording
from sphero_probe.cli.captured import captured_rows
from sphero_probe.cli.hex_stream import is_hex_text, read_packets
from sphero_probe.cli.messages import say, warn
from sphero_probe.cli.output import report
from sphero_probe.cli.parse import hex_bytes, is_hex
from sphero_probe.cli.values import Output
from sphero_probe.errors import BadInputFileError, UnreadableCaptureError, UsageError
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.autodetect import AutoDecoder
from sphero_probe.protocol.packets import Generation, Malformed, Packet, Role
from sphero_probe.reports.captures import CAPTURED, placed
from sphero_probe.reports.packet_views import BYTES
from sphero_probe.reports.registry import Report
from sphero_probe.reports.rows import Row, byte_row, read_row
from sphero_probe.reports.views import PACKETS

_TABLE_ROOM: Final = 1 << 17
"""Bytes of packets that fit into a table, which is held in memory."""
_LEAST_CAPTURE: Final = 12
"""Bytes of the shortest start of a capture; writers send it in one piece."""
_ROW: Final = 32
"""Bytes that each row counts for besides its packet."""


def decode(
    output: Output,
    inputs: tuple[str, ...],
    generation: str | None,
    model: str | None = None,
    *,
    explain: bool = False,
) -> None:
    """Show the packets of all inputs.

    Args:
        output: where and how.
        inputs: hex bytes, files, or ``-`` for standard input; none means standard input.
        generation: the protocol, ``v1`` or ``v2``; None to tell them apart.
        explain: show the packets byte by byte.
        model: the robot that sent the packets; None if it is not known.

    Raises:
        UsageError: no robot has this name, there is no input, or hex bytes are not valid.
        BadInputFileError: a file cannot be read, or there is no packet in all inputs.
    """
    robot = None if model is None else robot_by_word(model) or ROBOTS[choose(model, ROBOTS, "robot")]
    fixed = Generation(generation) if generation else None
    streams = _streams(inputs)
    first = next(streams)
    shown = _Shown(output.format, robot, explain)
    captures: list[str] = []
    unclear: list[_Text] = []
    view = BYTES if explain else CAPTURED if isinstance(first, _Recording | _Text) else PACKETS
    with report(output, view) as rows:
        for stream in chain((first,), streams):
            if isinstance(stream, _Recording):
                found = captured_rows(stream.capture, robot)
                shown.all(rows, (_Found(at.generation, packet, at.raw, row) for at, packet, row in found))
                captures.append(f"{stream.name}: {stream.capture.said}")
            elif isinstance(stream, _Text):
                shown.all(rows, _text_rows(stream, fixed, robot, shown))
                unclear += [stream] if stream.unclear.count else []
            else:
                shown.all(rows, _rows(stream, fixed, robot, shown))
    _conclude(shown, captures, unclear)


def _conclude(shown: "_Shown", captures: Sequence[str], unclear: Sequence["_Text"]) -> None:
    """Say what was read, what is not shown, and what is unclear.

    Args:
        shown: the packets of all inputs.
        captures: what each capture says of itself.
        unclear: texts with lines that are unclear.

    Raises:
        BadInputFileError: there is no packet in all inputs.
    """
    for said in captures:
        say(said)
    if shown.left_out:
        say(f"Not shown: {shown.left_out} more packets; --format plain or jsonl shows all.")
    for text in unclear:
        _say_unclear(text, fatal=not shown.good and not captures)
    if not shown.good and not captures:
        raise BadInputFileError(
            f"no packet in {shown.total} bytes ({shown.bad} malformed)",
            "a V2 packet starts with 8d and ends with d8, a V1 packet starts with ff ff or ff fe",
        )


class _Recording(NamedTuple):
    """A capture among the inputs."""

    name: str
    capture: Capture


class _Text(NamedTuple):
    """A text among the inputs that is more than hex tokens: a dump, a log, pasted bytes."""

    name: str
    lines: Iterator[str]
    unclear: Unclear


class _Found(NamedTuple):
    """A packet of an input: its protocol, what was decoded, its frame and its row."""

    generation: Generation
    packet: Packet
    raw: bytes
    row: Row


class _Shown:
    """Shows packets and counts them, also what no longer fits into a table.

    Attributes:
        good: packets, malformed ones aside.
        bad: malformed packets.
        total: bytes.
        left_out: packets that did not fit.
        rounds: the format rounds floats to six digits.
    """

    def __init__(self, form: str, robot: Robot | None, explain: bool) -> None:
        self.good = self.bad = self.total = self.left_out = 0
        self.rounds = form not in ("json", "jsonl")
        self._room = _TABLE_ROOM if form == "table" else None
        self._robot = robot
        self._explain = explain

    def all(self, rows: Report, packets: Iterable[_Found]) -> None:
        """Show the packets, each as one row or byte by byte, as many as fit."""
        add = rows.add
        for generation, packet, raw, row in packets:
            if isinstance(packet, Malformed):
                self.bad += 1
            else:
                self.good += 1
            if self._room is not None and not self._has_room(len(raw)):
                self.left_out += 1
            elif self._explain:
                for part in dissect(packet, generation, raw, self._robot):
                    add(byte_row(self.good + self.bad, part))
            else:
                add(row)

    def _has_room(self, size: int) -> bool:
        """Take the room that a packet of this size needs; whether there was as much."""
        needed = size * _ROW if self._explain else size + _ROW
        self._room = max(0, (self._room or 0) - needed)
        return self._room > 0


def _say_unclear(text: _Text, *, fatal: bool) -> None:
    """Say which lines were not read, because they may stand for different bytes.

    Raises:
        BadInputFileError: there is nothing else in all inputs.
    """
    count, line, error = text.unclear.count, text.unclear.line, text.unclear.error
    if error is None:
        return
    more = "" if count == 1 else f" (and {count - 1} more line{'s' if count > 2 else ''})"
    said = f"{text.name}, line {line}{more}: {error}"
    if fatal:
        raise BadInputFileError(said, error.hint)
    warn(f"not read: {said}; {error.hint}")


def _rows(
    stream: Iterable[bytes], fixed: Generation | None, robot: Robot | None, shown: _Shown
) -> Iterator[_Found]:
    """Yield the packets of a stream of bytes."""
    reader = PacketReader(robot, raw_floats=shown.rounds)
    for spoken, heard in _packets(stream, fixed, shown):
        read = reader.read(spoken, heard)
        packet, raw, _, _ = read
        yield tuple.__new__(_Found, (spoken, packet, raw, read_row(read)))  # quicker than its own __new__


def _text_rows(text: _Text, fixed: Generation | None, robot: Robot | None, shown: _Shown) -> Iterator[_Found]:
    """Yield the packets of a text."""
    reader = PacketReader(robot)
    for time, to_robot, spoken, heard in logged_packets(text.lines, fixed, text.unclear):
        read = reader.read(spoken, heard)
        shown.total += len(read.raw)
        yield _Found(spoken, read.packet, read.raw, placed(read_row(read), time, to_robot))


def _packets(
    stream: Iterable[bytes], fixed: Generation | None, shown: _Shown
) -> Iterator[tuple[Generation, Packet]]:
    """Yield the packets of a stream that ends with an empty chunk; the bytes are counted."""
    decoder = CODECS[fixed].decoder(Role.OBSERVER) if fixed else None
    recogniser = AutoDecoder()
    for chunk in stream:
        shown.total += len(chunk)
        if decoder and fixed:
            for packet in decoder.feed(chunk) if chunk else decoder.give_up():
                yield fixed, packet
        else:
            yield from recogniser.feed(chunk) if chunk else recogniser.end()


def _streams(inputs: tuple[str, ...]) -> Iterator[Iterable[bytes] | _Recording | _Text]:
    """Yield captures and byte streams as the arguments name them; a stream ends with an empty chunk."""
    if not inputs:
        if sys.stdin.isatty():
            raise UsageError("nothing to decode", "give hex bytes, a file, or - for standard input")
        inputs = ("-",)
    if all(is_hex(text) and not _is_file(text) for text in inputs):
        yield (hex_bytes(" ".join(inputs), "packet"), b"")
        return
    for text in inputs:
        if text != "-" and (typed := _typed(text)) is not None:
            yield (typed, b"")
            continue
        name = "standard input" if text == "-" else text
        try:
            with nullcontext(sys.stdin.buffer) if text == "-" else recording(text) as file:
                yield _read(file, name)
        except (OSError, ValueError, UnreadableCaptureError) as error:
            why = error.strerror if isinstance(error, OSError) else str(error)
            raise BadInputFileError(f"{name}: {why}", "give hex bytes or a file") from error


def _typed(text: str) -> bytes | None:
    """Return the bytes that an argument stands for, None where it is the name of a file.

    Raises:
        UsageError: it may stand for different bytes.
    """
    if _is_file(text):
        return None
    return hex_bytes(text, "packet") if is_hex(text) else pasted_bytes(text)


def _is_file(text: str) -> bool:
    try:
        return Path(text).is_file()
    except (OSError, ValueError):  # too long for a name, or with a character that no name has
        return False


def _read(file: Reads, name: str) -> Iterable[bytes] | _Recording | _Text:
    """Return what a file is; only its first piece decides, for more may be long in coming."""
    first = getattr(file, "read1", file.read)(hex_stream.CHUNK)
    source = Source(file, first)
    capture = open_capture(source, name) if len(first) >= _LEAST_CAPTURE else None
    if capture:
        return _Recording(name, capture)
    if begins_as_dump(first) or (is_text(first) and not is_hex_text(first)):
        return _Text(name, _lines(source), Unclear())
    return read_packets(source, name)


def _lines(source: Source) -> Iterator[str]:
    """Yield the lines of a text, very long ones in pieces."""
    held = b""
    while piece := source.read1(hex_stream.CHUNK):
        *lines, held = (held + piece).split(b"\n")
        yield from (line.decode("utf-8", "replace") for line in lines)
        if len(held) > hex_stream.CHUNK:
            yield held.decode("utf-8", "replace")
            held = b""
    if held:
        yield held.decode("utf-8", "replace")
