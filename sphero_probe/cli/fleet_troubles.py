"""Says at the end of a fleet's run which robots have no complete result."""

from collections.abc import Mapping, Sequence
from typing import Final

from sphero_probe.errors import IncompleteError, RefusedByPolicyError
from sphero_probe.fleet.records import Status
from sphero_probe.fleet.results import RobotResult

RESUME: Final = "to finish what can be finished, repeat the command with --resume"
_NAMED: Final = 4
"""Robots that a message names."""


def check_results(results: Mapping[str, RobotResult], *, resumable: bool) -> None:
    """Check that every robot is done.

    Args:
        results: robot name -> its result.
        resumable: whether journals were kept that ``--resume`` finds.

    Raises:
        RefusedByPolicyError: a robot was refused.
        IncompleteError: another one has no complete result.
    """
    ended = [(result.name, result.ended) for result in results.values() if result.ended]
    troubled = [(name, end) for name, end in ended if end.status is not Status.DONE]
    if not troubled:
        return
    refused = [(name, end) for name, end in troubled if end.status is Status.REFUSED]
    many = f"{len(refused or troubled)} of {len(results)} robots"
    listed = listed_troubles([(name, end.trouble) for name, end in refused or troubled])
    if refused:
        raise RefusedByPolicyError(f"{many} refused: {listed}", refused[0][1].hint)
    hint = RESUME if resumable else troubled[0][1].hint
    raise IncompleteError(f"{many} without a complete result: {listed}", hint)


def listed_troubles(troubles: Sequence[tuple[str, str]]) -> str:
    """Return the first robots with their troubles, and how many more there are.

    Args:
        troubles: the name and the trouble of each.
    """
    named = [f"{name} ({trouble})" for name, trouble in troubles[:_NAMED]]
    more = [f"and {len(troubles) - _NAMED} more"] if len(troubles) > _NAMED else []
    return ", ".join((*named, *more))
