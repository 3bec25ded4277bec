"""What is seen besides the findings, in words: asides and calibration profiles in, notes out."""

from sphero_probe.catalogue.model import Robot
from sphero_probe.link.exchange import LateResponse, Unsolicited
from sphero_probe.probing.calibration import Profile
from sphero_probe.probing.finding import Note
from sphero_probe.protocol.address import Address
from sphero_probe.protocol.packets import Malformed, Notification


def note_of(unsolicited: Unsolicited, described: dict[str, object]) -> Note:
    """Return the note that a notification, a late answer or a malformed frame leaves in a run.

    Args:
        unsolicited: what the robot sent.
        described: as ``describe_unsolicited`` does. All of it but ``kind`` becomes the note's details, so
            that a note has the keys of a packet; a late response has the kind ``late``.
    """
    details = {key: value for key, value in described.items() if key != "kind"}
    match unsolicited:
        case Notification(did=did, cid=cid):
            name = described.get("name", "unknown notification")
            return Note("notification", f"{_ids(did, cid)} {name}", details)
        case Malformed(reason=reason):
            return Note("malformed", reason, details)
        case LateResponse(response=response, earlier=earlier):
            kind = "foreign answer" if earlier is None else "late or repeated answer"
            to = _ids(*earlier.command[:2]) if earlier else _ids(response.did, response.cid)
            return Note(
                "late", " ".join(filter(None, (kind, to and f"to {to}", f"seq {response.seq}"))), details
            )


def _ids(did: int | None, cid: int | None) -> str:
    if cid is None:
        return ""
    return f"0x{cid:02x}" if did is None else f"0x{did:02x}:0x{cid:02x}"


def calibration_note(profile: Profile, robot: Robot | None) -> Note:
    """Return the note that says how strictly a node was found to check lengths."""
    node = node_name(profile.target, robot)
    return Note(
        "calibration",
        f"{node}: {profile.strictness} ({profile.why})",
        {
            "target": profile.target,
            "strictness": profile.strictness.value,
            "why": profile.why,
            "steps": [
                {
                    "did": step.command.did,
                    "cid": step.command.cid,
                    "bytes": len(step.command.payload),
                    "wanted": step.wanted,
                    "said": step.said,
                }
                for step in profile.steps
            ],
        },
    )


def node_name(target: int | None, robot: Robot | None) -> str:
    """Return a node as people call it: ``primary``, ``secondary``, ``node 0x13``, ``robot``."""
    if target is None:
        return "robot"
    known = robot.nodes.get(Address.from_byte(target).node) if robot else None
    return known or f"node 0x{target:02x}"
