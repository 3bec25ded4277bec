"""What evidence says about the limits of a robot: its queue, its largest packets, its sleep."""

from typing import Final

from sphero_probe.catalogue import notification_row
from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.probing.evidence import Ending, Evidence, Heard, Topic
from sphero_probe.probing.settling.settlement import Settlement, bytes_text, code_text, settled, unsettled
from sphero_probe.protocol.packets import Verdict

_ASKED_ALONE: Final = frozenset({Topic.ORDER, Topic.LISTS, Topic.SIZES})
"""Parts of a run in which one command is in flight, and an answer other than busy is due."""


def queue_depth(evidence: Evidence) -> Settlement:
    """Find the largest burst of echoes that was answered completely."""
    full = [burst.sent for burst in evidence.bursts if burst.answered == burst.sent]
    cut = [burst for burst in evidence.bursts if burst.answered < burst.sent]
    if not full:
        return unsettled("no burst of echoes was answered completely")
    most = max(full)
    if not cut:
        return settled(f"at least {most}: that many echoes sent at once were all answered")
    first = min(cut, key=lambda burst: burst.sent)
    count = f"{first.answered} of {first.sent} echoes were answered, but"
    if first.sent < most:
        return unsettled(f"{count} all of {most} were")
    alone = [one for one in evidence.asked if one.topic in _ASKED_ALONE]
    if any(one.ending is Ending.SILENT for one in alone):
        return unsettled(f"{count} commands that were sent alone were lost, too")
    if first.busy and any(evidence.codec.verdict(one.code or 0) is Verdict.BUSY for one in alone):
        return unsettled(f"{count} commands that were sent alone were answered with busy, too")
    surplus = "answered with busy" if first.busy else "lost"
    rest = f"of {first.sent}, {first.answered} were, the rest was {surplus}"
    return settled(f"{most} echoes sent at once were all answered; {rest}")


def answer_order(evidence: Evidence) -> Settlement:
    """See whether the answers to the echoes of a burst came in their order."""
    bursts = [burst for burst in evidence.bursts if burst.answered > 1]
    if not bursts:
        return unsettled("no two echoes that were sent at once were answered")
    if late := [burst for burst in bursts if not burst.in_order]:
        return settled(f"no: not the answers to {late[0].sent} echoes")
    return settled(f"yes, up to {max(burst.sent for burst in bursts)} echoes at once")


def echo_size(evidence: Evidence) -> Settlement:
    """Find the largest echo that came back, and what the next one got."""
    codec = evidence.codec
    echo = row_for(codec.generation, WellKnown.ECHO)
    asked = [one for one in evidence.asked if echo and one.command[:2] == (echo.did, echo.cid)]
    came = [len(one.command.payload) for one in asked if one.data == one.command.payload and one.code == 0]
    if not came:
        return unsettled("no echo came back")
    most = max(came)
    beyond = [one for one in asked if len(one.command.payload) > most and one.ending is not Ending.BLOCKED]
    if not beyond:
        return settled(f"at least {most} bytes")
    size = min(len(one.command.payload) for one in beyond)
    last = [one for one in beyond if len(one.command.payload) == size][-1]
    got = "got no answer" if last.code is None else f"got {code_text(codec, last.code)}"
    return settled(f"{bytes_text(most)} come back; {size} {got}")


def chunk_size(evidence: Evidence) -> Settlement:
    """Say how large the pieces were in which the robot's bytes came."""
    if evidence.line not in ("ble", "fake"):
        return unsettled(f"the robot was reached over {evidence.line}, not over Bluetooth LE")
    if not evidence.chunks:
        return unsettled("nothing arrived")
    most, total = max(evidence.chunks), sum(evidence.chunks.values())
    single = evidence.chunks.get(1, 0)
    text = f"at most {bytes_text(most)} at once" + (
        f", {single} of {total} pieces are single bytes" if single else ""
    )
    if evidence.write_size is not None:
        text += f"; a write carries {evidence.write_size} bytes"
    return settled(text)


def sleep(evidence: Evidence) -> Settlement:
    """Say what happened while nothing was sent."""
    idle = evidence.idle
    if idle is None:
        return unsettled("it was not waited for: add --idle 400s")
    heard = ", ".join(f"{_name(evidence, one)} after {one.after:g} s" for one in idle.heard)
    notices = f"notifications: {heard}" if heard else "no notification"
    if idle.dropped:
        return settled(f"the link was lost after {idle.seconds:g} s; {notices}")
    if idle.awake is None:
        return unsettled(f"the wait ended after {idle.seconds:g} s; {notices}")
    if idle.awake:
        return unsettled(f"it was still awake after {idle.seconds:g} s; {notices}")
    return settled(f"asleep after {idle.seconds:g} s; {notices}")


def _name(evidence: Evidence, heard: Heard) -> str:
    """Return a notification's name, or its ids where no catalogue knows it."""
    row = notification_row(evidence.generation, heard.did, heard.cid, evidence.model)
    ids = f"0x{heard.cid:02x}" if heard.did is None else f"0x{heard.did:02x}:0x{heard.cid:02x}"
    return f"{ids} {row.name}" if row else ids
