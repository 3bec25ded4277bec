"""Writes the sections and sentences of a run's table, as raw text."""

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
from sphero_probe.reports import address_phrases, phrases
from sphero_probe.reports.ids import pair_spans
from sphero_probe.reports.phrases import shown

Data = Mapping[str, object]

UNKNOWN: Final = "not in any catalogue"
NEW: Final = "NEW"
MAYBE: Final = "maybe"
_NAMED_AT_MOST: Final = 6
"""Blocked commands of one reason that are shown with their names; of more, only the ids are shown."""
_DOTTED_NAME: Final = re.compile(r"\b[a-z]\w*\.[a-z]\w*\b", re.ASCII)
_NOT_ASKED: Final = re.compile(
    rf"(?<=: ){_DOTTED_NAME.pattern}(?:: documented, not (?:asked|sent)(?: at a wrong length)?)?(?= \()",
    re.ASCII,
)
"""A reason that is only a name, or a name and that it was not asked."""
_REMARKS_SHOWN: Final = 3
_REMARK_WORDS: Final = {
    "notification": ("notification", "notifications"),
    "late": ("late or unmatched response", "late or unmatched responses"),
    "malformed": ("malformed frame", "malformed frames"),
    "run": ("event of the run", "events of the run"),
}


class FindingLine(NamedTuple):
    """A finding as the table shows it.

    Attributes:
        number: place in the run.
        node: the node's name.
        did: device id.
        cid: command id.
        name: None where no catalogue knows the pair.
        outcome: as in the row.
        maybe: the outcome is not certain; only runs of version 0.1.0 have such findings.
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
        """The mark before the ids, or nothing."""
        return MAYBE if self.maybe else NEW if self.new else ""

    @property
    def remark(self) -> str:
        """The note, unless it only says why the outcome is not certain."""
        return "" if self.maybe else self.note

    @property
    def exists(self) -> bool:
        """Whether the command certainly exists."""
        return self.outcome == Outcome.EXISTS.value and not self.maybe

    @property
    def new(self) -> bool:
        """Whether it exists, and no catalogue has it."""
        return self.name is None and self.exists


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
        "; ".join(filter(None, (shown(data.get("note")), _answered_by(data, robot)))),
        rtt if isinstance(rtt, int | float) else None,
    )


def _answered_by(data: Data, robot: Robot | None) -> str:
    """Return which other node answered, empty where it is the one that was asked or none was asked for."""
    source = data.get("answered_by")
    if data.get("target") is None or not isinstance(source, int):
        return ""
    return f"answered by {node_name(source, robot)}" if address_phrases.answered_elsewhere(data) else ""


def places(lines: Iterable[FindingLine]) -> list[str]:
    """Return the names of the nodes that have more than absent commands; of all nodes where none has."""
    nodes = {line.node for line in lines if line.outcome != Outcome.ABSENT.value}
    return sorted(nodes or {line.node for line in lines})


def sections(lines: Sequence[FindingLine], robot: Robot | None) -> list[Section]:
    """Return what is shown: the new commands first, then known, uncertain, silent and inconclusive ones."""
    exists = [line for line in lines if line.exists]
    new = tuple(line for line in exists if line.new)
    perhaps = tuple(line for line in lines if line.outcome == Outcome.EXISTS.value and line.maybe)
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
        Section(f"{MAYBE.capitalize()}: {_commands(perhaps)} that may exist", perhaps, crowd=True),
        Section(f"Silent: {_commands(silent)} without an answer", silent, crowd=True),
        Section(f"Inconclusive: {_commands(unsettled)} that could not be settled", unsettled, crowd=True),
    ]
    return [section for section in made if section.lines]


def device_name(did: int, lines: Iterable[FindingLine], robot: Robot | None) -> str:
    """Return a device's name from the robot's protocol, or from the names of its commands."""
    if robot:
        return DEVICE_NAMES[robot.generation].get(did, "")
    return next((line.name.partition(".")[0] for line in lines if line.name and "." in line.name), "")


def short_name(line: FindingLine, title: str) -> str:
    """Return a command's name without the device, if the section's title has it."""
    if line.name is None:
        return UNKNOWN
    device, dot, rest = line.name.partition(".")
    return rest if dot and title.startswith(f"{device} ") else line.name


def crowds(lines: Iterable[FindingLine], *, apart: bool) -> list[tuple[str, list[str]]]:
    """Group many lines by their answer; return each answer with the ids."""
    alike: dict[str, list[FindingLine]] = {}
    for line in lines:
        alike.setdefault(phrases.remarked(line.says, line.remark), []).append(line)
    return [(says, ids(held, apart=apart)) for says, held in alike.items()]


def ids(lines: Iterable[FindingLine], *, apart: bool) -> list[str]:
    """Return the ids of many lines as ranges; the first of each node after the node's name if wanted."""
    pairs: dict[str, list[tuple[int, int]]] = {}
    for line in lines:
        pairs.setdefault(f"{line.node} " if apart else "", []).append((line.did, line.cid))
    return [
        span if at else f"{node}{span}"
        for node, held in pairs.items()
        for at, span in enumerate(pair_spans(held))
    ]


def blocked(lines: Iterable[FindingLine], times: str, *, apart: bool) -> list[tuple[str, list[str]]]:
    """Return what was blocked: ``3 x persist: … (--allow persist)`` and the ids, with names if they are few.

    Reasons that differ only in the command they name are merged.
    """
    reasons: dict[str, list[FindingLine]] = {}
    for line in lines:
        if line.outcome == Outcome.SKIPPED.value:
            reason = _NOT_ASKED.sub("documented, not asked", line.note)
            reasons.setdefault(_DOTTED_NAME.sub("a documented command", reason), []).append(line)
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
    """Return why findings are marked ``maybe``, each reason once."""
    reasons = dict.fromkeys(line.note or "this is not certain" for line in lines if line.maybe)
    return [f"{MAYBE}: {reason}" for reason in reasons]


def not_shown(lines: Iterable[FindingLine], times: str) -> str:
    """Return the absent commands by code: ``Not shown: 231 x 0x02 bad command id``; empty for none."""
    codes = Counter(line.code or "absent" for line in lines if line.outcome == Outcome.ABSENT.value)
    counted = ", ".join(f"{count} {times} {code}" for code, count in sorted(codes.items()))
    return f"Not shown: {counted} (absent, or hidden from this client)" if counted else ""


def latest(findings: Iterable[Data]) -> list[Data]:
    """Return the last finding of each number: verification replaces what it verified."""
    last: dict[int | str, Data] = {}
    for at, data in enumerate(findings):
        number = data.get("number")
        last[number if isinstance(number, int) else f"without a number, {at}"] = data
    return list(last.values())


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
    counts = {str(word): _number(count) for word, count in held.items()} if isinstance(held, dict) else {}
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
    frames = _counted(_number(summary.get("frames_sent")), "frame")
    return f"{_counted(total, 'probe')}: {', '.join(told)}; {frames} sent{took}"


def _commands(lines: Sequence[FindingLine]) -> str:
    return _counted(len(lines), "command")


def _counted(count: int, word: str) -> str:
    return f"{count} {word}" if count == 1 else f"{count} {word}s"
