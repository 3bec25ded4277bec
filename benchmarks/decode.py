"""Compares the command ``decode`` with the bare decoder, on a file with a simulated stream."""

import os
import sys
from collections.abc import Callable, Iterator
from functools import partial
from importlib import import_module
from pathlib import Path
from subprocess import run
from tempfile import TemporaryDirectory
from unittest.mock import patch

from benchmarks.corpus import second_generation
from benchmarks.section import Line, Options, Remark, Section
from benchmarks.timing import race, ratio
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Generation, Role
from sphero_probe.reports import json_text

_READ = 1 << 16
_MOST = {"jsonl": 12.0, "jsonl without orjson": 16.0, "plain": 12.0, "csv": 12.0}
"""How many times the time of the bare decoder a format may take."""
_STATUS = Path("/proc/self/status")
_CHILD = f"""
import re, sys
from sphero_probe.cli.invoke import run
run(("decode", sys.argv[1], "--format", "jsonl", "-o", sys.argv[2]))
print(re.search("VmHWM: *\\t* *([0-9]+) kB", open("{_STATUS}").read())[1])
"""
"""A process that prints its own peak memory; on Linux, its parent gets a value that includes the parent."""


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
        if _STATUS.exists():
            repeats = 10 if options.quick else 25
            file.write_bytes(corpus.stream * repeats)
            size = len(corpus.stream) * repeats / 1e6
            peak = _peak_memory(file)
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


def _peak_memory(file: Path) -> float:
    """Return the largest resident size in MiB of a process that decodes a file."""
    command = (sys.executable, "-c", _CHILD, str(file), os.devnull)
    ran = run(command, capture_output=True, text=True, check=True)  # noqa: S603 - our own command
    return int(ran.stdout) / 1024


SECTION = Section("decode", "the command decode compared with the bare decoder, and its memory", measure)
