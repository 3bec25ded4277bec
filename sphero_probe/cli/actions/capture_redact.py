"""``capture redact``: a capture without addresses, names and keys, to be shared."""

import secrets
from pathlib import Path
from typing import Final

from sphero_probe import __version__
from sphero_probe.captures.pcapng_out import PcapngWriter
from sphero_probe.captures.redaction.copy import Redaction
from sphero_probe.captures.redaction.pseudonyms import Pseudonyms
from sphero_probe.captures.source import Source
from sphero_probe.cli.bug_report import recording
from sphero_probe.cli.captured import capture_in
from sphero_probe.cli.messages import say
from sphero_probe.errors import OutputError, UsageError

_SALT: Final = 32


def redact_capture(path: str, target: str, seed: int | None) -> None:
    """Write a capture again, without what identifies.

    Args:
        path: the capture.
        target: the file to write.
        seed: chooses the pseudonyms; None draws them by chance.

    Raises:
        UsageError: the two are the same file.
        BadInputFileError: the file is no capture, or nothing in it can be read.
        OutputError: the file cannot be written.
    """
    if Path(target).exists() and Path(path).exists() and Path(target).samefile(path):
        raise UsageError(f"{target} is the capture itself", "give -o another name")
    salt = secrets.token_bytes(_SALT) if seed is None else seed.to_bytes(_SALT, signed=True)
    pseudonyms = Pseudonyms(salt)
    redaction = Redaction(pseudonyms)
    with capture_in(path) as capture:
        redaction.learn(capture)
    with recording(path) as file:
        try:
            with Path(target).open("wb") as out:
                writer = PcapngWriter(f"sphero-probe {__version__}")
                out.write(writer.start())
                out.writelines(map(writer.packet, redaction.copy(Source(file))))
        except OSError as error:
            raise OutputError(f"cannot write {target}: {error.strerror}") from error
    say(f"{path}: {capture.said}")
    say(
        f"Replaced: {pseudonyms.addresses} addresses, {pseudonyms.names} names, "
        f"{pseudonyms.others} other values. Kept {redaction.kept} packets, left out {redaction.left_out} "
        "that belong to no robot or are not understood."
    )
    say("Payloads of unknown commands and times are kept: look through them before you share the file.")
