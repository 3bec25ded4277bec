"""Rows and columns of a comparison: both sides, the differences, what could not be compared, the counts.

Rows of type ``difference`` are the differences. Those of type ``uncertain`` have the same keys: commands that
are certain on one side only, which is no difference.
"""

from typing import Final

from sphero_probe.reports import phrases
from sphero_probe.reports.phrases import Data, hex_id, shown, spaced_hex
from sphero_probe.reports.rows import Row
from sphero_probe.reports.views import Column, View, both, record_only, table_only
from sphero_probe.runs.diff import Change, Diff, Difference
from sphero_probe.runs.sides import Entry, Side


def diff_row(diff: Diff) -> Row:
    """Return the first row of a comparison: which sides, and whether they are one robot with one firmware."""
    return Row(
        "diff",
        {
            "before": _side(diff.before),
            "after": _side(diff.after),
            "same_robot": diff.same_robot,
            "other_firmware": {node: list(both) for node, both in diff.other_firmware.items()},
            "values": diff.values.value,
        },
    )


def _side(side: Side) -> dict[str, object]:
    return {
        "source": side.source,
        "kind": side.kind,
        "robot": side.robot or None,
        "model": side.model or None,
        "device": side.device or None,
        "firmware": dict(side.firmware),
        "started": side.started or None,
        "complete": side.complete,
    }


def difference_row(difference: Difference, *, uncertain: bool = False) -> Row:
    """Return the row of a change; the keys of ``before`` and ``after`` are null where they do not apply."""
    node, did, cid = difference.key
    before, after, request = difference.before, difference.after, difference.request
    return Row(
        "uncertain" if uncertain else "difference",
        {
            "kind": difference.change.value,
            "node": node,
            "did": did,
            "cid": cid,
            "name": after.name if after.name is not None else before.name,
            "request": None if request is None else request.hex(),
            "before": _entry(before, request, difference.was),
            "after": _entry(after, request, difference.now),
        },
    )


def _entry(entry: Entry, request: bytes | None, fields: object) -> dict[str, object]:
    answer = next(iter(entry.answers.values()), None) if request is None else entry.answers.get(request)
    return {
        "standing": entry.standing.value,
        "code": answer.code if answer else None,
        "code_name": answer.code_name or None if answer else None,
        "payload": answer.payload.hex() if answer and answer.code is not None else None,
        "fields": fields,
        "name": entry.name,
        "risk": None if entry.risk is None else entry.risk.word,
        "note": entry.note,
    }


def count_row(diff: Diff) -> Row:
    """Return the last row of a comparison: how much differs, and how much could be compared."""
    return Row(
        "diff_summary",
        {
            "counts": {change.value: diff.counts.get(change, 0) for change in Change},
            "differences": len(diff.differences),
            "compared": diff.compared,
            "not_compared": diff.not_compared,
        },
    )


def diff_rows(diff: Diff) -> list[Row]:
    """Return all rows of a comparison."""
    return [
        diff_row(diff),
        *(difference_row(one) for one in diff.differences),
        *(difference_row(one, uncertain=True) for one in diff.uncertain),
        count_row(diff),
    ]


def change_word(kind: object) -> str:
    """Return a kind of change for people: ``changed answer``."""
    return shown(kind).replace("_", " ")


def before(data: Data) -> str:
    """Return what the first side says, as far as the kind of change is about it."""
    return _says(data.get("before"), data.get("kind"))


def after(data: Data) -> str:
    """Return what the second side says."""
    return _says(data.get("after"), data.get("kind"))


def _says(side: object, kind: object) -> str:
    if not isinstance(side, dict):
        return ""
    match kind:
        case Change.NAME.value:
            return shown(side.get("name")) or "no name"
        case Change.RISK.value:
            return shown(side.get("risk"))
        case Change.VALUE.value:
            return phrases.fields(side) or spaced_hex(side.get("payload"))
    standing = change_word(side.get("standing"))
    code = side.get("code")
    if code is None:
        return phrases.remarked(standing, side.get("note"))
    said = f"{hex_id(code)} {shown(side.get('code_name'))}"
    payload = shown(side.get("payload"))
    if kind == Change.LAYOUT.value and payload:
        said = f"{said}, {len(payload) // 2} bytes"
    return f"{standing}: {said}"


def robot_words(side: object) -> str:
    """Return a side in a phrase: ``last: Sphero BOLT SB-1B2C, firmware primary 5.0.2, 2025-11-21T…``."""
    if not isinstance(side, dict):
        return ""
    kinds = {"catalogue": "the catalogue", "fake": "what its firmware has", "claims": "what the robot lists"}
    who = " ".join(filter(None, (shown(side.get("model")) or "unknown model", shown(side.get("device")))))
    firmware = side.get("firmware")
    parts = [
        who,
        f"firmware {shown(firmware)}" if firmware else "",
        shown(side.get("started")) or kinds.get(shown(side.get("kind")), ""),
        "" if side.get("complete") else "incomplete",
    ]
    return f"{shown(side.get('source'))}: {', '.join(filter(None, parts))}"


def warnings(data: Data) -> list[str]:
    """Return what must be said first: that robots or firmwares differ."""
    sides = [side for key in ("before", "after") if isinstance(side := data.get(key), dict)]
    names = [" ".join(filter(None, (shown(side.get("model")), shown(side.get("device"))))) for side in sides]
    told = []
    devices = [side.get("device") for side in sides]
    models = [side.get("robot") for side in sides]
    if len(set(models)) > 1 or (all(devices) and len(set(devices)) > 1):
        told.append(f"Different robots: {' and '.join(names)}")
    firmware = data.get("other_firmware")
    if isinstance(firmware, dict) and firmware:
        changes = (
            f"{shown(node)} {' -> '.join(map(shown, versions))}"
            for node, versions in firmware.items()
            if isinstance(versions, list)
        )
        told.append(f"Different firmware: {', '.join(changes)}")
    return told


def ending(data: Data) -> str:
    """Return the counts in a sentence: ``5 differences in 3922 commands; 2681 could not be compared``."""
    count, compared, others = (shown(data.get(key)) for key in ("differences", "compared", "not_compared"))
    told = {"0": "No difference", "1": "1 difference"}.get(count, f"{count} differences")
    told = f"{told} in {compared} command{'s' * (compared != '1')}"
    return told if others == "0" else f"{told}; {others} could not be compared"


DIFFERENCES: Final = View(
    "difference",
    (
        Column("kind", "Change", lambda data: change_word(data.get("kind")), whole=True),
        both("node", "Node", whole=True),
        *record_only("did", "cid", show=hex_id),
        table_only("DID:CID", phrases.pair, whole=True),
        *record_only("name"),
        table_only("Name", lambda data: shown(data.get("name")) or "unknown"),
        *record_only("request", show=spaced_hex),
        Column("before", "Before", before),
        Column("after", "After", after),
    ),
    "No difference.",
)
"""The differences, one a line; the other rows of a comparison are for the table, markdown and JSON."""
