"""Bytes to packets and back: no I/O, no clock, no asyncio; ``CODECS`` is the way in."""

from typing import Final

from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Generation
from sphero_probe.protocol.v1 import V1
from sphero_probe.protocol.v2 import V2

CODECS: Final[dict[Generation, Codec]] = {V1.generation: V1, V2.generation: V2}

__all__ = ["CODECS"]
