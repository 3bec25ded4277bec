"""A plan of what a capture shows an app to send."""

from pathlib import Path
from typing import Final

from sphero_probe.catalogue.commands import lookup
from sphero_probe.catalogue.risk import Risk
from sphero_probe.cli.captured import capture_in
from sphero_probe.errors import BadInputFileError
from sphero_probe.probing.plan import Plan, Probe
from sphero_probe.protocol.packets import Command, Generation, Request

_MAX_PAYLOADS: Final = 8
"""Different payloads of one read that are asked."""
_MAX_PROBES: Final = 1 << 16


def plan_of_capture(path: str, generation: Generation) -> Plan:
    """Return a plan of the commands in a capture, each once, in the order in which they were first sent.

    Reads of the catalogue are asked with the payloads that were seen, to the node that was asked. Of every
    other command only the ids are taken: how it is asked, and whether, is up to the engine and the policy.

    Args:
        path: the file.
        generation: the protocol of the robot that is asked; commands of the other one are left out.

    Raises:
        BadInputFileError: the file is no capture, or has no command of this protocol.
    """
    probes: dict[Probe, None] = {}
    payloads: dict[tuple[int, int, int | None], int] = {}
    with capture_in(path) as capture:
        for captured in capture.packets():
            if captured.generation is generation and isinstance(captured.packet, Request):
                probe = _probe(captured.packet.command, generation)
                if probe in probes or len(probes) >= _MAX_PROBES:
                    continue
                asked = (probe.command.did, probe.command.cid, probe.command.target)
                payloads[asked] = payloads.get(asked, 0) + 1
                if payloads[asked] <= _MAX_PAYLOADS:
                    probes[probe] = None
        said = capture.said
    if not probes:
        raise BadInputFileError(f"{path}: no {generation.value} command to ask", said)
    name = Path(path).name
    return Plan("capture", f"Commands of {name}", [list(probes)])


def _probe(command: Command, generation: Generation) -> Probe:
    row = lookup(generation, command.did, command.cid, None)
    if row and row.risk is Risk.READ:
        return Probe(command, exact=True)
    return Probe(command._replace(payload=b""))
