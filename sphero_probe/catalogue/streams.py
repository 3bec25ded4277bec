"""Decodes sensor streams: remembers which sensors a robot was told to send, and names the numbers in them.

The payload of a streaming notification does not say which sensors its numbers come from; the last command
that set the masks does, or the one that configured a streaming service of RVR.
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
    """

    def __init__(self, generation: Generation, robot: Robot | None = None) -> None:
        """Begin with a robot that streams nothing.

        Args:
            generation: its protocol.
            robot: the model, which decides what the bits of a mask mean; None where it is not known.
        """
        self._codec = CODECS[generation]
        self._robot = robot
        self._masks = Masks()
        self._configured: Configurations = {}
        self._asked: dict[int, Command] = {}

    def executed(self, command: Command) -> None:
        """Note that the robot executed a command; one that sets no masks or services changes nothing."""
        generation = self._codec.generation
        self._masks = masks_after(generation, self._masks, command)
        if generation is Generation.V2:
            self._configured = configured_after(self._configured, command)

    def observe(self, packet: Packet) -> None:
        """Process a packet of recorded traffic, in the order in which the packets were sent.

        A command counts as executed once its response reports success, or at once if it asks for no response.
        """
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
        pair = (notification.did, notification.cid)
        if pair == DELIVER and generation is Generation.V2:
            return delivered_fields(self._configured, notification.payload, notification.source)
        if pair != STREAM_IDS[generation] or not any(self._masks):
            return None
        decoded = streaming_fields(generation, self._masks, notification.payload, self._robot)
        return decoded if decoded.fields else None
