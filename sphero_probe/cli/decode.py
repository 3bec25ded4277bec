"""``decode``: hex bytes, files or standard input go in, packets come out; no robot is needed."""

import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, Final

import click

from sphero_probe.cli.options import output_options
from sphero_probe.cli.output import Output
from sphero_probe.errors import BadInputFileError, UsageError

if TYPE_CHECKING:
    from sphero_probe.protocol.packets import Generation, Packet

_CHUNK: Final = 1 << 16
_HEX_TEXT: Final = frozenset(b"0123456789abcdefABCDEFxX \t\r\n:,_")


@click.command("decode")
@click.argument("inputs", nargs=-1, metavar="[HEX | FILE | -]...")
@click.option("--v1", "generation", flag_value="v1", help="Take everything for V1.")
@click.option("--v2", "generation", flag_value="v2", help="Take everything for V2.")
@output_options
def command(output: Output, inputs: tuple[str, ...], generation: str | None) -> None:
    """Decode packets from hex bytes, files (binary or hex text) or standard input (-).

    V1 and V2 are told apart, also within one input. Bytes that are no packet are shown with the reason.

    Example: sphero-probe decode 8d0a131007cbd8
    """
    from sphero_probe.protocol import CODECS
    from sphero_probe.protocol.packets import Malformed
    from sphero_probe.reports.rows import packet_row
    from sphero_probe.reports.views import PACKETS

    good = bad = total = 0
    with output.report(PACKETS) as report:
        for stream in _streams(inputs):
            for size, spoken, packet in _packets(stream, generation):
                total += size
                if packet is None:
                    continue
                bad += isinstance(packet, Malformed)
                good += not isinstance(packet, Malformed)
                report.add(packet_row(packet, spoken, CODECS[spoken].frame_of(packet)))
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
    from sphero_probe.protocol.packets import Generation, Role
    from sphero_probe.protocol.recognition import Recogniser

    fixed = Generation(generation) if generation else None
    decoder = CODECS[fixed].decoder(Role.WITNESS) if fixed else None
    recogniser = Recogniser()
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
    from sphero_probe.cli.words import hex_bytes, is_hex

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
                with Path(text).open("rb") as file:
                    yield _read(file, text)
            except OSError as error:
                raise BadInputFileError(f"{text}: {error.strerror}", "give hex bytes or a file") from error


def _read(file: BinaryIO, name: str) -> Iterator[bytes]:
    """Yield a file's bytes in chunks, hex text turned into the bytes it stands for; ``b""`` at the end."""
    from sphero_probe.cli.words import hex_bytes

    first = file.read(_CHUNK)
    if first and _HEX_TEXT.issuperset(first):
        text = first + file.read()
        yield hex_bytes(text.decode("ascii", "replace"), name)
    else:
        while first:
            yield first
            first = file.read(_CHUNK)
    yield b""
