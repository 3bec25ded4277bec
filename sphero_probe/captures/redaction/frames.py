"""The Sphero frames of one channel without the fields that the catalogue marks, and without copies of them.

A frame may be spread over several values. Its bytes go back into the same values. Only the last of them can
change its length, if the new checksum is escaped and the old one was not, or the other way round.
"""

from collections import deque
from collections.abc import Callable
from typing import Final

from sphero_probe.captures.redaction.pseudonyms import Pseudonyms, without_text
from sphero_probe.catalogue.capture_context import CaptureContext
from sphero_probe.catalogue.commands import rows_of
from sphero_probe.catalogue.model import NO_DEVICE, Kind
from sphero_probe.catalogue.payload.layout import Span
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import (
    Generation,
    Malformed,
    Notification,
    Packet,
    Request,
    Response,
    Role,
    Verdict,
)

_MAX_HELD: Final = 1 << 16
_ROLES: Final = {True: Role.ROBOT, False: Role.HOST, None: Role.OBSERVER}

Settle = Callable[[bytes], None]


def payload_of(packet: Packet) -> bytes:
    """Return the payload of a packet; none where it is damaged."""
    match packet:
        case Request(command=command):
            return command.payload
        case Malformed():
            return b""
        case _:
            return packet.payload


def identifying_spans(packet: Packet, generation: Generation) -> tuple[Span, ...]:
    """Return where the identifying fields are in the payload of a packet, completed from its context."""
    did: int | None
    match packet:
        case Request(command=command):
            did, cid, kind = command.did, command.cid, Kind.COMMAND
        case Response(did=int(did), cid=int(cid), code=code):
            kind = Kind.COMMAND
            if CODECS[generation].verdict(code) is not Verdict.OK:
                return ()
        case Notification(did=did, cid=cid):
            kind = Kind.NOTIFICATION
        case _:
            return ()
    rows = rows_of(generation, NO_DEVICE if did is None else did, cid)
    asked = isinstance(packet, Request)
    layouts = (row.request if asked else row.response for row in rows if row.kind is kind)
    found = (layout.identifying_spans(payload_of(packet)) for layout in layouts if layout)
    return next(filter(None, found), ())


def _is_understood(response: Response, generation: Generation) -> bool:
    """Whether it is sure what a completed response answers; V1 only where the payload fits as well."""
    if generation is Generation.V2:
        return True
    if response.did is None or response.cid is None:
        return False
    rows = rows_of(generation, response.did, response.cid)
    layouts = [row.response for row in rows if row.kind is Kind.COMMAND and row.response]
    return not response.payload or any(layout.accepts(len(response.payload)) for layout in layouts)


class _Part:
    """One value: how many of its bytes are still held, and what the others have become."""

    def __init__(self, size: int, settle: Settle) -> None:
        self.left, self.settle = size, settle
        self.made = b""


class FrameStream:
    """One direction of a characteristic, or of a serial line."""

    def __init__(
        self, generation: Generation, to_robot: bool | None, context: CaptureContext, pseudonyms: Pseudonyms
    ) -> None:
        """Start at the beginning of a connection.

        Args:
            generation: the protocol.
            to_robot: the direction, None for both.
            context: of the connection, shared by its directions.
            pseudonyms: of the file.
        """
        self._generation, self._context, self._pseudonyms = generation, context, pseudonyms
        self._decoder = CODECS[generation].decoder(_ROLES[to_robot])
        self._held = b""
        self._parts: deque[_Part] = deque()

    def feed(self, data: bytes, settle: Settle) -> None:
        """Take the next value; ``settle`` gets what stands for it, now or once its last frame is whole."""
        if not data:
            settle(data)
            return
        self._held += data
        self._parts.append(_Part(len(data), settle))
        self._take(self._decoder.feed(data))
        if len(self._held) > _MAX_HELD:
            self._give_up()

    def end(self) -> None:
        """Settle what is left at the end of the connection."""
        self._take(self._decoder.give_up())
        self._give_up()

    def _take(self, packets: list[Packet]) -> None:
        for packet in packets:
            raw = CODECS[self._generation].frame_of(packet)
            at = self._held.find(raw)
            if at >= 0:
                self._put(at, self._unreadable(self._held[:at]))
                self._put(len(raw), self._redacted(packet, raw))

    def _give_up(self) -> None:
        self._put(len(self._held), self._unreadable(self._held))

    def _redacted(self, packet: Packet, raw: bytes) -> bytes:
        if isinstance(packet, Malformed):
            return self._unreadable(raw)
        payload = payload_of(packet)
        made, at = b"", 0
        completed = self._context.complete(self._generation, packet)
        for field, start, end in identifying_spans(completed, self._generation):
            made += payload[at:start] + self._pseudonyms.value(field, payload[start:end])
            at = end
        made = self._pseudonyms.everywhere(made + payload[at:])
        if isinstance(completed, Response) and not _is_understood(completed, self._generation):
            made = without_text(made)  # it may be a name: a V1 response does not say what it answers
        if made == payload:
            return raw
        if isinstance(packet, Request):
            changed: Packet = packet._replace(command=packet.command._replace(payload=made))
        else:
            changed = packet._replace(payload=made)
        return CODECS[self._generation].frame_of(changed)

    def _unreadable(self, damaged: bytes) -> bytes:
        return without_text(self._pseudonyms.everywhere(damaged))

    def _put(self, size: int, new: bytes) -> None:
        """Replace the first bytes that are held."""
        self._held = self._held[size:]
        while size:
            part = self._parts[0]
            taken = min(size, part.left)
            size -= taken
            part.left -= taken
            part.made, new = (part.made + new[:taken], new[taken:]) if size else (part.made + new, b"")
            if not part.left:
                self._parts.popleft().settle(part.made)
