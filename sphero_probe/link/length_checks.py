"""Record what was measured about length checks: which nodes and devices reject a wrong length.

Each command handler of a firmware checks lengths by itself. So the evidence is kept per device. One command
that accepts a wrong length ends wrong-length probing of its whole node.
"""

from collections import defaultdict
from typing import Final

from sphero_probe.protocol.packets import Command

REJECTIONS_WANTED: Final = 2
"""Existing commands of a device that must reject a wrong length before several unknown ones are in flight."""


class LengthChecks:
    """The evidence of one link, per node and per device of a node.

    Attributes:
        revision: changes whenever the evidence changes what may be sent.
    """

    def __init__(self) -> None:
        self.revision = 0
        self._strict: set[int | None] = set()
        self._lenient: set[int | None] = set()
        self._uninformative: set[tuple[int | None, int]] = set()
        self._absent: set[tuple[object, ...]] = set()
        self._rejected: defaultdict[tuple[int | None, int], set[int]] = defaultdict(set)

    def trust(self, target: int | None) -> None:
        """Record that every documented read that was sent to this node rejected surplus bytes."""
        if target not in self._lenient:
            self._strict.add(target)
            self.revision += 1

    def distrust(self, target: int | None) -> None:
        """Record that a command of this node accepted a wrong length; this is final."""
        self._strict.discard(target)
        self._lenient.add(target)
        self.revision += 1

    def suspend(self, target: int | None) -> None:
        """Withdraw the trust in a node whose measurement was not finished."""
        self._strict.discard(target)
        self.revision += 1

    def is_strict(self, target: int | None) -> bool:
        """Whether this node rejects a wrong length, as far as was measured."""
        return target in self._strict

    def is_lenient(self, target: int | None) -> bool:
        """Whether a command of this node was seen to accept a wrong length."""
        return target in self._lenient

    def mark_uninformative(self, target: int | None, did: int) -> None:
        """Record that this device accepts commands that cannot exist: its answers prove nothing."""
        self._uninformative.add((target, did))
        self.revision += 1

    def is_uninformative(self, target: int | None, did: int) -> bool:
        """Whether this device accepts commands that cannot exist."""
        return (target, did) in self._uninformative

    def mark_absent(self, command: Command) -> None:
        """Record that the robot called this command of this node absent."""
        if not self.is_absent(command):
            self._absent.add(_without_payload(command))
            self.revision += 1

    def is_absent(self, command: Command) -> bool:
        """Whether the robot called this command of this node absent."""
        return _without_payload(command) in self._absent

    def add_rejection(self, command: Command) -> None:
        """Record that an existing command rejected a wrong length."""
        rejected = self._rejected[command.target, command.did]
        if not rejected:
            self.revision += 1
        rejected.add(command.cid)

    def rejections(self, target: int | None, did: int) -> frozenset[int]:
        """Return the commands of a device that rejected a wrong length."""
        return frozenset(self._rejected.get((target, did), ()))


def _without_payload(command: Command) -> tuple[object, ...]:
    did, cid, _, target, options = command
    return did, cid, target, options
