"""The format ``junit``: XML that Jenkins, GitLab, GitHub actions and other CI viewers read as test results.

A row is a test case. It fails where something is wrong: a difference, a command that was executed by
surprise, a failed check, an incomplete run. It is skipped where nothing was found out. Elements and
attributes are those of the schema junit-10.xsd, which the output of pytest follows, too. Control characters,
which XML 1.0 cannot hold, are written as escapes.
"""

import re
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Final, NamedTuple, TextIO
from xml.sax.saxutils import escape, quoteattr

from sphero_probe.catalogue import ROBOTS
from sphero_probe.catalogue.model import Robot
from sphero_probe.probing.finding import Outcome
from sphero_probe.probing.notes import EXECUTED, node_name
from sphero_probe.protocol.address import Address
from sphero_probe.reports import diff_rows, diff_sections, phrases
from sphero_probe.reports.checks import State
from sphero_probe.reports.phrases import Data, shown
from sphero_probe.reports.printable import visible
from sphero_probe.reports.registry import Style
from sphero_probe.reports.rows import Row
from sphero_probe.reports.run_ending import RunEnding
from sphero_probe.reports.views import View

_TOOL: Final = "sphero-probe"
_STARTED: Final = re.compile(r"(\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d)Z?", re.ASCII)
_Place = tuple[int | None, int | None, int | None]
"""Node, DID, CID."""


class _Case(NamedTuple):
    """A test case; raw text.

    Attributes:
        group: the class name, with dots.
        name: of the case.
        seconds: that it took, None where it took none.
        skipped: why nothing was found out, or empty.
        failures: what is wrong, each as its kind and a text.
        output: what was found, or empty.
    """

    group: str
    name: str
    seconds: float | None = None
    skipped: str = ""
    failures: tuple[tuple[str, str], ...] = ()
    output: str = ""


class JUnitReport:
    """Collects the rows and writes them at the end, because the counts come first."""

    def __init__(self, out: TextIO, view: View, style: Style) -> None:
        self._out = out
        self._view = view
        self._style = style
        self._ending = RunEnding()
        self._robot: Robot | None = None
        self._run: Data = {}
        self._diff: Data = {}
        self._seconds: object = None
        self._found: dict[object, tuple[_Place, _Case]] = {}
        self._wrong: dict[_Place, list[tuple[str, str]]] = {}
        self._names: dict[_Place, tuple[str, str]] = {}
        self._uncertain: list[tuple[_Place, _Case]] = []
        self._others: list[_Case] = []

    def add(self, row: Row) -> None:
        """Take a row and keep its case: the row of a finding is much larger."""
        self._ending.add(row)
        kind, data = row.type, row.data
        match kind:
            case "run":
                self._run, self._robot = data, ROBOTS.get(shown(data.get("robot")))
            case "diff":
                self._diff, self._robot = data, self._robot or diff_sections.robot_of(data)
            case "finding":
                place = _place(data, _node(data.get("target")))
                number = data.get("number")  # a later finding of a number replaces what it verified
                key = number if isinstance(number, int) else f"without a number, {len(self._found)}"
                self._found[key] = place, _finding(data, self._robot)
            case "difference":
                place = _place(data, data.get("node"))
                self._fail(place, data, shown(data.get("kind")), diff_sections.line(data, self._robot))
            case "note" if data.get("kind") == EXECUTED:
                node = _node(data.get("target"))
                self._fail(_place(data, node), data | {"node": node}, EXECUTED, shown(data.get("text")))
            case "uncertain":
                self._uncertain.append((_place(data, data.get("node")), _uncertain(data, self._robot)))
            case "summary":
                self._seconds = data.get("seconds")
                self._others.append(self._run_case(data))
            case "diff_summary":
                self._others.append(_Case(_TOOL, diff_rows.ending(data)))
            case "check":
                self._others.append(_check(data))
            case self._view.type:
                told = (column.render(data) for column in self._view.record_columns)
                self._others.append(_Case(f"{_TOOL}.{kind}", " ".join(filter(None, told))))

    def _fail(self, place: _Place, data: Data, kind: str, text: str) -> None:
        """Keep that something is wrong with a command."""
        _, name, node, _, _ = diff_sections.cells(data, self._robot)
        self._names.setdefault(place, (f"{_TOOL}.{node}", f"{phrases.pair(data)} {name}".strip()))
        self._wrong.setdefault(place, []).append((kind, text))

    def close(self) -> None:
        """Write the document."""
        cases = list(_distinct(self._cases()))
        failed = sum(bool(case.failures) for case in cases)
        skipped = sum(bool(case.skipped and not case.failures) for case in cases)
        seconds = self._seconds
        time = f' time="{seconds:.3f}"' if isinstance(seconds, int | float) else ""
        started = _STARTED.fullmatch(shown(self._run.get("started")))
        when = f' timestamp="{started[1]}"' if started else ""
        counts = f'tests="{len(cases)}" failures="{failed}" errors="0"'
        name = self._attribute(shown(self._run.get("plan")) or self._view.type)
        self._write('<?xml version="1.0" encoding="UTF-8"?>')
        self._write(f'<testsuites name="{_TOOL}" {counts}{time}>')
        self._write(f'<testsuite name={name} {counts} skipped="{skipped}"{time}{when}>')
        self._properties()
        for case in cases:
            self._case(case)
        self._write("</testsuite>\n</testsuites>")

    def _properties(self) -> None:
        """Write what the run or the comparison is about."""
        pairs = [(key, shown(value)) for key, value in self._run.items() if value not in (None, "", [], {})]
        if self._diff:
            pairs += [(key, diff_rows.robot_words(self._diff.get(key))) for key in ("before", "after")]
            pairs += [("warning", text) for text in diff_rows.warnings(self._diff)]
        if pairs:
            self._write("<properties>")
            for key, value in pairs:
                self._write(f"<property name={self._attribute(key)} value={self._attribute(value)}/>")
            self._write("</properties>")

    def _cases(self) -> Iterator[_Case]:
        """Yield the findings with what is wrong with them, and then the cases of all other rows."""
        wrong = dict(self._wrong)
        places = {place for place, _ in self._found.values()}
        for place, case in self._found.values():
            yield case._replace(failures=tuple(wrong.pop(place, ())))
        for place, failures in wrong.items():
            yield _Case(*self._names[place], failures=tuple(failures))
        yield from (case for place, case in self._uncertain if place not in places)
        yield from self._others

    def _run_case(self, summary: Data) -> _Case:
        if summary.get("complete"):
            return _Case(_TOOL, "the run is complete")
        return _Case(_TOOL, "the run is complete", failures=(("incomplete", self._ending.message()),))

    def _case(self, case: _Case) -> None:
        time = "" if case.seconds is None else f' time="{case.seconds:.3f}"'
        start = f"<testcase classname={self._attribute(case.group)} name={self._attribute(case.name)}{time}"
        if not (case.skipped or case.failures or case.output):
            self._write(f"{start}/>")
            return
        self._write(f"{start}>")
        if case.skipped and not case.failures:
            self._write(f"<skipped message={self._attribute(case.skipped)}/>")
        for kind, text in case.failures:
            message = self._attribute(text)
            self._write(
                f"<failure type={self._attribute(kind)} message={message}>{self._text(text)}</failure>"
            )
        if case.output:
            self._write(f"<system-out>{self._text(case.output)}</system-out>")
        self._write("</testcase>")

    def _write(self, text: str) -> None:
        self._out.write(f"{text}\n")

    def _attribute(self, text: str) -> str:
        return quoteattr(visible(text, limit=None, unicode=self._style.unicode))

    def _text(self, text: str) -> str:
        return escape(visible(text, limit=None, unicode=self._style.unicode))


def _distinct(cases: Iterable[_Case]) -> Iterator[_Case]:
    """Number cases of the same name: viewers show only one of them."""
    seen: Counter[tuple[str, str]] = Counter()
    for case in cases:
        seen[case[:2]] += 1
        count = seen[case[:2]]
        yield case if count == 1 else case._replace(name=f"{case.name} ({count})")


def _whole(value: object) -> int | None:
    return value if isinstance(value, int) else None


def _node(target: object) -> int | None:
    byte = _whole(target)
    return None if byte is None or not 0 <= byte <= 0xFF else Address.from_byte(byte).node


def _place(data: Data, node: object) -> _Place:
    return _whole(node), _whole(data.get("did")), _whole(data.get("cid"))


def _finding(data: Data, robot: Robot | None) -> _Case:
    outcome, rtt = data.get("outcome"), data.get("rtt_ms")
    node = node_name(_whole(data.get("target")), robot)
    said = phrases.remarked(f"{shown(outcome)}: {phrases.outcome(data)}", data.get("note"))
    unknown = outcome in (Outcome.SKIPPED.value, Outcome.INCONCLUSIVE.value, Outcome.SENT.value)
    return _Case(
        f"{_TOOL}.{node}.{phrases.hex_id(data.get('did'))}",
        f"{phrases.pair(data)} {shown(data.get('name')) or 'unknown'}",
        rtt / 1000 if isinstance(rtt, int | float) else None,
        f"{shown(outcome)}: {shown(data.get('note'))}" if unknown else "",
        output="" if unknown or outcome == Outcome.ABSENT.value else said,
    )


def _uncertain(data: Data, robot: Robot | None) -> _Case:
    pair, name, node, before, after = diff_sections.cells(data, robot)
    kind = diff_rows.change_word(data.get("kind"))
    return _Case(f"{_TOOL}.{node}", f"{pair} {name}", skipped=f"{kind}: {before} in A, {after} in B")


def _check(data: Data) -> _Case:
    told = " -> ".join(filter(None, (shown(data.get("seen")), shown(data.get("fix")))))
    name, state = shown(data.get("name")), data.get("state")
    failures = ((State.FAIL.value, told),) if state == State.FAIL.value else ()
    skipped = (told or State.SKIPPED.value) if state == State.SKIPPED.value else ""
    return _Case(f"{_TOOL}.check", name, None, skipped, failures, "" if failures or skipped else told)


def report(out: TextIO, *, view: View, style: Style) -> JUnitReport:
    """Open a report in this format."""
    return JUnitReport(out, view, style)
