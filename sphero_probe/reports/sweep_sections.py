"""A run in words: its rows come in, the sections and sentences of its table come out as raw text."""

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from typing import Final, NamedTuple

from sphero_probe.catalogue import DEVICE_NAMES
from sphero_probe.catalogue import ROBOTS as MODELS
from sphero_probe.catalogue.model import Robot
from sphero_probe.probing.finding import Confidence, Outcome
from sphero_probe.probing.notes import node_name
from sphero_probe.reports import phrases
from sphero_probe.reports.ids import pair_spans
from sphero_probe.reports.phrases import shown

Data = Mapping[str, object]

UNKNOWN: Final = "not in any catalogue"
NEW: Final = "NEW"
MAYBE: Final = "maybe"
_NAMED_AT_MOST: Final = 6
"""Withheld commands of one reason that are told with their names; of more, only the ids are."""
_DOTTED_NAME: Final = re.compile(r"\b[a-z]\w*\.[a-z]\w*\b", re.ASCII)
_REMARKS_SHOWN: Final = 3
_REMARK_WORDS: Final = {
    "notification": ("notification", "notifications"),
    "late": ("late or foreign answer", "late or foreign answers"),
    "malformed": ("malformed frame", "malformed frames"),
    "run": ("event of the run", "events of the run"),
}


class FindingLine(NamedTuple):
    """A finding as the table needs it.

    Attributes:
        number: place in the run.
        node: the node's name.
        did: device id.
        cid: command id.
        name: None where no catalogue knows the pair.
        outcome: the word.
        maybe: the word is not certain.
        code: what was answered, ``0x02 bad command id``, empty without an answer.
        says: the answer in words.
        note: a remark, or empty.
        rtt_ms: milliseconds, None without an answer.
    """

    number: int
    node: str
    did: int
    cid: int
    name: str | None
    outcome: str
    maybe: bool
    code: str
    says: str
    note: str
    rtt_ms: float | None

    @property
    def pair(self) -> str:
        """The ids as people write them."""
        return f"0x{self.did:02x}:0x{self.cid:02x}"

    @property
    def mark(self) -> str:
        """What is to be said before anything else, or nothing."""
        return MAYBE if self.maybe else NEW if self.new else ""

    @property
    def remark(self) -> str:
        """The note, unless it only says why the word is not certain."""
        return "" if self.maybe else self.note

    @property
    def new(self) -> bool:
        """It exists, and no catalogue knows it."""
        return self.name is None and self.outcome == Outcome.EXISTS.value


class Section(NamedTuple):
    """Findings that belong together.

    Attributes:
        title: one line.
        lines: the findings, by number.
        crowd: many of them are better told by their ids alone.
    """

    title: str
    lines: tuple[FindingLine, ...]
    crowd: bool = False


def _number(value: object) -> int:
    return value if isinstance(value, int) else 0


def robot_of(heading: Data | None) -> Robot | None:
    """Return the model that a run's heading names."""
    return MODELS.get(shown(heading.get("robot"))) if heading else None


def line_of(data: Data, robot: Robot | None) -> FindingLine:
    """Return a finding's row as a line."""
    target, rtt, code, name = data.get("target"), data.get("rtt_ms"), data.get("code"), data.get("name")
    return FindingLine(
        _number(data.get("number")),
        node_name(target if isinstance(target, int) else None, robot),
        _number(data.get("did")),
        _number(data.get("cid")),
        None if name is None else shown(name),
        shown(data.get("outcome")),
        data.get("confidence") == Confidence.MAYBE.value,
        "" if code is None else f"{phrases.hex_id(code)} {shown(data.get('code_name'))}",
        phrases.outcome(data),
        shown(data.get("note")),
        rtt if isinstance(rtt, int | float) else None,
    )


def heading_lines(heading: Data, places: Sequence[str], calibration: Sequence[str]) -> list[str]:
    """Return who was asked, what, by whose leave, when, and what calibration measured.

    Args:
        heading: the data of the run's row.
        places: the names of the nodes that were asked.
        calibration: a sentence for each node that was measured, as the run told it.
    """
    firmware, strictness = heading.get("firmware"), heading.get("strictness")
    versions = shown(firmware) if firmware else "not told"
    measured = list(calibration)
    if not measured and isinstance(strictness, dict):
        measured = [f"{node}: {shown(said)}" for node, said in strictness.items()]
    where = f" on {places[0]}" if len(places) == 1 else ""
    return [
        f"{shown(heading.get('model'))} {shown(heading.get('device'))}, firmware: {versions}",
        f"Plan {shown(heading.get('plan'))}{where}, allowed: {shown(heading.get('consent'))}",
        f"Started {shown(heading.get('started'))}, sphero-probe {shown(heading.get('tool_version'))}",
        *(f"Length check, {text}" for text in measured),
    ]


def calibration_lines(notes: Sequence[Data]) -> list[str]:
    """Return what calibration measured: a sentence for each node, and the last count of its evidence."""
    lines = [shown(note.get("text")) for note in notes if note.get("kind") == "calibration"]
    evidence = {str(note.get("target")): note for note in notes if note.get("kind") == "evidence"}
    return [*lines, *(shown(note.get("text")) for note in evidence.values())]


def sections(lines: Sequence[FindingLine], robot: Robot | None) -> list[Section]:
    """Return what is worth a line each: the new first, then the known, the silent, the unsettled."""
    exists = [line for line in lines if line.outcome == Outcome.EXISTS.value]
    new = tuple(line for line in exists if line.new and not line.maybe)
    perhaps = tuple(line for line in exists if line.new and line.maybe)
    known = sorted(
        (line for line in exists if line.name is not None), key=lambda line: (line.did, line.number)
    )
    silent = tuple(line for line in lines if line.outcome == Outcome.SILENT.value)
    unsettled = tuple(line for line in lines if line.outcome == Outcome.INCONCLUSIVE.value)
    made = [Section(f"{NEW}: {_commands(new)}, {UNKNOWN}", new)]
    for did, group in groupby(known, key=lambda line: line.did):
        held = tuple(group)
        made.append(Section(f"{device_name(did, held, robot)} 0x{did:02x}".lstrip(), held))
    made += [
        Section(f"{NEW}, {MAYBE}: {_commands(perhaps)}, {UNKNOWN}", perhaps, crowd=True),
        Section(f"Silent: {_commands(silent)} without an answer", silent, crowd=True),
        Section(f"Inconclusive: {_commands(unsettled)} that could not be settled", unsettled, crowd=True),
    ]
    return [section for section in made if section.lines]


def device_name(did: int, lines: Iterable[FindingLine], robot: Robot | None) -> str:
    """Return a device's name as the robot's protocol has it, or as the names of its commands tell it."""
    if robot:
        return DEVICE_NAMES[robot.generation].get(did, "")
    return next((line.name.partition(".")[0] for line in lines if line.name and "." in line.name), "")


def short_name(line: FindingLine, title: str) -> str:
    """Return a command's name without the device that its section's title tells."""
    if line.name is None:
        return UNKNOWN
    device, dot, rest = line.name.partition(".")
    return rest if dot and title.startswith(f"{device} ") else line.name


def crowds(lines: Iterable[FindingLine], *, apart: bool) -> list[tuple[str, list[str]]]:
    """Return many lines by what they have in common: what was said, and the ids."""
    alike: dict[str, list[FindingLine]] = {}
    for line in lines:
        alike.setdefault(phrases.remarked(line.says, line.remark), []).append(line)
    return [(says, ids(held, apart=apart)) for says, held in alike.items()]


def ids(lines: Iterable[FindingLine], *, apart: bool) -> list[str]:
    """Return the ids of many lines as ranges, after the name of their node where wanted."""
    pairs: dict[str, list[tuple[int, int]]] = {}
    for line in lines:
        pairs.setdefault(f"{line.node} " if apart else "", []).append((line.did, line.cid))
    return [f"{node}{span}" for node, held in pairs.items() for span in pair_spans(held)]


def withheld(lines: Iterable[FindingLine], times: str, *, apart: bool) -> list[tuple[str, list[str]]]:
    """Return what was not asked: ``3 x persist: … (--allow persist)`` and the ids, few of them with names.

    Reasons that differ only in the command they name are one.
    """
    reasons: dict[str, list[FindingLine]] = {}
    for line in lines:
        if line.outcome == Outcome.SKIPPED.value:
            reasons.setdefault(_DOTTED_NAME.sub("a documented command", line.note), []).append(line)
    told: list[tuple[str, list[str]]] = []
    for reason, held in sorted(reasons.items()):
        if len(held) <= _NAMED_AT_MOST and all(line.name for line in held):
            items = [
                f"{line.node} {line.pair} {line.name}" if apart else f"{line.pair} {line.name}"
                for line in held
            ]
        else:
            items = ids(held, apart=apart)
        told.append((f"{len(held)} {times} {reason}", items))
    return told


def doubts(lines: Iterable[FindingLine]) -> list[str]:
    """Return why what is marked ``maybe`` is not certain, each reason once."""
    reasons = dict.fromkeys(line.note or "this is not certain" for line in lines if line.maybe)
    return [f"{MAYBE}: {reason}" for reason in reasons]


def not_shown(lines: Iterable[FindingLine], times: str) -> str:
    """Return the absent ones by code: ``Not shown: 231 x 0x02 bad command id``, empty where there is none."""
    codes = Counter(line.code or "absent" for line in lines if line.outcome == Outcome.ABSENT.value)
    counted = ", ".join(f"{count} {times} {code}" for code, count in sorted(codes.items()))
    return f"Not shown: {counted} (or hidden)" if counted else ""


def latest(findings: Iterable[Data]) -> list[Data]:
    """Return the last finding of each number: what verifying found replaces what it verified."""
    last: dict[int | str, Data] = {}
    for at, data in enumerate(findings):
        number = data.get("number")
        last[number if isinstance(number, int) else f"without a number, {at}"] = data
    return list(last.values())


def remarks(notes: Iterable[Data], times: str) -> list[str]:
    """Return a line for each kind of note, with the first few different ones of it."""
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
    """Return the run in a sentence: ``256 probes in 1.2 s: 12 exist, 231 absent``."""
    held = summary.get("counts")
    counts = {str(word): _number(count) for word, count in held.items()} if isinstance(held, dict) else {}
    total = sum(counts.values())
    if not total:
        return "Nothing was asked: the run had no probes."
    maybe = sum(line.maybe for line in lines)
    words = {"exists": "exist", "skipped": "withheld"}
    told = [
        f"{count} {words.get(word, word)}" + (f" ({maybe} {MAYBE})" if word == "exists" and maybe else "")
        for word, count in counts.items()
        if count or word == Outcome.EXISTS.value
    ]
    probes, frames = _counted(total, "probe"), _counted(_number(summary.get("frames_sent")), "frame")
    seconds = summary.get("seconds")
    took = f" in {seconds:.1f} s" if isinstance(seconds, int | float) else ""
    return f"{probes}{took}, {frames} sent: {', '.join(told)}"


def _commands(lines: Sequence[FindingLine]) -> str:
    return _counted(len(lines), "command")


def _counted(count: int, word: str) -> str:
    return f"{count} {word}" if count == 1 else f"{count} {word}s"
