"""``decode``: print the packets in hex bytes, files or standard input. It needs no robot."""

import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Final

from sphero_probe.catalogue import ROBOTS, robot_by_word
from sphero_probe.catalogue.capture_context import CaptureContext
from sphero_probe.catalogue.dissection import dissect
from sphero_probe.catalogue.naming import choose
from sphero_probe.catalogue.streams import StreamDecoder
from sphero_probe.cli.hex_stream import read_packets
from sphero_probe.cli.messages import say
from sphero_probe.cli.output import report
from sphero_probe.cli.parse import hex_bytes, is_hex
from sphero_probe.cli.values import Output
from sphero_probe.errors import BadInputFileError, UsageError
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.autodetect import AutoDecoder
from sphero_probe.protocol.packets import Generation, Malformed, Packet, Role
from sphero_probe.reports.packet_views import BYTES
from sphero_probe.reports.rows import byte_row, packet_row
from sphero_probe.reports.views import PACKETS

_TABLE_ROOM: Final = 1 << 17
"""Bytes of packets that fit into a table, which is held in memory."""
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
    good = bad = total = left_out = 0
    room = _TABLE_ROOM if output.format == "table" else None
    with report(output, BYTES if explain else PACKETS) as rows:
        for stream in _streams(inputs):
            context = CaptureContext(robot)
            sensors = {spoken: StreamDecoder(spoken, robot) for spoken in CODECS}
            for size, spoken, heard in _packets(stream, Generation(generation) if generation else None):
                total += size
                if heard is None:
                    continue
                packet = context.complete(spoken, heard)
                if isinstance(packet, Malformed):
                    bad += 1
                else:
                    good += 1
                raw = CODECS[spoken].frame_of(packet)
                sensors[spoken].observe(packet)
                if room is not None:
                    room = max(0, room - (len(raw) * _ROW if explain else len(raw) + _ROW))
                    if not room:
                        left_out += 1
                        continue
                if explain:
                    for part in dissect(packet, spoken, raw, robot):
                        rows.add(byte_row(good + bad, part))
                    continue
                rows.add(packet_row(packet, spoken, raw, robot, sensors[spoken]))
    if left_out:
        say(f"Not shown: {left_out} more packets; --format plain or jsonl shows all.")
    if not good:
        raise BadInputFileError(
            f"no packet in {total} bytes ({bad} malformed)",
            "a V2 packet starts with 8d and ends with d8, a V1 packet starts with ff ff or ff fe",
        )


def _packets(
    stream: Iterable[bytes], fixed: Generation | None
) -> Iterator[tuple[int, Generation, Packet | None]]:
    """Yield bytes read, generation and packet; the packet is None where a chunk is only counted."""
    decoder = CODECS[fixed].decoder(Role.OBSERVER) if fixed else None
    recogniser = AutoDecoder()
    for chunk in stream:
        yield len(chunk), fixed or Generation.V2, None
        if decoder and fixed:
            for packet in decoder.feed(chunk) if chunk else decoder.give_up():
                yield 0, fixed, packet
        else:
            for spoken, packet in recogniser.feed(chunk) if chunk else recogniser.end():
                yield 0, spoken, packet


def _streams(inputs: tuple[str, ...]) -> Iterator[Iterable[bytes]]:
    """Yield the byte streams that the arguments name; each ends with an empty chunk."""
    if not inputs:
        if sys.stdin.isatty():
            raise UsageError("nothing to decode", "give hex bytes, a file, or - for standard input")
        inputs = ("-",)
    if all(is_hex(text) for text in inputs):
        yield (hex_bytes(" ".join(inputs), "packet"), b"")
        return
    for text in inputs:
        if text == "-":
            yield read_packets(sys.stdin.buffer, "standard input")
        elif is_hex(text):
            yield (hex_bytes(text, "packet"), b"")
        else:
            try:
                with Path(text).open("rb") as file:
                    yield read_packets(file, text)
            except OSError as error:
                raise BadInputFileError(f"{text}: {error.strerror}", "give hex bytes or a file") from error
