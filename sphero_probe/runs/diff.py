"""Compare what two sides say about the commands of a robot: ``compare`` is the main function.

A command is matched by node, DID and CID. A difference needs a settled result on both sides: a command that
was blocked, not asked or inconclusive on one side is never a difference. This module is pure: no I/O, no
clock.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from enum import StrEnum
from typing import Final, NamedTuple

from sphero_probe.catalogue import ROBOTS, lookup
from sphero_probe.catalogue.model import CommandRow, Kind
from sphero_probe.catalogue.payload.layout import Layout
from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.errors import UsageError
from sphero_probe.protocol.address import PRIMARY
from sphero_probe.protocol.packets import Verdict
from sphero_probe.runs.sides import SETTLED, Answer, Entry, Key, Side, Standing


class Change(StrEnum):
    """How two sides differ in a command; the last three are no differences of the robots."""

    APPEARED = "appeared"
    DISAPPEARED = "disappeared"
    ANSWER = "changed_answer"
    """Another code, or an answer on one side only."""
    LAYOUT = "changed_layout"
    """Another length of the answer, or of the arguments that it accepts."""
    VALUE = "changed_value"
    RISK = "changed_risk"
    NAME = "changed_name"
    NEWLY_CERTAIN = "newly_certain"
    NO_LONGER_CERTAIN = "no_longer_certain"
    NOT_COMPARABLE = "not_comparable"


UNCERTAIN: Final = frozenset((Change.NEWLY_CERTAIN, Change.NO_LONGER_CERTAIN, Change.NOT_COMPARABLE))
"""Changes in what is known, which are no differences."""


class Difference(NamedTuple):
    """One change of one command.

    Attributes:
        change: its kind.
        key: node, DID and CID.
        before: what the first side says.
        after: what the second side says.
        request: the argument bytes whose answers differ, None where it is not about an answer.
        was: the decoded fields that differ, on the first side; for a changed value.
        now: the same on the second side.
    """

    change: Change
    key: Key
    before: Entry
    after: Entry
    request: bytes | None = None
    was: Mapping[str, object] = {}  # never changed
    now: Mapping[str, object] = {}  # never changed


class Values(StrEnum):
    """Which values of answers are compared."""

    NONE = "none"
    """Of two robots, each has values of its own."""
    STABLE = "stable"
    """Those that do not change by themselves; not the firmware's version, which is compared by itself."""
    ALL = "all"


class Diff(NamedTuple):
    """The result of a comparison.

    Attributes:
        before: the first side.
        after: the second side.
        values: which values of answers were compared.
        differences: in the order of node, DID, CID.
        uncertain: commands that could not be compared and exist on one side, or are certain on one side only.
        compared: commands with a settled result on both sides.
        not_compared: commands that one side or both do not settle.
    """

    before: Side
    after: Side
    values: Values
    differences: tuple[Difference, ...]
    uncertain: tuple[Difference, ...]
    compared: int
    not_compared: int

    @property
    def same_robot(self) -> bool:
        """Whether both sides are about one robot, by name and model."""
        return is_same_robot(self.before, self.after)

    @property
    def other_firmware(self) -> dict[str, tuple[str, str]]:
        """Node name -> both versions, where both sides tell a node's version and they differ."""
        old, new = self.before.firmware, self.after.firmware
        return {node: (old[node], new[node]) for node in old if node in new and old[node] != new[node]}

    @property
    def counts(self) -> dict[Change, int]:
        """Kind -> number of changes, without zeros."""
        counts = Counter(one.change for one in (*self.differences, *self.uncertain))
        return {change: counts[change] for change in Change if counts[change]}


def is_same_robot(before: Side, after: Side) -> bool:
    """Return whether both sides are about one robot, by name and model."""
    return bool(before.device) and (before.device, before.robot) == (after.device, after.robot)


def compare(before: Side, after: Side, *, values: bool = False) -> Diff:
    """Return the differences between two sides.

    Args:
        before: the first side.
        after: the second side.
        values: compare all values of answers, also volatile ones and those of two robots.

    Raises:
        UsageError: the sides are of different protocols, so that equal ids mean different commands.
    """
    if before.generation is not after.generation:
        spoken = f"{before.generation.value.upper()} and {after.generation.value.upper()}"
        raise UsageError(f"the two sides speak different protocols, {spoken}: no command is in both")
    before, after = _with_nodes_of(after, before), _with_nodes_of(before, after)
    mode = Values.ALL if values else Values.STABLE if is_same_robot(before, after) else Values.NONE
    changes: list[Difference] = []
    compared = not_compared = 0
    for key in before.entries.keys() | after.entries.keys():
        old, new = before.entry(key), after.entry(key)
        if old.standing in SETTLED and new.standing in SETTLED:
            compared += 1
            if old != new:
                known = lookup(after.generation, key[1], key[2], ROBOTS.get(after.robot))
                changes += _changes(key, old, new, known, mode)
        else:
            not_compared += 1
            if change := _uncertain(old, new):
                changes.append(Difference(change, key, old, new))
    changes.sort(key=_order)
    return Diff(
        before,
        after,
        mode,
        tuple(one for one in changes if one.change not in UNCERTAIN),
        tuple(one for one in changes if one.change in UNCERTAIN),
        compared,
        not_compared,
    )


def _with_nodes_of(other: Side, side: Side) -> Side:
    """Return a side without addresses as that of the primary node, where the other side names nodes."""
    if {key[0] for key in side.entries} != {None} or any(key[0] is None for key in other.entries):
        return side
    entries: dict[Key, Entry] = {(PRIMARY, did, cid): entry for (_, did, cid), entry in side.entries.items()}
    return side._replace(
        entries=entries, covers=lambda key: key[0] == PRIMARY and side.covers((None, *key[1:]))
    )


def _order(one: Difference) -> tuple[int, int, int, int, bytes]:
    node, did, cid = one.key
    return (-1 if node is None else node, did, cid, list(Change).index(one.change), one.request or b"")


def _uncertain(old: Entry, new: Entry) -> Change | None:
    """Return what an entry without a settled result on some side is worth showing as; None for nothing."""
    if new.standing is Standing.INCONCLUSIVE and old.standing in SETTLED:
        return Change.NO_LONGER_CERTAIN
    if old.standing is Standing.INCONCLUSIVE and new.standing in SETTLED:
        return Change.NEWLY_CERTAIN
    there = (Standing.EXISTS, Standing.SILENT)
    return Change.NOT_COMPARABLE if old.standing in there or new.standing in there else None


def _changes(
    key: Key, old: Entry, new: Entry, known: CommandRow | None, mode: Values
) -> Iterator[Difference]:
    """Yield the differences of a command that both sides settle."""
    both = (old.standing, new.standing)
    if both == (Standing.ABSENT, Standing.EXISTS):
        yield Difference(Change.APPEARED, key, old, new)
    elif both == (Standing.EXISTS, Standing.ABSENT):
        yield Difference(Change.DISAPPEARED, key, old, new)
    elif old.standing is not new.standing:
        yield Difference(Change.ANSWER, key, old, new)
    if both != (Standing.EXISTS, Standing.EXISTS):
        return  # an absent or silent command has no answer to compare
    for request in sorted(old.answers.keys() & new.answers.keys()):
        earlier, later = old.answers[request], new.answers[request]
        if earlier != later:
            yield from _answers(
                Difference(Change.ANSWER, key, old, new, request), earlier, later, known, mode
            )
    if old.risk is not None and new.risk is not None and old.risk is not new.risk:
        yield Difference(Change.RISK, key, old, new)
    if old.name != new.name:
        yield Difference(Change.NAME, key, old, new)


def _answers(
    difference: Difference, old: Answer, new: Answer, known: CommandRow | None, mode: Values
) -> Iterator[Difference]:
    """Yield how two answers to the same request differ."""
    if old.code != new.code:
        accepted = {verdict is Verdict.BAD_LENGTH for verdict in (old.verdict, new.verdict) if verdict}
        yield difference._replace(change=Change.LAYOUT) if len(accepted) > 1 else difference
        return
    layout = known.response if known and known.kind is Kind.COMMAND and old.verdict is Verdict.OK else None
    if mode is Values.STABLE and _is_version(known):
        mode = Values.NONE  # the versions are compared by themselves
    lengths = len(old.payload), len(new.payload)
    if lengths[0] != lengths[1] and not (layout and _varies(layout, *lengths)):
        yield difference._replace(change=Change.LAYOUT)
    elif found := _values(layout, old.payload, new.payload, mode):
        was, now = found
        yield difference._replace(change=Change.VALUE, was=was, now=now)


def _is_version(known: CommandRow | None) -> bool:
    """Return whether the answer is the firmware's version."""
    return known is not None and known == row_for(known.generation, WellKnown.VERSION)


def _varies(layout: Layout, *lengths: int) -> bool:
    """Return whether payloads of these lengths have one layout, with a list or text of any length."""
    return any(all(map(variant.accepts, lengths)) for variant in layout.variants)


def _values(
    layout: Layout | None, old: bytes, new: bytes, mode: Values
) -> tuple[dict[str, object], dict[str, object]] | None:
    """Return the fields that differ, None for no difference to tell; bytes of no layout have no fields."""
    if old == new or mode is Values.NONE or (mode is Values.STABLE and layout is None):
        return None
    if layout is None:
        return {}, {}
    volatile = {field.name for variant in layout.variants for field in variant.fields if field.volatile}
    before, after = layout.decode(old).fields, layout.decode(new).fields
    names = [
        name
        for name in before | after
        if before.get(name) != after.get(name) and (mode is Values.ALL or name not in volatile)
    ]
    if not names and mode is Values.STABLE:
        return None
    return {name: before.get(name) for name in names}, {name: after.get(name) for name in names}
