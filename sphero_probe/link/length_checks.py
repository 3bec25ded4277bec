"""What was measured about length checks: which nodes and devices refuse a wrong length before they execute.

Firmware checks lengths handler by handler. So the evidence is kept per device, and one command that accepts a
wrong length ends wrong-length probing of its whole node.
"""

from collections import defaultdict
from typing import Final

from sphero_probe.protocol.packets import Command

REFUSALS_WANTED: Final = 2
"""Existing commands of a device that must refuse a wrong length before several unknown ones are in flight."""


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
        self._absent: set[Command] = set()
        self._refused: defaultdict[tuple[int | None, int], set[int]] = defaultdict(set)

    def trust(self, target: int | None) -> None:
        """Take in that every documented read asked on this node refused surplus bytes."""
        if target not in self._lenient:
            self._strict.add(target)
            self.revision += 1

    def distrust(self, target: int | None) -> None:
        """Take in that a command of this node accepted a wrong length; nothing takes that back."""
        self._strict.discard(target)
        self._lenient.add(target)
        self.revision += 1

    def suspend(self, target: int | None) -> None:
        """Take back the trust in a node that could not be measured to the end."""
        self._strict.discard(target)
        self.revision += 1

    def is_strict(self, target: int | None) -> bool:
        """Whether a wrong length is refused on this node, as far as was measured."""
        return target in self._strict

    def is_lenient(self, target: int | None) -> bool:
        """Whether a command of this node was seen to accept a wrong length."""
        return target in self._lenient

    def take_as_uninformative(self, target: int | None, did: int) -> None:
        """Take in that this device says yes to commands that cannot exist: its answers prove nothing."""
        self._uninformative.add((target, did))
        self.revision += 1

    def is_uninformative(self, target: int | None, did: int) -> bool:
        """Whether this device says yes to commands that cannot exist."""
        return (target, did) in self._uninformative

    def take_as_absent(self, command: Command) -> None:
        """Take in that the robot said of this pair, on this node, that it does not exist."""
        self._absent.add(command._replace(payload=b""))
        self.revision += 1

    def is_absent(self, command: Command) -> bool:
        """Whether the robot said of this pair, on this node, that it does not exist."""
        return command._replace(payload=b"") in self._absent

    def take_refusal(self, command: Command) -> None:
        """Take in that an existing command refused a wrong length."""
        refused = self._refused[command.target, command.did]
        if not refused:
            self.revision += 1
        refused.add(command.cid)

    def refusals(self, target: int | None, did: int) -> frozenset[int]:
        """Return the commands of a device that refused a wrong length."""
        return frozenset(self._refused.get((target, did), ()))
