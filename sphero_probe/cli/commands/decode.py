"""``decode``: hex bytes, files or standard input go in, packets come out; no robot is needed."""

import re
import sys
from collections.abc import Iterable, Iterator
from itertools import chain
from typing import TYPE_CHECKING, BinaryIO, Final

import click

from sphero_probe.cli.complete.offers import offer_files
from sphero_probe.cli.options import output_options
from sphero_probe.cli.output import Output
from sphero_probe.errors import BadInputFileError, UsageError

if TYPE_CHECKING:
    from sphero_probe.protocol.packets import Generation, Packet

_CHUNK: Final = 1 << 14
"""Bytes of one read."""
_TABLE_ROOM: Final = 1 << 17
_ROW: Final = 32
"""A table must hold all that it shows: packets fit in while their bytes, and so many for each row, fit in."""
_HEX_TEXT: Final = frozenset(b"0123456789abcdefABCDEFxX \t\r\n:,_")
_BLANKS: Final = b" \t\r\n\f\v:,_"
_NOT_HEX: Final = re.compile(rb"[^0-9a-fA-FxX\s:,_]|(?<!0)[xX]")
_PREFIX: Final = re.compile(rb"0[xX]")


@click.command("decode")
@click.argument("inputs", nargs=-1, metavar="[HEX | FILE | -]...", shell_complete=offer_files)
@click.option("--v1", "generation", flag_value="v1", help="Take everything for V1.")
@click.option("--v2", "generation", flag_value="v2", help="Take everything for V2.")
@output_options
def command(output: Output, inputs: tuple[str, ...], generation: str | None) -> None:
    """Decode packets from hex bytes, files (binary or hex text) or standard input (-).

    V1 and V2 are told apart, also within one input. Bytes that are no packet are shown with the reason.

    Example: sphero-probe decode 8d0a131007cbd8
    """
    from sphero_probe.catalogue.streams import StreamDecoder
    from sphero_probe.protocol import CODECS
    from sphero_probe.protocol.packets import Malformed
    from sphero_probe.reports.rows import packet_row
    from sphero_probe.reports.views import PACKETS

    good = bad = total = left_out = 0
    room = _TABLE_ROOM if output.format == "table" else None
    with output.report(PACKETS) as report:
        for stream in _streams(inputs):
            sensors = {spoken: StreamDecoder(spoken) for spoken in CODECS}
            for size, spoken, packet in _packets(stream, generation):
                total += size
                if packet is None:
                    continue
                if isinstance(packet, Malformed):
                    bad += 1
                else:
                    good += 1
                raw = CODECS[spoken].frame_of(packet)
                sensors[spoken].observe(packet)
                if room is not None:
                    room = max(0, room - len(raw) - _ROW)
                    if not room:
                        left_out += 1
                        continue
                report.add(packet_row(packet, spoken, raw, streams=sensors[spoken]))
    if left_out:
        click.echo(f"Not shown: {left_out} more packets; --format plain or jsonl shows all.", err=True)
    if not good:
        raise BadInputFileError(
            f"no packet in {total} bytes ({bad} malformed)",
            "a V2 packet starts with 8d and ends with d8, a V1 packet starts with ff ff or ff fe",
        )


def _packets(
    stream: Iterable[bytes], generation: str | None
) -> "Iterator[tuple[int, Generation, Packet | None]]":
    """Yield bytes read, generation and packet; the packet is None where a chunk is only counted."""
    from sphero_probe.protocol import CODECS
    from sphero_probe.protocol.autodetect import AutoDecoder
    from sphero_probe.protocol.packets import Generation, Role

    fixed = Generation(generation) if generation else None
    decoder = CODECS[fixed].decoder(Role.WITNESS) if fixed else None
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
    from sphero_probe.cli.parse import hex_bytes, is_hex

    if not inputs:
        if sys.stdin.isatty():
            raise UsageError("nothing to decode", "give hex bytes, a file, or - for standard input")
        inputs = ("-",)
    if all(is_hex(text) for text in inputs):
        yield (hex_bytes("".join(inputs), "packet"), b"")
        return
    for text in inputs:
        if text == "-":
            yield _read(sys.stdin.buffer, "standard input")
        elif is_hex(text):
            yield (hex_bytes(text, "packet"), b"")
        else:
            try:
                with open(text, "rb") as file:  # noqa: PTH123 - pathlib would slow down --help
                    yield _read(file, text)
            except OSError as error:
                raise BadInputFileError(f"{text}: {error.strerror}", "give hex bytes or a file") from error


def _read(file: BinaryIO, name: str) -> Iterator[bytes]:
    """Yield a file's bytes as they come, hex text turned into what it stands for; ``b""`` at the end.

    What the first chunk looks like decides whether all is hex text.
    """
    read = getattr(file, "read1", file.read)
    chunks = iter(lambda: read(_CHUNK), b"")
    first = next(chunks, b"")
    if first and _HEX_TEXT.issuperset(first):
        yield from _unhexed(chain((first,), chunks), name)
    else:
        yield first
        yield from chunks
    yield b""


def _unhexed(texts: Iterable[bytes], name: str) -> Iterator[bytes]:
    """Yield the bytes that hex text stands for, wherever it was cut.

    Raises:
        BadInputFileError: something in it is no hex, or a digit is left at the end.
    """
    offset = 0
    cut = digits = b""
    for text in texts:
        held = cut + text
        wrong = _NOT_HEX.search(held)
        sound = held[: wrong.start()] if wrong else held
        cut = b"0" if sound.endswith(b"0") else b""  # of 0x, perhaps
        digits += _PREFIX.sub(b"", sound[: len(sound) - len(cut)]).translate(None, _BLANKS)
        even = len(digits) // 2 * 2
        whole, digits = digits[:even], digits[even:]
        if whole:
            yield bytes.fromhex(whole.decode("ascii"))
        offset += len(text)
        if wrong:
            where = offset - len(held) + wrong.start()
            raise BadInputFileError(
                f"{name}: byte 0x{wrong[0][0]:02x} at offset {where} is not hexadecimal",
                "hex text has digits, blanks, colons, commas, underscores and 0x, and nothing else",
            )
    digits += cut
    if len(digits) % 2:
        raise BadInputFileError(f"{name}: an odd number of hex digits", "two digits make a byte")
    if digits:
        yield bytes.fromhex(digits.decode("ascii"))
