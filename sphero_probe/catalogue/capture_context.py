"""Completes the packets of a capture, from earlier packets and from the catalogue.

A V1 response does not say which command it answers, and a tap on a V2 line cannot always tell a command from
a notification: both sides send frames without an answer flag, and both may use the sequence number 0xFF.
"""

from sphero_probe.catalogue.commands import rows_of
from sphero_probe.catalogue.model import Kind, Robot
from sphero_probe.protocol.packets import Command, Generation, Notification, Packet, Request, Response
from sphero_probe.protocol.v2 import FLAG_ANSWER, FLAG_ONLY_ERRORS


class CaptureContext:
    """The history of one capture; feed it every packet in order."""

    def __init__(self, robot: Robot | None = None) -> None:
        """Start without any packets; ``robot`` is the model, None where it is not known."""
        self._robot = robot
        self._asked: dict[int, tuple[int, int]] = {}
        self._kinds_of: dict[tuple[Generation, int, int], set[Kind]] = {}

    def complete(self, generation: Generation, packet: Packet) -> Packet:
        """Return the packet, completed; its frame stays the same.

        A V1 response gets the ``did`` and ``cid`` of the last command with its SEQ that asked for an answer.
        A V2 frame that neither asks for an answer nor says who sent it becomes a command or a notification,
        whichever the catalogue lists for its DID and CID.
        """
        if isinstance(packet, Notification):  # most packets of a stream
            return self._complete_unsolicited(generation, packet)
        if isinstance(packet, Response) and packet.did is not None:
            return packet
        match packet:
            case Request(command=command, seq=seq) if generation is Generation.V1:
                if packet.wants_answer:
                    self._asked[seq] = (command.did, command.cid)
            case Response(seq=seq, did=None):
                did, cid = self._asked.get(seq, (None, None))
                return packet._replace(did=did, cid=cid)
            case Request(command=command) if not packet.flags & (FLAG_ANSWER | FLAG_ONLY_ERRORS):
                if command.target is None and self._kinds(generation, *command[:2]) == {Kind.NOTIFICATION}:
                    return _as_notification(packet)
        return packet

    def _complete_unsolicited(self, generation: Generation, packet: Notification) -> Packet:
        did, cid, _, source, target, seq, _ = packet
        if did is None or seq is None or (target is None and source is not None):
            return packet
        kinds = self._kinds(generation, did, cid)
        if kinds == {Kind.COMMAND} or (not kinds and target is not None):
            return _as_request(packet, did)
        return packet

    def _kinds(self, generation: Generation, did: int, cid: int) -> set[Kind]:
        known = self._kinds_of.get((generation, did, cid))
        if known is None:
            rows = rows_of(generation, did, cid)
            if self._robot:
                rows = tuple(row for row in rows if self._robot.key in row.nodes) or rows
            known = self._kinds_of[generation, did, cid] = {row.kind for row in rows}
        return known


def _as_request(packet: Notification, did: int) -> Request:
    command = Command(did, packet.cid, packet.payload, packet.target)
    return Request(command, packet.seq or 0, packet.source, packet.flags, wants_answer=False)


def _as_notification(packet: Request) -> Notification:
    did, cid, payload, target, _ = packet.command
    return Notification(did, cid, payload, packet.source, target, packet.seq, packet.flags)
