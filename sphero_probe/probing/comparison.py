"""What was found beside what the robot claims to have and what is known: findings in, a note out."""

from collections.abc import Iterable, Sequence

from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.link.exchange import Answered
from sphero_probe.probing.finding import Finding, Note, Outcome
from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Verdict

_Triple = tuple[int | None, int, int]
"""Node, DID, CID."""


def compare(findings: Sequence[Finding], codec: Codec) -> Note | None:
    """Return what differs: hidden (exists, not claimed), ghost (claimed, absent), unknown (in no catalogue).

    Args:
        findings: of a run.
        codec: whose codes the answers carry.

    Returns:
        A note, None where the robot claimed nothing and everything is known.
    """
    claimed = _claims(findings, codec)
    devices = {(target, did) for target, did, _ in claimed}
    exists: list[_Triple] = []
    unknown: list[_Triple] = []
    ghosts: list[_Triple] = []
    for finding in findings:
        triple = finding.command.target, finding.command.did, finding.command.cid
        if finding.outcome is Outcome.EXISTS:
            exists.append(triple)
            if finding.knowledge is None:
                unknown.append(triple)
        elif finding.outcome is Outcome.ABSENT and triple in claimed:
            ghosts.append(triple)
    hidden = [triple for triple in exists if triple not in claimed and triple[:2] in devices]
    if not (hidden or ghosts or unknown):
        return None
    parts = (("hidden", hidden), ("ghost", ghosts), ("unknown but exists", unknown))
    text = "; ".join(f"{word}: {_listed(triples)}" for word, triples in parts if triples)
    data: dict[str, object] = {
        "hidden": _as_json(hidden),
        "ghost": _as_json(ghosts),
        "unknown": _as_json(unknown),
    }
    return Note("comparison", text, data)


def _claims(findings: Iterable[Finding], codec: Codec) -> set[_Triple]:
    """Every command that the robot says it has, on the node that was asked."""
    row = row_for(codec.generation, WellKnown.CLAIMED_COMMANDS)
    claimed: set[_Triple] = set()
    for finding in findings:
        command, exchange = finding.command, finding.exchange
        if row is None or command[:2] != (row.did, row.cid) or len(command.payload) != 1:
            continue
        if isinstance(exchange, Answered) and codec.verdict(exchange.response.code) is Verdict.OK:
            claimed |= {(command.target, command.payload[0], cid) for cid in exchange.response.payload}
    return claimed


def _listed(triples: Iterable[_Triple]) -> str:
    return ", ".join(dict.fromkeys(f"0x{did:02x}:0x{cid:02x}" for _, did, cid in triples))


def _as_json(triples: Iterable[_Triple]) -> list[dict[str, int | None]]:
    return [{"target": target, "did": did, "cid": cid} for target, did, cid in triples]
