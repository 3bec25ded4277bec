"""Make the notes of a run, from unsolicited packets, calibration profiles and executed commands."""

from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime
from typing import Final

from sphero_probe.catalogue import DEVICE_NAMES, devices_of
from sphero_probe.catalogue.model import Robot
from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.link.exchange import LateResponse, Unsolicited
from sphero_probe.probing.finding import Finding, Note
from sphero_probe.probing.profiles import DeviceProfile, NodeProfile
from sphero_probe.protocol.address import node_of
from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Command, Malformed, Notification, Verdict

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


def hung_note(target: int | None, since: datetime | None, robot: Robot | None) -> Note:
    """Return the note of a node that stopped answering and was given up.

    Args:
        target: the node's address byte.
        since: when it passed its last health check, in UTC; None where it never did.
        robot: the model, None where it is not known.
    """
    at = since.isoformat(timespec="milliseconds").replace("+00:00", "Z") if since else ""
    name = node_name(target, robot)
    why = (
        f"{name} stopped answering as before after {at} and did not recover"
        if at
        else f"{name} does not answer"
    )
    text = f"{why}: its open probes are inconclusive"
    return Note("run", text, {"target": target, "state": "hung", "since": at or None})


def tolerance_notes(tolerated: Mapping[str, int]) -> list[Note]:
    """Return a note for each way in which accepted answers differ from what they should be.

    Args:
        tolerated: the way in words -> how many answers did.
    """
    return [
        Note("run", f"answers were accepted although {words}", {"tolerated": words, "answers": count})
        for words, count in sorted(tolerated.items())
    ]


def unavailable_notes(findings: Iterable[Finding], codec: Codec, robot: Robot | None) -> list[Note]:
    """Return a note for each node that said to an echo that it is there, but unavailable."""
    echo = row_for(codec.generation, WellKnown.ECHO)
    return [
        _unavailable_note(finding.command.target, robot)
        for finding in findings
        if echo and finding.command[:2] == (echo.did, echo.cid)
        if finding.command.target is not None and finding.code is not None
        if codec.verdict(finding.code) is Verdict.TARGET_UNAVAILABLE
    ]


def _unavailable_note(target: int, robot: Robot | None) -> Note:
    """Return the note of a node that is there and was not asked further, as it is unavailable.

    Args:
        target: the node's address byte.
        robot: the model, None where it is not known; its catalogue names what was not asked.
    """
    devices = devices_of(robot, node_of(target))
    names = DEVICE_NAMES[robot.generation] if robot else {}
    listed = ", ".join(f"0x{did:02x} {names.get(did, '')}".rstrip() for did in devices)
    text = (
        f"{node_name(target, robot)} (0x{target:02x}) is there, but unavailable (0x0a): "
        f"its devices were not asked: {listed or 'which it has is not known'}"
    )
    return Note("run", text, {"target": target, "state": "unavailable", "devices_not_asked": list(devices)})


def node_name(target: int | None, robot: Robot | None) -> str:
    """Return the name of a node: ``primary``, ``secondary``, ``node 0x13``, ``robot``."""
    if target is None:
        return "robot"
    known = robot.nodes.get(node_of(target)) if robot else None
    return known or f"node 0x{target:02x}"
