"""What a robot claims beside what was found: a comparison's details in, titles with ids out."""

from collections.abc import Mapping

from sphero_probe.reports.ids import pair_spans


def differences(note: Mapping[str, object]) -> list[tuple[str, list[str]]]:
    """Return what a comparison found, a title and ids each."""
    titles = {
        "hidden": "hidden: exists, but the robot does not claim it",
        "ghost": "ghost: claimed, but absent",
        "unknown": "unknown: exists, and is in no catalogue",
    }
    told: list[tuple[str, list[str]]] = []
    for key, title in titles.items():
        listed = note.get(key)
        pairs = [
            (did, cid)
            for pair in (listed if isinstance(listed, list) else [])
            if isinstance(pair, dict)
            and isinstance(did := pair.get("did"), int)
            and isinstance(cid := pair.get("cid"), int)
        ]
        if pairs:
            told.append((f"{len(pairs)} {title}", pair_spans(dict.fromkeys(pairs))))
    return told
