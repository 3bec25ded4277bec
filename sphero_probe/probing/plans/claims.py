"""A plan that asks what another library says a robot has, made from the library's source when it is run."""

from typing import Final

from sphero_probe.catalogue.libraries.claims import INSTALLED
from sphero_probe.catalogue.libraries.finding import find_library
from sphero_probe.catalogue.model import Kind, Robot
from sphero_probe.errors import UsageError
from sphero_probe.probing.plan import Plan, Probe
from sphero_probe.protocol.address import Address
from sphero_probe.protocol.packets import Command

_SUFFIX: Final = "-claims"


def library_in(plan: str) -> str | None:
    """Return the library whose claims a plan of this name asks, None for the name of another plan."""
    library = plan.removesuffix(_SUFFIX)
    return library if library != plan and library in INSTALLED else None


def claims_plan(library: str, robot: Robot | None, port: int) -> Plan:
    """Return the plan that asks each command that a library has for a robot, and reports what is absent.

    Only pair and node are taken from the library: how a command is asked, and whether, is up to the engine
    and the policy.

    Args:
        library: one of ``INSTALLED``.
        robot: the model.
        port: the port nibble of this kind of connection.

    Raises:
        UsageError: the model is not known, or the library does not have it.
        BadInputFileError: the library is not installed.
    """
    if robot is None:
        raise UsageError(
            f"{library}{_SUFFIX} depends on the model, which this address does not name",
            "give the robot's name, like BP-1234",
        )
    found = find_library(library)
    if robot.key not in found.robots:
        raise UsageError(f"{found.name} has no {robot.key}", f"it has: {', '.join(sorted(found.robots))}")
    probes = [
        Probe(Command(did, cid, b"", None if node is None else Address(port, node).byte))
        for (generation, did, cid), claim in sorted(found.claims.items())
        if generation is robot.generation and claim.kind is Kind.COMMAND and robot.key in claim.robots
        for node in [claim.robots[robot.key] if robot.addressed else None]
    ]
    summary = f"What {found.name} says that {robot.name} has"
    return Plan(f"{library}{_SUFFIX}", summary, [probes], (robot.key,), claimed_by=found.name)
