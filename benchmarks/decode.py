"""Compares the command ``decode`` with the bare decoder, on a file with a simulated stream."""

import os
from collections.abc import Callable, Iterator
from functools import partial
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

from benchmarks.corpus import second_generation
from benchmarks.process import spent
from benchmarks.section import Line, Options, Remark, Section
from benchmarks.timing import race, ratio
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Generation, Role
from sphero_probe.reports import json_text

_READ = 1 << 16
_MOST = {"jsonl": 12.0, "jsonl without orjson": 16.0, "plain": 12.0, "csv": 12.0}
"""How many times the time of the bare decoder a format may take."""


def measure(options: Options) -> Iterator[Line | Remark]:
    """Yield the command's time relative to the bare decoder, and the memory that it needs."""
    corpus = second_generation(1500 if options.quick else 10_000)
    yield Remark(corpus.summary)
    with TemporaryDirectory() as folder:
        file = Path(folder) / "stream.bin"
        file.write_bytes(corpus.stream)
        tasks: dict[str, Callable[[], object]] = {
            name: partial(_command, file, name) for name in ("jsonl", "plain", "csv")
        }
        tasks["jsonl without orjson"] = partial(_command, file, "jsonl", orjson=False)
        tasks["bare"] = partial(_bare, file)
        seconds = race(tasks, options.rounds)
        for name, most in _MOST.items():
            rate = len(corpus.packets) / min(seconds[name])
            times = ratio(seconds[name], seconds["bare"])
            note = f"{rate:,.0f} packets/s"
            yield Line(f"decode --format {name}", "the bare decoder", times, ceiling=most, note=note)
        repeats = 10 if options.quick else 25
        file.write_bytes(corpus.stream * repeats)
        size = len(corpus.stream) * repeats / 1e6
        if peak := spent("decode", str(file), "--format", "jsonl").mebibytes:
            yield Line(
                f"decode of {size:.0f} MB in a process", "no peer", None, note=f"{peak:.0f} MiB at most"
            )


def _bare(file: Path) -> int:
    decoder = CODECS[Generation.V2].decoder(Role.OBSERVER)
    packets = 0
    with file.open("rb") as stream:
        while chunk := stream.read(_READ):
            packets += len(decoder.feed(chunk))
    return packets


def _command(file: Path, name: str, *, orjson: bool = True) -> None:
    arguments = ("decode", str(file), "--format", name, "-o", os.devnull)
    dumps = json_text.dumps if orjson else None
    with patch.object(json_text, "dumps", dumps):
        code = import_module("sphero_probe.cli.invoke").run(arguments)
    if code:
        raise RuntimeError(f"decode ended with {code}")


SECTION = Section("decode", "the command decode compared with the bare decoder, and its memory", measure)
