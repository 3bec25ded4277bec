"""What is seen besides the findings, in words: asides and calibration profiles in, notes out."""

from sphero_probe.catalogue import notification_row
from sphero_probe.catalogue.model import Robot
from sphero_probe.link.exchange import LateResponse, Unsolicited
from sphero_probe.probing.calibration import Profile
from sphero_probe.probing.finding import Note
from sphero_probe.protocol.address import Address
from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Malformed, Notification


def note_of(unsolicited: Unsolicited, codec: Codec, robot: Robot | None) -> Note:
    """Return the note that a notification, a late answer or a malformed frame leaves."""
    match unsolicited:
        case Notification(did=did, cid=cid, payload=payload, source=source):
            row = notification_row(codec.generation, did, cid, robot)
            name = row.name if row else "unknown notification"
            fields = row.response.decode(payload).fields if row and row.response else {}
            ids = f"0x{cid:02x}" if did is None else f"0x{did:02x}:0x{cid:02x}"
            data: dict[str, object] = {
                "did": did,
                "cid": cid,
                "source": source,
                "name": row.name if row else None,
                "payload": payload.hex(),
                "fields": fields,
            }
            return Note("notification", f"{ids} {name}", data)
        case Malformed(raw=raw, reason=reason):
            return Note("malformed", reason, {"raw": raw.hex(), "reason": reason})
        case LateResponse(response=response, received=received, earlier=earlier):
            kind = "foreign answer" if earlier is None else "late or repeated answer"
            return Note(
                "late",
                f"{kind} to 0x{response.did or 0:02x}:0x{response.cid or 0:02x} seq {response.seq}",
                {
                    "did": response.did,
                    "cid": response.cid,
                    "seq": response.seq,
                    "code": response.code,
                    "received": received.hex(),
                },
            )


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
