"""The command line of the benchmark: runs the sections and prints their results as text or JSON lines."""

import argparse
import json
import pkgutil
import platform
import sys
from collections.abc import Iterator, Sequence
from importlib import import_module
from os import cpu_count

import benchmarks
from benchmarks.section import Line, Options, Remark, Section

_LEAST_ROUNDS = 7
_ROUGH = 2
"""Ratios from here on are printed with one decimal."""


def sections() -> dict[str, Section]:
    """Return every section in this folder, by name."""
    modules = [import_module(f"benchmarks.{found.name}") for found in _modules()]
    found = [module.SECTION for module in modules if hasattr(module, "SECTION")]
    return {section.name: section for section in found}


def main(arguments: list[str] | None = None) -> int:
    """Run the benchmark and print the results.

    Returns:
        0, also if a target was missed: a busy machine is not a bug.
    """
    known = sections()
    wanted = _parser(known).parse_args(arguments)
    options = Options(wanted.quick, wanted.rounds or (_LEAST_ROUNDS if wanted.quick else 15))
    show = _show_json if wanted.json else _show
    if not wanted.json:
        print(f"Python {platform.python_version()}, {platform.machine()}, {cpu_count()} cores")
        print(
            f"A ratio is the peer's time divided by ours: the median of {options.rounds} interleaved rounds,"
        )
        print("with the interquartile range in brackets. All inputs are simulated.")
    targets: list[Line] = []
    for name in wanted.only or known:
        if not wanted.json:
            print(f"\n{name}: {known[name].summary}")
        for entry in known[name].measure(options):
            show(name, entry)
            sys.stdout.flush()
            if isinstance(entry, Line) and entry.verdict:
                targets.append(entry)
    if targets and not wanted.json:
        _show_targets(targets)
    return 0


def _modules() -> Iterator[pkgutil.ModuleInfo]:
    return (found for found in pkgutil.iter_modules(benchmarks.__path__) if found.name != "__main__")


def _parser(known: dict[str, Section]) -> argparse.ArgumentParser:
    listed = "\n".join(f"  {section.name:10}{section.summary}" for section in known.values())
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks",
        description="Compare sphero-probe with its peers, interleaved in one process.",
        epilog=f"sections:\n{listed}\n\nThe peers come with: pip install -e '.[bench]'",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )

    def names(text: str) -> list[str]:
        chosen = text.split(",")
        unknown = ", ".join(name for name in chosen if name not in known)
        if unknown:
            raise argparse.ArgumentTypeError(f"no section {unknown}; known: {', '.join(known)}")
        return chosen

    def rounds(text: str) -> int:
        number = int(text)
        if number < 1:
            raise argparse.ArgumentTypeError("at least 1")
        return number

    parser.add_argument("--quick", action="store_true", help="small inputs, 7 rounds: under a minute")
    parser.add_argument("--only", type=names, metavar="NAME,...", help="these sections (default: all)")
    parser.add_argument("--rounds", type=rounds, metavar="N", help="rounds (default: 15, quick: 7)")
    parser.add_argument("--json", action="store_true", help="JSON lines instead of text")
    return parser


def _show(_: str, entry: Line | Remark) -> None:
    if isinstance(entry, Remark):
        print(f"  {entry.text}")
        return
    times = "-"
    if entry.ratio:
        median, low, high = entry.ratio
        digits = 1 if median >= _ROUGH else 2
        times = f"{median:.{digits}f}x [{low:.{digits}f}-{high:.{digits}f}]"
    bar = f"target {entry.bar:g}x {entry.verdict}".rstrip() if entry.bar is not None else ""
    if entry.ceiling is not None:
        bar = f"at most {entry.ceiling:g}x: {entry.verdict}"
    lost = f"peer: {entry.lost}" if entry.lost else "peer lost nothing" if entry.bar is not None else ""
    facts = "; ".join(filter(None, (bar, lost, entry.note)))
    print(f"  {entry.what:54} {entry.peer:22} {times:>20}  {facts}")


def _show_targets(entries: Sequence[Line]) -> None:
    """Print every target with its figure, those that were missed first."""
    missed = sum(entry.verdict == "missed" for entry in entries)
    counted = f"{len(entries) - missed} met, {missed} missed"
    print(f"\ntargets: {counted}; with small inputs or on a busy machine, more are missed")
    for entry in sorted(entries, key=lambda entry: entry.verdict, reverse=True):
        median = entry.ratio.median if entry.ratio else 0.0
        bar = f">= {entry.bar:g}" if entry.bar is not None else f"<= {entry.ceiling:g}"
        what = f"{entry.what} | {entry.peer}"
        print(f"  {entry.verdict:7} {median:7.4g}  {bar:>8}  {what}")


def _show_json(section: str, entry: Line | Remark) -> None:
    if isinstance(entry, Remark):
        print(json.dumps({"type": "remark", "section": section, "text": entry.text}))
        return
    whole = {"type": "line", "section": section, **entry._asdict(), "verdict": entry.verdict}
    whole["ratio"] = entry.ratio._asdict() if entry.ratio else None
    print(json.dumps(whole))


if __name__ == "__main__":
    sys.exit(main())
