"""What a capture says of the probes in it: the number, the command and the verdict."""

import asyncio

from sphero_probe.link.events import Events, ProbeComment, ProbeCommented
from sphero_probe.probing.attempt import PreparedProbe
from sphero_probe.probing.finding import Finding, Record
from sphero_probe.probing.recorder import Recorder
from sphero_probe.protocol.packets import Command
from sphero_probe.reports.printable import visible


class CommentingRecorder:
    """Records as another recorder does, and tells the listeners of the link what each frame is for."""

    def __init__(self, recorder: Recorder, events: Events) -> None:
        """Take the recorder that keeps the records, and the events of the link."""
        self._recorder, self._events = recorder, events

    def intend(self, probe: PreparedProbe) -> None:
        """Record that a probe is about to be sent."""
        self._recorder.intend(probe)
        if self._events.wanted(ProbeCommented):
            name = probe.knowledge.name if probe.knowledge else None
            self._tell(
                ProbeComment(
                    probe.number, comment_of_probe(probe.number, probe.command, name), is_verdict=False
                )
            )

    def record(self, record: Record) -> None:
        """Record a heading, finding, note or summary."""
        self._recorder.record(record)
        if isinstance(record, Finding) and record.attempts and self._events.wanted(ProbeCommented):
            self._tell(ProbeComment(record.number, comment_of_finding(record), is_verdict=True))

    def _tell(self, comment: ProbeComment) -> None:
        self._events.tell(ProbeCommented, asyncio.get_running_loop().time(), comment)


def comment_of_probe(number: int, command: Command, name: str | None) -> str:
    """Return what a probe asks, in a line."""
    return f"probe {number}: 0x{command.did:02x}:0x{command.cid:02x} {name or 'unknown'}"


def comment_of_finding(finding: Finding) -> str:
    """Return the verdict of a probe, in a line."""
    code = "" if finding.code is None else f", 0x{finding.code:02x} {finding.code_name}"
    note = f", {visible(finding.note)}" if finding.note else ""
    return f"probe {finding.number}: {finding.outcome}{code}{note}"
