"""The wire protocols: encoders and decoders for V1 and V2, without I/O, clock or asyncio.

``CODECS`` maps each generation to its codec. ``codec`` defines what a codec and a decoder are, ``packets``
what they read and write.
"""

from typing import Final

from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Generation
from sphero_probe.protocol.v1 import V1
from sphero_probe.protocol.v2 import V2

CODECS: Final[dict[Generation, Codec]] = {V1.generation: V1, V2.generation: V2}

__all__ = ["CODECS"]
