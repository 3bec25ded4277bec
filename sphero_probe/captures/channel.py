"""One characteristic in one direction, or one direction of a serial line: does it speak Sphero?

Where discovery is in the capture, its UUID says so. Else the traffic does: valid frames in one direction and
answers to them in the other.
"""

from collections.abc import Iterator
from typing import Final, NamedTuple

from sphero_probe.captures.logs import may_start_frame
from sphero_probe.catalogue.gatt import PROFILES
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Generation, Malformed, Packet, Request, Role

_GIVEN_UP: Final = 16
"""Pieces of damage without one valid frame after which a channel is taken for another device's."""
_ENOUGH: Final = 2
"""Sound frames that tell a robot where nothing answers."""
_MAX_PARTS: Final = 64

_ROLES: Final = {True: Role.ROBOT, False: Role.HOST, None: Role.OBSERVER}


class Heard(NamedTuple):
    """A packet, the sizes of the values that carried it, and why it is in doubt, or empty."""

    packet: Packet
    parts: tuple[int, ...]
    doubt: str = ""


class Trial:
    """A channel read as one generation.

    Attributes:
        generation: which.
        valid: valid frames.
        damaged: damaged pieces.
    """

    def __init__(self, generation: Generation, to_robot: bool | None) -> None:
        self.generation = generation
        self.valid = self.damaged = 0
        self._codec = CODECS[generation]
        self._decoder = self._codec.decoder(_ROLES[to_robot])
        self._parts: tuple[int, ...] = ()
        self._flags = {self._codec.unchecked_flags}
        self._held = 0

    def feed(self, data: bytes) -> list[Heard]:
        """Return the packets that a value completes."""
        parts = (*self._parts[-_MAX_PARTS:], len(data))
        packets = self._decoder.feed(data)
        self._parts = () if packets else parts
        heard = self._counted(packets, parts, len(data))
        if self._codec.unchecked_flags is None:
            return heard
        self._held += len(data) - sum(len(self._codec.frame_of(packet)) for packet in packets)
        rest = data[len(data) - self._held :] if 0 < self._held <= len(data) else b""
        return list(self._doubted(heard, rest))

    def end(self) -> list[Heard]:
        """Return what the end of the connection leaves."""
        return self._counted(self._decoder.give_up(), self._parts, 0)

    def _doubted(self, heard: list[Heard], rest: bytes) -> Iterator[Heard]:
        """Yield packets with what is doubtful about them; ``rest`` is what follows the last in its value."""
        damaged = [isinstance(packet, Malformed) for packet, *_ in heard]
        damaged = [False, *damaged, bool(rest) and not may_start_frame(rest)]
        for at, each in enumerate(heard, 1):
            packet = each.packet
            doubt = ""
            if isinstance(packet, Request) and packet.flags not in self._flags:
                self._flags.add(packet.flags)
                doubt = "flags that no checksum covers, for the first time on this connection"
            if damaged[at - 1] or damaged[at + 1]:
                doubt = "next to damaged bytes"
            yield each._replace(doubt="" if damaged[at] else doubt)

    def _counted(self, packets: list[Packet], parts: tuple[int, ...], size: int) -> list[Heard]:
        bad = sum(isinstance(packet, Malformed) for packet in packets)
        self.damaged += bad
        self.valid += len(packets) - bad
        return [Heard(packet, parts if not at else (size,)) for at, packet in enumerate(packets)]


class Channel:
    """What is known of one direction of one characteristic.

    Attributes:
        accepted: True once it is a robot's, False once it is not, None before.
        trials: the generations that it may be; one once it is accepted.
    """

    def __init__(self, to_robot: bool | None) -> None:
        """Start with both generations possible."""
        self.to_robot = to_robot
        self.accepted: bool | None = None
        self.trials = {generation: Trial(generation, to_robot) for generation in PREFERRED}

    def told(self, uuid: str) -> None:
        """Take what discovery says: the UUID of the characteristic."""
        fitting = (each for each in PROFILES if uuid in _ways(each.commands, each.answers, self.to_robot))
        profile = next(fitting, None)
        if profile:
            self.accept(profile.generation)
        elif self.accepted is None:
            self.accepted = False

    def accept(self, generation: Generation) -> None:
        """Take it for a robot's that speaks this generation."""
        self.accepted = True
        self.trials = {generation: self.trials[generation]}

    def give_up_early(self) -> None:
        """Take it for another device's once there is damage and nothing else."""
        if self.accepted is None and all(
            trial.damaged >= _GIVEN_UP and not trial.valid for trial in self.trials.values()
        ):
            self.accepted = False

    def decide(self, spoken: Generation | None) -> None:
        """Decide by what there is; ``spoken`` where another channel of the connection speaks it already."""
        if self.accepted is not None:
            return
        best = max(self.trials.values(), key=lambda trial: trial.valid)
        if best.valid >= (1 if best.generation is spoken else _ENOUGH) and best.valid > best.damaged:
            self.accept(best.generation)
        else:
            self.accepted = False


PREFERRED: Final = (Generation.V2, Generation.V1)
"""Where both read the same number of frames, the first wins."""


def _ways(commands: str, answers: str, to_robot: bool | None) -> tuple[str, ...]:
    return {True: (commands,), False: (answers,), None: (commands, answers)}[to_robot]
