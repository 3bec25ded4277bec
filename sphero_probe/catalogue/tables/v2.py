"""Builds the rows of the tables, so that each row is one line.

``nodes`` lists the robots that have the pair, each with the nodes that serve it: ``"mini bolt:2 rvr:12"`` is
node 1 of Mini, node 2 of BOLT, both nodes of RVR. ``sources`` is a list of words: ``spherov2``, ``sdk`` (the maker's Python SDK),
``pysphero``, ``capture`` (bytes seen from a robot), ``reference`` (a description of BOLT+), ``unsw`` (a class for BOLT+ that
its package marks as untested), ``spherov2js`` (a JavaScript library), and ``assumed`` where a robot is in the row only
because related models are.
"""

from functools import cache

from sphero_probe.catalogue.model import CommandRow, Kind
from sphero_probe.catalogue.payload.layout import Layout
from sphero_probe.catalogue.risk import Risk
from sphero_probe.protocol.packets import Generation


def command(
    did: int,
    cid: int,
    name: str,
    risk: Risk,
    request: str | None,
    response: str | None,
    nodes: str,
    sources: str,
    *,
    aliases: str = "",
    sample: bytes | None = None,
    note: str = "",
) -> CommandRow:
    """Return the row of a command; a layout is None if unknown, ``""`` if known to be empty."""
    return CommandRow(
        Generation.V2,
        did,
        cid,
        name,
        Kind.COMMAND,
        risk,
        _layout(request),
        _layout(response),
        _nodes(nodes),
        _words(sources),
        _words(aliases),
        sample,
        note,
    )


def notification(
    did: int,
    cid: int,
    name: str,
    payload: str | None,
    nodes: str,
    sources: str,
    *,
    aliases: str = "",
    note: str = "",
    enabled_by: str = "",
    since: str = "",
) -> CommandRow:
    """Return the row of a notification; it has no request, because it is never sent to a robot."""
    return CommandRow(
        Generation.V2,
        did,
        cid,
        name,
        Kind.NOTIFICATION,
        Risk.READ,
        None,
        _layout(payload),
        _nodes(nodes),
        _words(sources),
        _words(aliases),
        None,
        note,
        enabled_by,
        since,
    )


@cache
def _layout(text: str | None) -> Layout | None:
    return None if text is None else Layout(text)


@cache
def _nodes(text: str) -> dict[str, tuple[int, ...]]:
    nodes = {}
    for word in text.split():
        robot, _, digits = word.partition(":")
        nodes[robot] = tuple(int(digit) for digit in digits or "1")
    return nodes


@cache
def _words(text: str) -> tuple[str, ...]:
    return tuple(text.split())
