"""What a response code proves about a command: one sentence for each verdict."""

from typing import Final

from sphero_probe.protocol.packets import Verdict

PROVES: Final[dict[Verdict, str]] = {
    Verdict.OK: "the command exists and was executed; that its arguments were accepted proves no effect",
    Verdict.NO_DEVICE: "no such device, or hidden: not visible with the current permissions",
    Verdict.NO_COMMAND: "no such command, or hidden: not visible with the current permissions",
    Verdict.NOT_IMPLEMENTED: "the command exists as a stub, or with a null handler",
    Verdict.RESTRICTED: "the command exists, but not in the current state or mode",
    Verdict.BAD_LENGTH: "the command exists and refuses this length, where only existing ones do",
    Verdict.FAILED: "the command exists, accepted the length, ran and failed",
    Verdict.BAD_VALUE: "the command exists, accepted the length and refused a value",
    Verdict.BUSY: "nothing: ask again later",
    Verdict.NO_TARGET: "there is no such node",
    Verdict.TARGET_UNAVAILABLE: "the node exists, but sleeps or is disconnected",
    Verdict.DAMAGED: "nothing: the robot received the packet damaged",
    Verdict.UNLISTED: "nothing: no document lists the code",
}
"""Verdict -> what it proves. The vendor says that 0x01 and 0x02 may hide a command, and what 0x03 and 0x04
mean [error codes of the official API document]."""
