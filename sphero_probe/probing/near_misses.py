"""Keep damaged frames, and answers that fit a command in all but one field.

If such bytes arrive while a command waits, its silence proves nothing: they may be its answer.
"""

from collections import deque
from collections.abc import Iterable
from typing import Final, NamedTuple

from sphero_probe.link.exchange import LateResponse, Silent
from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Malformed

_KEPT: Final = 1024
_LATEST: Final = 10.0
"""Seconds after which bytes no longer count as a command's answer."""
_FITTING: Final = 2
"""How many of DID, CID and sequence number such an answer must share with a command."""


class _Miss(NamedTuple):
    at: float
    raw: bytes
    late: LateResponse | None


class NearMisses:
    """The last frames that matched no command."""

    def __init__(self, codec: Codec) -> None:
        self._codec = codec
        self._misses: deque[_Miss] = deque(maxlen=_KEPT)

    def hear(self, unsolicited: Malformed | LateResponse, *, now: float) -> None:
        """Add a damaged frame, or an answer that fits no command.

        Args:
            unsolicited: the frame or answer.
            now: the time.
        """
        if isinstance(unsolicited, Malformed):
            self._misses.append(_Miss(now, unsolicited.raw, None))
        elif unsolicited.earlier is None:
            self._misses.append(_Miss(now, unsolicited.received, unsolicited))

    def of(self, attempts: Iterable[tuple[Silent, float]]) -> bytes:
        """Return the bytes that may be the answer to one of these attempts, empty if there are none.

        Args:
            attempts: with the time at which each was sent.
        """
        for silent, sent in attempts:
            for miss in self._misses:
                if sent <= miss.at <= sent + _LATEST and self._fits(miss, silent):
                    return miss.raw
        return b""

    def _fits(self, miss: _Miss, silent: Silent) -> bool:
        command = silent.command
        if miss.late is None:
            return self._codec.may_answer(miss.raw, command, silent.seq)
        response = miss.late.response
        if response.did is None:
            return response.seq == silent.seq
        shared = (response.did == command.did, response.cid == command.cid, response.seq == silent.seq)
        return sum(shared) >= _FITTING
