"""Writes the sections and sentences of a run's table, as raw text."""

from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import groupby
from typing import Final, NamedTuple

from sphero_probe.catalogue import DEVICE_NAMES
from sphero_probe.catalogue.model import Robot
from sphero_probe.probing.finding import Outcome
from sphero_probe.reports import phrases
from sphero_probe.reports.finding_line import MAYBE, NEW, Data, FindingLine, ids, whole_number
from sphero_probe.reports.phrases import shown
from sphero_probe.reports.selection import Selection

UNKNOWN: Final = "not in any catalogue"
_REMARKS_SHOWN: Final = 3
_REMARK_WORDS: Final = {
    "notification": ("notification", "notifications"),
    "late": ("late or unmatched response", "late or unmatched responses"),
    "malformed": ("malformed frame", "malformed frames"),
    "run": ("event of the run", "events of the run"),
}


class Section(NamedTuple):
    """Findings that belong together.

    Attributes:
        title: one line.
        lines: the findings, by number.
        crowd: if they are many, only their ids are shown.
    """

    title: str
    lines: tuple[FindingLine, ...]
    crowd: bool = False


def places(lines: Iterable[FindingLine]) -> list[str]:
    """Return the names of the nodes that have more than absent commands; of all nodes where none has."""
    nodes = {line.node for line in lines if line.outcome != Outcome.ABSENT}
    return sorted(nodes or {line.node for line in lines})


def sections(
    lines: Sequence[FindingLine], robot: Robot | None, selection: Selection | None = None
) -> list[Section]:
    """Return what is shown: the new commands first, then known, uncertain, silent and inconclusive ones.

    Where findings were selected, absent ones are shown too, and an order that goes across devices gives a
    single section.
    """
    if selection and selection.flat:
        sent = tuple(line for line in lines if line.outcome != Outcome.SKIPPED)
        order = "the slowest answer first" if selection.sort == "rtt" else "in the order of the run"
        return [Section(f"{_commands(sent)}, {order}", sent)] if sent else []
    exists = [line for line in lines if line.exists]
    new = tuple(line for line in exists if line.new)
    perhaps = tuple(line for line in lines if line.outcome == Outcome.EXISTS and line.maybe)
    known = sorted(
        (line for line in exists if line.name is not None),
        key=lambda line: (line.did, line.cid, line.node, line.number),
    )
    filtered = selection is not None and selection.filters
    absent = tuple(line for line in lines if filtered and line.outcome == Outcome.ABSENT)
    silent = tuple(line for line in lines if line.outcome == Outcome.SILENT)
    unsettled = tuple(line for line in lines if line.outcome == Outcome.INCONCLUSIVE)
    made = [Section(f"{NEW}: {_commands(new)}, {UNKNOWN}", new)]
    for did, group in groupby(known, key=lambda line: line.did):
        held = tuple(group)
        made.append(Section(f"{device_name(did, held, robot)} 0x{did:02x}".lstrip(), held))
    made += [
        Section(f"{MAYBE.capitalize()}: {_commands(perhaps)} that may exist", perhaps, crowd=True),
        Section(f"Silent: {_commands(silent)} without an answer", silent, crowd=True),
        Section(f"Inconclusive: {_commands(unsettled)} that could not be settled", unsettled, crowd=True),
        Section(f"Absent: {_commands(absent)}", absent, crowd=True),
    ]
    return [section for section in made if section.lines]


def device_name(did: int, lines: Iterable[FindingLine], robot: Robot | None) -> str:
    """Return a device's name from the robot's protocol, or from the names of its commands."""
    if robot:
        return DEVICE_NAMES[robot.generation].get(did, "")
    return next((line.name.partition(".")[0] for line in lines if line.name and "." in line.name), "")


def short_name(line: FindingLine, title: str) -> str:
    """Return a command's name, without the device if the section's title has it, and its arguments."""
    if line.name is None:
        return f"{UNKNOWN} {line.arguments}".rstrip()
    device, dot, rest = line.name.partition(".")
    name = rest if dot and title.startswith(f"{device} ") else line.name
    return f"{name} {line.arguments}".rstrip()


def crowds(lines: Iterable[FindingLine], *, apart: bool) -> list[tuple[str, list[str]]]:
    """Group many lines by their answer; return each answer with the ids."""
    alike: dict[str, list[FindingLine]] = {}
    for line in lines:
        alike.setdefault(phrases.remarked(line.says, line.remark), []).append(line)
    return [(says, ids(held, apart=apart)) for says, held in alike.items()]


def doubts(lines: Iterable[FindingLine]) -> list[str]:
    """Return why findings are marked ``maybe``, each reason once."""
    reasons = dict.fromkeys(line.note or "this is not certain" for line in lines if line.maybe)
    return [f"{MAYBE}: {reason}" for reason in reasons]


def not_shown(lines: Iterable[FindingLine], times: str) -> str:
    """Return the absent commands by code: ``Not shown: 231 x 0x02 bad command id``; empty for none."""
    codes = Counter(line.code or "absent" for line in lines if line.outcome == Outcome.ABSENT)
    counted = ", ".join(f"{count} {times} {code}" for code, count in sorted(codes.items()))
    return f"Not shown: {counted} (absent, or hidden from this client)" if counted else ""


def remarks(notes: Iterable[Data], times: str) -> list[str]:
    """Return a line for each kind of note, with the first few different texts."""
    kinds: dict[str, Counter[str]] = {}
    for note in notes:
        kinds.setdefault(shown(note.get("kind")), Counter())[shown(note.get("text"))] += 1
    told: list[str] = []
    for kind, texts in kinds.items():
        words = _REMARK_WORDS.get(kind, (f"{kind} note", f"{kind} notes"))
        total = texts.total()
        first = [
            f"{count} {times} {text}" if count > 1 else text
            for text, count in list(texts.items())[:_REMARKS_SHOWN]
        ]
        if len(texts) > _REMARKS_SHOWN:
            first.append(f"and {len(texts) - _REMARKS_SHOWN} more")
        told.append(f"{total} {words[total > 1]}: {', '.join(first)}")
    return told


def ending(summary: Data, lines: Sequence[FindingLine]) -> str:
    """Return the run in a sentence: ``256 probes: 12 exist, 244 absent; 260 frames sent in 1.2 s``."""
    held = summary.get("counts")
    counts = (
        {str(word): whole_number(count) for word, count in held.items()} if isinstance(held, dict) else {}
    )
    total = sum(counts.values())
    if not total:
        return "Nothing was asked: the run had no probes."
    exists = Outcome.EXISTS.value
    maybe = sum(line.maybe and line.outcome == exists for line in lines)
    counts = {exists: 0} | counts
    counts[exists] = max(0, counts[exists] - maybe)
    told = [
        f"{count} {phrases.counted_outcome(word)}"
        for word, count in (*counts.items(), (MAYBE, maybe))
        if count or word == exists
    ]
    seconds = summary.get("seconds")
    took = f" in {seconds:.1f} s" if isinstance(seconds, int | float) else ""
    frames = _counted(whole_number(summary.get("frames_sent")), "frame")
    return f"{_counted(total, 'probe')}: {', '.join(told)}; {frames} sent{took}"


def _commands(lines: Sequence[FindingLine]) -> str:
    return _counted(len(lines), "command")


def _counted(count: int, word: str) -> str:
    return f"{count} {word}" if count == 1 else f"{count} {word}s"
