"""What switches off again what a command switched on: sensor streams and notifications."""

from collections.abc import Iterable

from sphero_probe.catalogue.commands import rows_of
from sphero_probe.catalogue.streaming_services import CLEAR, CONFIGURE, START, STOP
from sphero_probe.protocol.packets import Command, Generation

_OPPOSITES = {CONFIGURE: CLEAR, START: STOP}
_SWITCHES = ("enable", "sensor_masks", "mask", "extended_mask")
"""The arguments that switch something on; all zero is off."""


def switched_off(generation: Generation, command: Command) -> Command | None:
    """Return the command that takes back another, None where it switches nothing on.

    Args:
        generation: the protocol of the robot.
        command: the command that was executed.
    """
    pair = command.did, command.cid
    if generation is Generation.V2 and pair in _OPPOSITES:
        did, cid = _OPPOSITES[pair]
        return command._replace(did=did, cid=cid, payload=b"")
    for row in rows_of(generation, *pair):
        fields = row.request.decode(command.payload).fields if row.request else {}
        switches = {name: 0 for name in _SWITCHES if fields.get(name)}
        if row.request and switches:
            return command._replace(payload=row.request.encode(fields | switches))
    return None


def taken_back(generation: Generation, commands: Iterable[Command]) -> tuple[Command, ...]:
    """Return the commands that take back all of these, the last one first, each once."""
    off = [switched_off(generation, command) for command in commands]
    return tuple(dict.fromkeys(command for command in reversed(off) if command))
