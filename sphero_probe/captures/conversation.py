"""Find the robots among the connections of a capture, and decode their packets from the ATT values."""

from collections import deque
from collections.abc import Iterator
from typing import Final, NamedTuple

from sphero_probe.captures.att import Attributes, Value
from sphero_probe.captures.channel import Channel, Heard, Trial
from sphero_probe.captures.packet import CapturedPacket, Connection
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Generation, Notification, Request, Response

_MAX_WAITING: Final = 4096
"""Packets that wait to be known as a robot's or not."""
_MAX_CHANNELS: Final = 256
"""Of one connection."""
_MAX_ASKED: Final = 256

_Place = tuple[bool | None, int | None, bool | None]
"""Owner and handle of a characteristic, and whether values go to the robot."""


class _Waiting(NamedTuple):
    time: int | None
    talk: "Conversation"
    place: _Place
    channel: Channel
    trial: Trial
    heard: Heard


class Conversation:
    """One connection: its attributes and its channels."""

    def __init__(self, number: int, peer: str | None, name: str | None) -> None:
        self.connection = Connection(number, peer, name)
        self.attributes = Attributes()
        self.channels: dict[_Place, Channel] = {}
        self.last: int | None = None
        self._asked: dict[tuple[Generation, int, int | None, int | None], Channel] = {}
        self._known = 0

    @property
    def spoken(self) -> Generation | None:
        """What its robot speaks, None where it has none so far."""
        return next((next(iter(one.trials)) for one in self.channels.values() if one.accepted), None)

    def channel(self, place: _Place) -> Channel | None:
        """Return the channel of a characteristic, made at its first use; None where there are too many."""
        found = self.channels.get(place)
        if found is None and len(self.channels) < _MAX_CHANNELS:
            found = self.channels[place] = Channel(place[2])
            if place[1] is not None and (uuid := self.attributes.uuids.get((place[0], place[1]))):
                found.told(uuid)
        return found

    def discovered(self) -> None:
        """Tell the channels what discovery has found since it was last asked."""
        if self.attributes.name and not self.connection.name:
            self.connection = self.connection._replace(name=self.attributes.name)
        if len(self.attributes.uuids) == self._known:
            return
        self._known = len(self.attributes.uuids)
        for (owner, handle, _), channel in self.channels.items():
            if handle is not None and (uuid := self.attributes.uuids.get((owner, handle))):
                channel.told(uuid)

    def match(self, channel: Channel, trial: Trial, heard: Heard) -> None:
        """Take both channels for a robot's where one answers what was asked on the other."""
        spoken = trial.generation
        match heard.packet:
            case Request(command=command, seq=seq):
                named = CODECS[spoken].answers_name_commands
                pair = (command.did, command.cid) if named else (None, None)
                if len(self._asked) >= _MAX_ASKED:
                    del self._asked[next(iter(self._asked))]
                self._asked[spoken, seq, *pair] = channel
            case Response(seq=seq, did=did, cid=cid):
                asking = self._asked.get((spoken, seq, did, cid))
                if not asking or (asking is channel and channel.to_robot is not None):
                    return
                if False not in {asking.accepted, channel.accepted}:
                    for one in (asking, channel):
                        if one.accepted is None:
                            one.accept(spoken)
            case Notification():
                pass


class Conversations:
    """Every connection of a capture.

    Packets leave in the order in which they were heard: one of a channel that is not yet known as a robot's
    holds back those behind it, ``_MAX_WAITING`` at most.

    Attributes:
        unanswered: valid frames on channels that were not taken for a robot's.
    """

    def __init__(self) -> None:
        self._waiting: deque[_Waiting] = deque()
        self.unanswered = 0

    def feed(self, talk: Conversation, time: int | None, value: Value) -> Iterator[CapturedPacket]:
        """Take the next value of a connection; yield the packets that are known to be a robot's by now."""
        place = (value.owner, value.handle, value.written)
        yield from self.bytes_heard(talk, time, place, value.data)

    def bytes_heard(
        self, talk: Conversation, time: int | None, place: _Place, data: bytes
    ) -> Iterator[CapturedPacket]:
        """Take the next bytes of a channel, as ``feed``."""
        talk.last = time
        channel = talk.channel(place)
        if channel is None or channel.accepted is False:
            return
        for trial in tuple(channel.trials.values()):
            for heard in trial.feed(data):
                if channel.accepted is None and not trial.valid:
                    continue  # damage before the first valid frame: most of it is foreign
                self._waiting.append(_Waiting(time, talk, place, channel, trial, heard))
                talk.match(channel, trial, heard)
        channel.give_up_early()
        yield from self.flush()

    def end(self, talk: Conversation) -> Iterator[CapturedPacket]:
        """Yield what is left of a connection that ended."""
        self._decide(talk)
        for place, channel in talk.channels.items():
            if channel.accepted:
                for trial in channel.trials.values():
                    for heard in trial.end():
                        self._waiting.append(_Waiting(talk.last, talk, place, channel, trial, heard))
        yield from self.flush()

    def flush(self) -> Iterator[CapturedPacket]:
        """Yield what need not wait any longer."""
        while self._waiting:
            time, talk, (_, handle, to_robot), channel, trial, heard = self._waiting[0]
            if channel.accepted is None:
                if len(self._waiting) < _MAX_WAITING:
                    return
                self._decide(talk)
            self._waiting.popleft()
            if channel.accepted and trial.generation in channel.trials:
                packet, parts, doubt = heard
                raw = CODECS[trial.generation].frame_of(packet)
                yield CapturedPacket(
                    time, talk.connection, to_robot, handle, parts, trial.generation, packet, raw, doubt
                )

    def _decide(self, talk: Conversation) -> None:
        ordered = sorted(
            talk.channels.values(), key=lambda one: -max(trial.valid for trial in one.trials.values())
        )
        for channel in ordered:
            before = channel.accepted
            channel.decide(talk.spoken)
            if before is None and not channel.accepted:
                self.unanswered += max(trial.valid for trial in channel.trials.values())
