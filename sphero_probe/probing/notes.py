"""Make the notes of a run, from unsolicited packets, calibration profiles and executed commands."""

from collections.abc import Sequence
from datetime import datetime
from typing import Final

from sphero_probe.catalogue.model import Robot
from sphero_probe.link.exchange import LateResponse, Unsolicited
from sphero_probe.probing.finding import Note
from sphero_probe.probing.profiles import DeviceProfile, NodeProfile
from sphero_probe.protocol.address import Address
from sphero_probe.protocol.packets import Command, Malformed, Notification

EXECUTED: Final = "executed"
"""Kind of the note of a command that accepted a wrong length."""

SLOW: Final = 1.0
"""Seconds that an answer takes from which on a robot is called slow."""


def note_of(unsolicited: Unsolicited, described: dict[str, object]) -> Note:
    """Return the note on a notification, a late answer or a malformed frame.

    Args:
        unsolicited: what the robot sent.
        described: by ``describe_unsolicited``. All of it but ``kind`` becomes the note's details, so that a
            note has the keys of a packet.
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


def calibration_note(profile: NodeProfile, robot: Robot | None) -> Note:
    """Return the note on how strictly a node checks lengths."""
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


def evidence_note(target: int | None, devices: Sequence[DeviceProfile], robot: Robot | None) -> Note:
    """Return the note on how many documented commands of a node rejected a wrong length.

    Args:
        target: the node's address byte.
        devices: profiles of its devices.
        robot: the model, None if it is not known.
    """
    asked = sum(device.asked for device in devices)
    rejected = sum(device.rejected for device in devices)
    measured = sum(device.asked > 0 for device in devices)
    text = (
        f"{node_name(target, robot)}: {rejected} of {asked} documented commands in {measured} "
        f"{'device' if measured == 1 else 'devices'} reject surplus bytes"
    )
    data: dict[str, object] = {
        "target": target,
        "devices": [
            {
                "did": device.did,
                "exists": device.exists,
                "asked": device.asked,
                "refused": device.rejected,
                "to_impossible": {
                    str(length): answer and answer.code for length, answer in device.impossible.items()
                },
            }
            for device in devices
        ],
    }
    return Note("evidence", text, data)


def executed_note(command: Command, name: str, when: datetime) -> Note:
    """Return the note on a command that accepted a wrong length and was executed.

    Args:
        command: what was sent.
        name: the catalogue's name, empty for an unknown command.
        when: the time, in UTC.
    """
    at = when.isoformat(timespec="milliseconds").replace("+00:00", "Z")
    text = (
        f"0x{command.did:02x}:0x{command.cid:02x} {name or 'unknown command'} accepted "
        f"{len(command.payload)} zero bytes and was executed at {at}; "
        "no further wrong length is sent to this node"
    )
    data: dict[str, object] = {
        "target": command.target,
        "did": command.did,
        "cid": command.cid,
        "payload": command.payload.hex(),
        "time": at,
    }
    return Note(EXECUTED, text, data)


def slow_note(round_trip: float | None, most: float) -> Note | None:
    """Return the note that a robot answers slowly, None where it does not.

    Args:
        round_trip: seconds that an answer takes, None where none was timed.
        most: seconds that an answer is waited for at most.
    """
    if round_trip is None or round_trip < SLOW:
        return None
    text = f"answers take {round_trip:.1f} s: waiting up to {most:.0f} s for each"
    return Note("run", text, {"seconds": round(round_trip, 3), "at_most": most})


def node_name(target: int | None, robot: Robot | None) -> str:
    """Return the name of a node: ``primary``, ``secondary``, ``node 0x13``, ``robot``."""
    if target is None:
        return "robot"
    known = robot.nodes.get(Address.from_byte(target).node) if robot else None
    return known or f"node 0x{target:02x}"
