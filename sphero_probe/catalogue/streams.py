"""Decodes sensor streams: remembers which sensors a robot was told to send, and names the numbers in them.

The payload of a streaming notification does not say which sensors its numbers come from; the last command
that set the masks does, or the one that configured a streaming service of RVR. Both are kept per node: each
node of a robot streams what it was told [sdk: RVR's node 1 and node 2 have different services].
"""

from sphero_probe.catalogue.model import Robot
from sphero_probe.catalogue.payload.layout import Decoded
from sphero_probe.catalogue.sensors import STREAM_IDS, Masks, masks_after, streaming_fields
from sphero_probe.catalogue.streaming_services import (
    DELIVER,
    Configurations,
    configured_after,
    delivered_fields,
)
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.address import WILDCARD, node_of
from sphero_probe.protocol.packets import (
    Command,
    Generation,
    Notification,
    Packet,
    Request,
    Response,
    Verdict,
)


class StreamDecoder:
    """Decodes the sensor streams of one robot.

    The commands that the robot executed come from exchanges (``executed``) or from recorded traffic
    (``observe``). Before the first of them, nothing is known to be streamed.

    Attributes:
        is_set_up: some sensors are streamed; otherwise, ``decode`` returns None.
    """

    def __init__(self, generation: Generation, robot: Robot | None = None) -> None:
        """Begin with a robot that streams nothing.

        Args:
            generation: its protocol.
            robot: the model, which decides what the bits of a mask mean; None where it is not known.
        """
        self._codec = CODECS[generation]
        self._robot = robot
        self._masks = {WILDCARD: Masks()}
        self._configured: Configurations = {}
        self._asked: dict[int, Command] = {}
        self.is_set_up = False

    def executed(self, command: Command) -> None:
        """Note that the robot executed a command; one that sets no masks or services changes nothing."""
        generation, node = self._codec.generation, node_of(command.target)
        told = {node: self._masks.get(node, self._masks[WILDCARD])} if node else self._masks
        self._masks |= {
            told_node: masks_after(generation, masks, command) for told_node, masks in told.items()
        }
        if generation is Generation.V2:
            self._configured = configured_after(self._configured, command)
        self.is_set_up = bool(self._configured) or any(any(masks) for masks in self._masks.values())

    def observe(self, packet: Packet) -> None:
        """Process a packet of recorded traffic, in the order in which the packets were sent.

        A command counts as executed once its response reports success, or at once if it asks for no response.
        """
        if isinstance(packet, Notification):  # most packets of a stream
            return
        if isinstance(packet, Response) and packet.seq not in self._asked:
            return
        match packet:
            case Request(command=command, seq=seq, wants_answer=True):
                self._asked[seq] = command
            case Request(command=command):
                self.executed(command)
            case Response(seq=seq, code=code, did=did, cid=cid):
                command_asked = self._asked.get(seq)
                if command_asked and (did, cid) in ((None, None), command_asked[:2]):
                    del self._asked[seq]
                    if self._codec.verdict(code) is Verdict.OK:
                        self.executed(command_asked)

    def decode(self, notification: Notification) -> Decoded | None:
        """Return what a streaming notification says; no payload makes this raise.

        Returns:
            The numbers by sensor, from ``streaming_fields`` or ``delivered_fields``; None for any
            other notification, and where no sensor is known to be streamed.
        """
        generation = self._codec.generation
        if not may_stream(generation, notification):
            return None
        if (notification.did, notification.cid) == DELIVER:
            return delivered_fields(self._configured, notification.payload, notification.source)
        masks = self._masks_of(notification.source)
        if not any(masks):
            return None
        decoded = streaming_fields(generation, masks, notification.payload, self._robot)
        return decoded if decoded.fields else None

    def _masks_of(self, source: int | None) -> Masks:
        """Return the masks of the node that streams; none where it may be one of several."""
        node = node_of(source)
        if node:
            return self._masks.get(node, self._masks[WILDCARD])
        streaming = {masks for masks in self._masks.values() if any(masks)}
        return streaming.pop() if len(streaming) == 1 else Masks()


def may_stream(generation: Generation, notification: Notification) -> bool:
    """Whether a notification holds sensor values whose names depend on earlier commands."""
    pair = (notification.did, notification.cid)
    return pair == STREAM_IDS[generation] or (pair == DELIVER and generation is Generation.V2)
