"""What the response codes of V1 are called, and what they say about a command."""

from typing import Final

from sphero_probe.protocol.packets import Verdict

V1_CODES: Final[dict[int, tuple[str, Verdict]]] = {
    0x00: ("OK", Verdict.OK),
    0x01: ("general error", Verdict.FAILED),
    0x02: ("bad checksum", Verdict.DAMAGED),
    0x03: ("command fragment", Verdict.DAMAGED),
    0x04: ("unknown command id", Verdict.NO_COMMAND),
    0x05: ("unsupported command", Verdict.NOT_IMPLEMENTED),
    0x06: ("bad message format", Verdict.BAD_LENGTH),
    0x07: ("bad parameter value", Verdict.BAD_VALUE),
    0x08: ("execution failed", Verdict.FAILED),
    0x09: ("unknown device id", Verdict.NO_DEVICE),
    0x0A: ("memory busy", Verdict.BUSY),
    0x0B: ("bad password", Verdict.RESTRICTED),
    0x31: ("power no good", Verdict.FAILED),
    0x32: ("page illegal", Verdict.BAD_VALUE),
    0x33: ("flash fail", Verdict.FAILED),
    0x34: ("main app corrupt", Verdict.FAILED),
    0x35: ("message timeout", Verdict.DAMAGED),  # the robot gave up waiting for the rest of the packet
}
