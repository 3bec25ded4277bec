"""Checks runs on strangers against the truth; returns the failures of each check."""

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from typing import Final

from sphero_probe.errors import NoAnswerError, SpheroProbeError
from sphero_probe.probing.finding import Confidence, Finding, Outcome, Record, Summary
from tests.support.strangers.commands import Effect, Row
from tests.support.strangers.firmware import Check
from tests.support.strangers.habits import Expect, Stranger
from tests.support.strangers.robot import Executed, Heard
from tests.support.strangers.runs import ABSENT_DEVICES, LONGEST, Ran, Triple, cids_of, triple_of
from tests.support.strangers.transport import TooManyWritesError

LONGEST_MUTE: Final = 30.0
"""Seconds that a run may take if no response matches."""
_ACTING: Final = (0x13, 0x16, 0x17)
"""Devices that sleep or move: without evidence nothing unknown is asked of them."""
_STOPS: Final = ((0x16, 0x01), (0x02, 0x30))
"""Raw motors and roll, which stop the motors when their arguments are zeros."""
_PARTLY: Final = 8
"""Commands of a device that must be named before all of them are wanted."""
_WRONG: Final = 11
"""Bytes of a probe at a wrong length, at least."""


def _spell(triple: Triple) -> str:
    return "node {} {:02x}/{:02x}".format(*triple)


def ends(ran: Ran) -> Iterator[str]:
    """Every run ends by itself, and with findings unless no response matches."""
    error = ran.error
    if isinstance(error, TimeoutError | TooManyWritesError):
        yield f"it does not end: {type(error).__name__} after {ran.seconds:.0f} s"
    elif Expect.MUTE not in ran.stranger.expect:
        if isinstance(error, SpheroProbeError):
            yield f"it ends early: {type(error).__name__}: {error}"
        elif error is None and not isinstance(ran.records[-1], Summary):
            yield "it ends without a summary"


def errors(ran: Ran) -> Iterator[str]:
    """Every error that is raised is one that the tool can explain."""
    error = ran.error
    if error and not isinstance(error, SpheroProbeError | TimeoutError | TooManyWritesError):
        yield f"{type(error).__name__}: {str(error)[:120]}"


def oddity(ran: Ran) -> Iterator[str]:
    """If no response matches, the run ends soon, and says what is odd."""
    if Expect.MUTE not in ran.stranger.expect:
        return
    if Expect.TOLERABLE in ran.stranger.expect and ran.error is None:
        return
    said = f"{ran.error} {getattr(ran.error, 'hint', '')}"
    if not isinstance(ran.error, NoAnswerError):
        yield f"no NoAnswerError, but {type(ran.error).__name__} after {ran.seconds:.0f} s"
    elif ran.seconds > LONGEST_MUTE:
        yield f"it took {ran.seconds:.0f} s"
    elif "answers nothing" in said or not re.search(ran.stranger.oddity, said):
        yield f"it does not name the oddity: {said[:100]}"


def harmless(ran: Ran) -> Iterator[str]:
    """Nothing without consent is executed, except one command of a device that gave no warning."""
    by_device: dict[tuple[int, int], list[Executed]] = {}
    for done in _unallowed(ran):
        by_device.setdefault((done.row.node, done.row.did), []).append(done)
    for device, executed in by_device.items():
        allowance = 1
        if any(done.row.name and done.row.effect > Effect.WRITE for done in executed):
            allowance, why = 0, "documented, so not to be asked at a wrong length"
        elif Expect.BLIND in ran.stranger.expect:
            continue
        else:
            why = _warning(ran.stranger, *device, executed)
            allowance = 0 if why else 1
        if len(executed) > allowance:
            ran_so_often = Counter(f"{_spell(done.row.triple)} {done.row.effect.name}" for done in executed)
            names = ", ".join(
                name + (f" {times} times" if times > 1 else "") for name, times in ran_so_often.items()
            )
            yield f"{names}; {why or 'once would do'}"


def _warning(stranger: Stranger, node: int, did: int, executed: Iterable[Executed]) -> str:
    """Return what could have warned of a device, nothing where nothing could."""
    firmware = stranger.firmware
    rows = [row for row in firmware.rows if (row.node, row.did) == (node, did)]
    asked = _evidence(rows)
    for row in asked:
        if firmware.check(row) in (Check.SURPLUS_IGNORED, Check.NONE):
            return f"{row.name} would have shown it"
    if not asked and did in _ACTING and not all(done.row.name for done in executed):
        return "a device that acts, and nothing in it is known to check lengths"
    return ""


def _evidence(rows: Iterable[Row]) -> list[Row]:
    """Return the commands that show at no risk how a device treats lengths."""
    return [row for row in rows if row.name and (row.effect is Effect.READ or row.idle)]


def _unallowed(ran: Ran) -> list[Executed]:
    """Return what was executed without consent; stopping the motors afterwards is allowed."""
    ledger = ran.robot.ledger
    return [
        done
        for number, done in enumerate(ledger)
        if done.unallowed
        and not (_is_stop(done) and any(other.row.effect > Effect.READ for other in ledger[:number]))
    ]


def _is_stop(done: Executed) -> bool:
    return done.row.pair in _STOPS and len(done.data) < _WRONG and not any(done.data)


def reported(ran: Ran) -> Iterator[str]:
    """A command executed without consent is reported as executed, and the run is incomplete."""
    if Expect.BLIND in ran.stranger.expect:
        return
    unallowed = _unallowed(ran)
    for done in unallowed:
        if not any(_names(record, done.row) for record in ran.records):
            yield f"{_spell(done.row.triple)} ran, and no record says so"
    if unallowed and _is_complete(ran):
        yield "something ran, and the run says that it is complete"


def _names(record: Record, row: Row) -> bool:
    """Whether a record says of a command that it was executed."""
    if isinstance(record, Finding):
        return record.command[:2] == row.pair and "execut" in f"{record.outcome} {record.note}"
    spelt = rf"0x{row.did:02x}[:/ ]+0x{row.cid:02x}|\b{row.did:02x}/{row.cid:02x}\b"
    text = str(record)
    return "execut" in text and bool(re.search(spelt, text, re.IGNORECASE))


def stops(ran: Ran) -> Iterator[str]:
    """Once a wrong length was answered with success, no unknown command of that node gets one any more."""
    first: dict[int, float] = {}
    for done in ran.robot.ledger:
        surprise = done.row.effect > Effect.READ and len(done.data) > done.row.longest
        if surprise and ran.robot.firmware.check(done.row) is not Check.AFTERWARDS:
            first.setdefault(done.row.node, done.known_at)
    later = [heard for heard in ran.robot.heard if heard.at > first.get(heard.node, LONGEST)]
    later = [heard for heard in later if len(heard.data) >= _WRONG and not _is_harmless(heard, ran)]
    if len(later) > ran.on_the_way:
        yield f"{len(later)} probes at a wrong length after the first surprise, {_spell(later[0][1:4])} first"


def _is_harmless(heard: Heard, ran: Ran) -> bool:
    """Whether a wrong length does nothing there: a read, or a pair that was called absent before."""
    row = next((row for row in ran.robot.firmware.rows if row.triple == heard[1:4]), None)
    if row and row.name:
        return row.effect is Effect.READ
    earlier = [other for other in ran.robot.heard if other[1:4] == heard[1:4] and other.at < heard.at]
    return any(other.said in (0x01, 0x02) for other in earlier)


def invented(ran: Ran) -> Iterator[str]:
    """What exists for certain does, or if no catalogue names it; hidden, ghost and unknown are so."""
    truth = ran.robot.truth
    for finding in ran.findings:
        sure = finding.confidence is Confidence.CERTAIN or finding.knowledge is None
        if finding.outcome is Outcome.EXISTS and sure and triple_of(finding) not in truth:
            yield f"{_spell(triple_of(finding))}: exists ({finding.confidence.value}), {finding.code_name}"
    for word in ("hidden", "unknown"):
        for triple in ran.comparison[word]:
            if triple not in truth:
                yield f"{_spell(triple)}: {word}"
    for triple in ran.comparison["ghost"]:
        if triple in truth:
            yield f"{_spell(triple)}: a ghost"


def lost(ran: Ran) -> Iterator[str]:
    """What exists is not called absent, what answers not silent, and every documented read is found."""
    truth = ran.robot.truth
    answered = {heard[1:4] for heard in ran.robot.heard if heard.said is not None}
    for finding in ran.findings:
        triple = triple_of(finding)
        if finding.outcome is Outcome.ABSENT and triple in truth:
            yield f"{_spell(triple)}: absent"
        elif finding.outcome is Outcome.SILENT and triple in answered:
            there = "" if triple in truth else ", which does not exist"
            yield f"{_spell(triple)}{there}: silent, and it answered"
    if ran.error or Expect.MEAGRE in ran.stranger.expect:
        return
    found = {triple_of(finding): finding for finding in ran.findings}
    for row in ran.robot.firmware.rows:
        word = found[row.triple].outcome if row.triple in found else Outcome.EXISTS
        if row.triple in found and "not confirmed" in found[row.triple].note:
            continue  # commands that cannot exist get the same answer
        if row.effect is Effect.READ and row.name and word is not Outcome.EXISTS:
            yield f"{_spell(row.triple)}: a documented read, {word.value}"


def doubt(ran: Ran) -> Iterator[str]:
    """Where nothing is in doubt, at most one finding in a hundred is; and every command is found."""
    if Expect.SURE not in ran.stranger.expect or ran.error:
        return
    asked = [finding for finding in ran.findings if finding.outcome is not Outcome.SKIPPED]
    open_ = [f for f in asked if f.outcome in (Outcome.INCONCLUSIVE, Outcome.SILENT)]
    if len(open_) > max(1, 0.01 * len(asked)):
        yield f"{len(open_)} of {len(asked)} inconclusive, {_spell(triple_of(open_[0]))}: {open_[0].note}"
    named = {triple_of(finding) for finding in ran.findings}
    for row in ran.robot.firmware.rows:
        device = row.node, row.did
        if (
            row.triple not in named
            and sum(triple[:2] == device and triple[2] in cids_of(ran.stranger) for triple in named) > _PARTLY
            and row.cid in cids_of(ran.stranger)
        ):
            yield f"{_spell(row.triple)}: exists, and no finding names it"
    exists = {triple_of(finding) for finding in ran.findings if finding.outcome is Outcome.EXISTS}
    for row in ran.robot.firmware.rows:
        kin = [other for other in ran.robot.firmware.rows if other.triple[:2] == row.triple[:2]]
        proved = len(_evidence(kin)) > 1 and not ran.stranger.firmware.older
        if proved and not row.name and row.triple in named - exists:
            yield f"{_spell(row.triple)}: exists in a device that checks lengths, and was not found"


def complete(ran: Ran) -> Iterator[str]:
    """A run that could not probe a part says so."""
    if Expect.INCOMPLETE in ran.stranger.expect and _is_complete(ran):
        yield "a part could not be asked, and the run says that it is complete"


def _is_complete(ran: Ran) -> bool:
    return any(isinstance(record, Summary) and record.complete for record in ran.records)


def compared(ran: Ran) -> Iterator[str]:
    """Hidden, ghost and unknown are complete, as far as findings tell."""
    if ran.kind != "discovery" or Expect.COMPARED not in ran.stranger.expect or ran.error:
        return
    firmware = ran.stranger.firmware
    exists = {triple_of(finding) for finding in ran.findings if finding.outcome is Outcome.EXISTS}
    claimed = {
        (node, did, cid)
        for node in {row.node for row in firmware.rows}
        for did, cids in firmware.claims(firmware.rows, node).items()
        for cid in cids
    }
    asked = {(node, did) for node, did, _ in map(triple_of, ran.findings)}
    unknown = {row.triple for row in firmware.rows if not row.name}
    withheld = {triple_of(finding) for finding in ran.findings if finding.outcome is Outcome.SKIPPED}
    due = {
        "hidden": exists - claimed,
        "ghost": {triple for triple in claimed - ran.robot.truth - withheld if triple[:2] in asked},
        "unknown": exists & unknown,
    }
    for word, triples in due.items():
        said = set(ran.comparison[word])
        named = {triple[:2] for triple in said}
        missing = sorted(triple for triple in triples - said if not _is_named_by_device(triple, named))
        if missing:
            yield f"{word}: {len(missing)} missing, {_spell(missing[0])} first"


def _is_named_by_device(triple: Triple, named: set[tuple[int, int]]) -> bool:
    """Whether a command of a device that is not there is as good as named: one of them is enough."""
    return triple[1] in ABSENT_DEVICES and triple[:2] in named


CHECKS: Final[dict[str, Callable[[Ran], Iterator[str]]]] = {
    check.__name__: check
    for check in (ends, errors, oddity, harmless, reported, stops, invented, lost, doubt, complete, compared)
}


def judge(runs: Iterable[Ran]) -> dict[str, list[str]]:
    """Return the failures of some runs, by check."""
    runs = list(runs)
    return {
        name: [f"{ran.kind}: {failure}" for ran in runs for failure in check(ran)]
        for name, check in CHECKS.items()
    }
