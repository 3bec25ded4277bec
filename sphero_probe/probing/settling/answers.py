"""What evidence says about the answers of a robot: codes, lists, addresses, nodes."""

from collections import defaultdict
from typing import Final

from sphero_probe.catalogue import lookup
from sphero_probe.catalogue.addresses import BLE_PORT
from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.probing.evidence import Asked, Ending, Evidence, Topic
from sphero_probe.probing.notes import node_name
from sphero_probe.probing.settling.settlement import (
    Settlement,
    bytes_text,
    code_text,
    node_of,
    settled,
    told,
    unsettled,
)
from sphero_probe.protocol.address import Address
from sphero_probe.protocol.packets import Verdict

REPORTED_MISSING: Final = ((0x13, 0x27), (0x18, 0x52))
"""Commands of an RVR that some firmwares lack [Bura-hub/Atriz_migracion_ros2, evidence 41 and 42]."""
_SECOND: Final = 2
_RARE: Final = {
    Verdict.RESTRICTED: "restricted",
    Verdict.BAD_LENGTH: "bad data length",
    Verdict.BUSY: "busy",
}
_SHOWN: Final = 3
"""Examples that a text names."""


def rare_codes(evidence: Evidence) -> Settlement:
    """List the commands that got one of the codes that are said to be rare."""
    codec = evidence.codec
    on_demand = row_for(codec.generation, WellKnown.ERROR_ON_DEMAND)
    examples: dict[Verdict, dict[str, None]] = {verdict: {} for verdict in _RARE}
    for one in evidence.answers:
        verdict = codec.verdict(one.code or 0)
        if verdict in examples and not (on_demand and one.command[:2] == (on_demand.did, on_demand.cid)):
            did, cid, payload, *_ = one.command
            examples[verdict][f"0x{did:02x}:0x{cid:02x} with {bytes_text(len(payload))}"] = None
    if busy := sum(burst.busy for burst in evidence.bursts):
        examples[Verdict.BUSY][f"{busy} of the echoes that were sent at once"] = None
    said = [
        f"{words}: {', '.join(list(found)[:_SHOWN])}" + (", …" if len(found) > _SHOWN else "")
        for words, found in zip(_RARE.values(), examples.values(), strict=True)
        if found
    ]
    return settled("; ".join(said)) if said else unsettled("none of these codes was seen")


def own_lists(evidence: Evidence) -> Settlement:
    """Say what each node lists."""
    codec = evidence.codec
    devices = row_for(codec.generation, WellKnown.CLAIMED_DEVICES)
    said: dict[str, str] = {}
    for one in evidence.answers:
        if not devices or one.command[:2] != (devices.did, devices.cid) or one.command.payload:
            continue
        if codec.verdict(one.code or 0) is Verdict.OK and isinstance(one.data, bytes):
            said[node_of(evidence, one)] = f"devices {one.data.hex(' ') or 'none'}"
        else:
            said[node_of(evidence, one)] = f"answers {code_text(codec, one.code)}"
    return told(evidence, said, "the list of devices was not answered")


def codes_on_demand(evidence: Evidence) -> Settlement:
    """Say for each node and form of the request which codes came back."""
    codec = evidence.codec
    row = row_for(codec.generation, WellKnown.ERROR_ON_DEMAND)
    forms: defaultdict[str, list[Asked]] = defaultdict(list)
    for one in evidence.asked:
        is_it = row is not None and one.command[:2] == (row.did, row.cid) and len(one.command.payload) == 1
        if is_it and one.ending is not Ending.BLOCKED and one.topic in (Topic.CALIBRATION, Topic.CODES):
            forms[f"{node_of(evidence, one)} with 0x{one.flags or 0:02x}"].append(one)
    said: dict[str, str] = {}
    for form, asked in forms.items():
        wanted = {one.command.payload[0] for one in asked}
        came = {one.command.payload[0] for one in asked if one.code == one.command.payload[0]}
        if all(one.ending is Ending.SILENT for one in asked):
            said[form] = "no answer"
        elif len(wanted) > 1:
            said[form] = f"{len(came)} of {len(wanted)} codes as asked for"
        else:
            said[form] = f"answers {code_text(codec, asked[-1].code)}"
    return told(evidence, said, "0x10:0x09 was not asked")


def addresses(evidence: Evidence) -> Settlement:
    """Compare the addresses of answers with those of their commands, over Bluetooth LE.

    Codes on demand are left out, as some of those commands carry no source; so are answers for absent nodes.
    """
    codec, styles = evidence.codec, dict[str, None]()
    for one in evidence.answers:
        target = one.command.target
        if target is None or Address.from_byte(target).port != BLE_PORT or one.topic is Topic.CODES:
            continue
        if codec.verdict(one.code or 0) in (Verdict.NO_TARGET, Verdict.TARGET_UNAVAILABLE):
            continue
        if one.client is None and one.source is None:
            styles["answers carry no addresses"] = None
        elif one.client is None:
            styles["answers carry the source only"] = None
        else:
            swapped = (
                one.source is not None
                and Address.from_byte(one.source).node == Address.from_byte(target).node
            )
            styles["swapped" if swapped else "answers carry both addresses, not swapped"] = None
    if not styles:
        return unsettled("no command with a Bluetooth LE address was answered")
    return settled("; ".join(styles))


def second_node(evidence: Evidence) -> Settlement:
    """Look at the last answer to an echo that was sent to node 2."""
    codec = evidence.codec
    echo = row_for(codec.generation, WellKnown.ECHO)
    at = Address(BLE_PORT, _SECOND).byte
    sent = [
        one
        for one in evidence.asked
        if echo and one.command[:2] == (echo.did, echo.cid) and one.command.target == at
        if one.ending is not Ending.BLOCKED
    ]
    if not sent:
        return unsettled("no echo was sent to 0x12")
    if sent[-1].code is None:
        return settled("no answer to an echo at 0x12")
    if codec.verdict(sent[-1].code) is Verdict.OK:
        return settled("yes, an echo at 0x12 comes back")
    return settled(f"no, an echo at 0x12 is answered {code_text(codec, sent[-1].code)}")


def missing_commands(evidence: Evidence) -> Settlement:
    """Say which of the commands that public reports call missing are missing here."""
    codec, robot = evidence.codec, evidence.model
    said: dict[str, str] = {}
    for did, cid in REPORTED_MISSING:
        row = lookup(codec.generation, did, cid, robot)
        right = row.request.fixed_length if row and row.request else None
        for one in evidence.answers:
            if one.command[:2] == (did, cid) and len(one.command.payload) == right:
                said[f"0x{did:02x}:0x{cid:02x} on {node_of(evidence, one)}"] = code_text(codec, one.code)
    return told(evidence, said, "none of them was answered")


def measured_nodes(evidence: Evidence) -> Settlement:
    """Say which firmware each node has, and how it checks lengths."""
    robot = evidence.model
    said = {
        name: f"firmware {evidence.firmware_of(name)}, {node.strictness}"
        for node in evidence.nodes
        for name in (node_name(node.target, robot),)
    }
    return told(evidence, said, "no node was measured")
