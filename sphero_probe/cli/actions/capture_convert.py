"""``capture convert``: the robots of a capture, in a pcapng file of their own."""

from pathlib import Path
from typing import Final

from sphero_probe import __version__
from sphero_probe.captures.packet import CapturedPacket
from sphero_probe.captures.pcapng_out import head, packet
from sphero_probe.captures.synthetic import BleScript, Script, SerialScript
from sphero_probe.cli.capture_out import NO_ADDRESS
from sphero_probe.cli.captured import capture_in
from sphero_probe.cli.messages import say
from sphero_probe.errors import OutputError, UsageError

_SERIAL_INTERFACE: Final = 1
_MAX_SCRIPTS: Final = 1 << 12


def convert_capture(path: str, target: str) -> None:
    """Write the packets of all robots.

    Args:
        path: the capture.
        target: the file to write.

    Raises:
        UsageError: the two are the same file.
        BadInputFileError: the file is no capture, or nothing in it can be read.
        OutputError: the file cannot be written.
    """
    if Path(target).exists() and Path(path).exists() and Path(target).samefile(path):
        raise UsageError(f"{target} is the capture itself", "give -o another name")
    scripts: dict[int, Script] = {}
    left_out = 0
    with capture_in(path) as capture:
        try:
            with Path(target).open("wb") as file:
                file.write(head(f"sphero-probe {__version__}", BleScript.link, SerialScript.link))
                for captured in capture.packets():
                    time, to_robot = captured.time or 0, captured.to_robot
                    if to_robot is None:
                        left_out += 1
                        continue
                    number = captured.connection.number
                    script = scripts.get(number)
                    if script is None:
                        if len(scripts) >= _MAX_SCRIPTS:
                            left_out += 1
                            continue
                        script = scripts[number] = _script(captured)
                        file.write(b"".join(map(packet, script.opening(time))))
                    records = (script.sent if to_robot else script.received)(time, captured.raw)
                    file.write(b"".join(map(packet, records)))
        except OSError as error:
            raise OutputError(f"cannot write {target}: {error.strerror}") from error
        say(f"{path}: {capture.said}")
    if left_out:
        say(f"Left out: {left_out} packets whose direction the capture does not tell.")


def _script(captured: CapturedPacket) -> Script:
    if captured.handle is None:
        return SerialScript(_SERIAL_INTERFACE)
    number, peer, name = captured.connection
    return BleScript(captured.generation, peer or NO_ADDRESS, name or f"robot {number}", number)
