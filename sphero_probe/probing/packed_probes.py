"""Very many probes in little memory: a stage may have one for every command of a robot."""

from array import array
from collections.abc import Iterable, Iterator, Sequence
from typing import overload

from sphero_probe.probing.plan import Probe
from sphero_probe.protocol.packets import Command, SendOptions


class PackedProbes(Sequence[Probe]):
    """Probes in eight bytes each, where they differ in little but their ids; each is made when it is read.

    A probe is packed as its kind, which is all but its ids, then DID and CID, one byte each.
    """

    def __init__(self, probes: Iterable[Probe]) -> None:
        """Take the probes.

        Args:
            probes: whose device and command ids are from 0 to 255.
        """
        kinds: dict[tuple[bytes, int | None, SendOptions, bool], int] = {}
        self._packed = array("Q")
        for (did, cid, payload, target, options), exact in probes:
            kind = kinds.setdefault((payload, target, options, exact), len(kinds))
            self._packed.append(kind << 16 | did << 8 | cid)
        self._kinds = list(kinds)

    def __len__(self) -> int:
        return len(self._packed)

    def __iter__(self) -> Iterator[Probe]:
        return map(self._probe, self._packed)

    @overload
    def __getitem__(self, place: int) -> Probe: ...
    @overload
    def __getitem__(self, place: slice) -> list[Probe]: ...
    def __getitem__(self, place: int | slice) -> Probe | list[Probe]:
        """Return a probe, or some as a list."""
        if isinstance(place, slice):
            return list(map(self._probe, self._packed[place]))
        return self._probe(self._packed[place])

    def _probe(self, packed: int) -> Probe:
        payload, target, options, exact = self._kinds[packed >> 16]
        return Probe(Command(packed >> 8 & 0xFF, packed & 0xFF, payload, target, options), exact)
