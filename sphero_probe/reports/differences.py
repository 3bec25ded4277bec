"""Lists how the findings of a run differ from the robot's own list of commands and from the catalogue."""

from collections.abc import Mapping

from sphero_probe.reports.ids import pair_spans, spans
from sphero_probe.reports.phrases import shown


def differences(note: Mapping[str, object]) -> list[tuple[str, list[str]]]:
    """Return the differences in a comparison note, each as a title and ids."""
    source = shown(note.get("claimed_by"))
    titles = {
        "claimed_absent": f"claimed by {source}, absent on this firmware",
        "hidden": "hidden (exist, but not in the robot's list)",
        "ghost": "ghost (in the robot's list, but absent)",
        "unknown": "unknown (exist, but not in any catalogue)",
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
    devices = note.get("ghost_devices")
    dids = [
        did
        for device in (devices if isinstance(devices, list) else [])
        if isinstance(device, dict) and isinstance(did := device.get("did"), int)
    ]
    if dids:
        told.append(
            (
                f"{len(dids)} ghost device{'s' * (len(dids) > 1)} (in the robot's list, but absent)",
                spans(dids),
            )
        )
    return told
