"""Decode packets of a capture, without a robot: python examples/decode_capture.py [HEX]."""

import sys

from sphero_probe import decode

CAPTURED = "8d0a131007cbd8 8d09131007005f6dd8 ffff00015201ab 8d0913"


def main(text: str) -> None:
    for packet in decode(bytes.fromhex(text)):
        print(packet.generation, packet.kind, packet.name or "-", dict(packet.fields), packet.note)


main(" ".join(sys.argv[1:]) or CAPTURED)
