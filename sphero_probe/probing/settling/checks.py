"""What evidence says about the checks of a robot: which comes first, and how exact they are."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from typing import Final

from sphero_probe.catalogue import lookup
from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.link.wrong_lengths import IMPOSSIBLE_DIDS
from sphero_probe.probing.evidence import Evidence, Topic
from sphero_probe.probing.profiles import ACCEPTED
from sphero_probe.probing.settling.settlement import Settlement, code_text, node_of, settled, told, unsettled
from sphero_probe.protocol.packets import Verdict

_Lengths = Mapping[int, Verdict]
"""Payload length -> the answer to a command."""
_Pair = tuple[int, int]
_REJECTED: Final = {
    (True, True): "rejected",
    (False, True): "rejected by some reads only",
    (False, False): "accepted",
}
"""Whether all, and any, of the reads reject a length -> in words."""


def command_before_length(evidence: Evidence) -> Settlement:
    """Compare the answers of absent commands at several lengths."""

    def judge(pairs: Mapping[_Pair, _Lengths]) -> str:
        absent = [lengths for lengths in pairs.values() if Verdict.NO_COMMAND in lengths.values()]
        return _what_comes_first(absent, Verdict.NO_COMMAND, "command")

    return _by_node(evidence, judge, "no absent command was answered at several lengths")


def device_before_length(evidence: Evidence) -> Settlement:
    """Compare the answers of an absent device at several lengths."""

    def judge(pairs: Mapping[_Pair, _Lengths]) -> str:
        absent = [lengths for (did, _), lengths in pairs.items() if did in IMPOSSIBLE_DIDS]
        return _what_comes_first(absent, Verdict.NO_DEVICE, "device")

    return _by_node(evidence, judge, "no absent device was answered at several lengths")


def _what_comes_first(absent: Iterable[_Lengths], gone: Verdict, what: str) -> str:
    """Return what is checked first, empty if the answers do not tell.

    Args:
        absent: payload length -> answer, of things that the robot does not have.
        gone: how it says so.
        what: the thing, a word.
    """
    compared = [lengths for lengths in absent if any(lengths) and 0 in lengths]
    with_payload = {verdict for lengths in compared for length, verdict in lengths.items() if length}
    if with_payload == {gone}:
        return f"the {what} first: an absent {what} is called absent at every length"
    if with_payload == {Verdict.BAD_LENGTH}:
        return f"the length first: with a payload, an absent {what} is answered bad data length"
    if with_payload == {gone, Verdict.BAD_LENGTH}:
        return f"it varies: some lengths of an absent {what} are answered bad data length, others are not"
    return ""


def exact_length(evidence: Evidence) -> Settlement:
    """Compare the answers of documented reads at the right length with those at others."""
    codec, robot = evidence.codec, evidence.model

    def judge(pairs: Mapping[_Pair, _Lengths]) -> str:
        longer: set[bool] = set()
        shorter: set[bool] = set()
        for (did, cid), lengths in pairs.items():
            row = lookup(codec.generation, did, cid, robot)
            right = row.request.fixed_length if row and row.request else None
            if right is None or lengths.get(right) is not Verdict.OK:
                continue
            for length, verdict in lengths.items():
                if length != right and verdict in (Verdict.BAD_LENGTH, *ACCEPTED):
                    (longer if length > right else shorter).add(verdict is Verdict.BAD_LENGTH)
        said = [
            f"{kind} bytes are {_REJECTED[all(rejected), any(rejected)]}"
            for kind, rejected in (("surplus", longer), ("missing", shorter))
            if rejected
        ]
        return ", ".join(said) if longer else ""

    return _by_node(evidence, judge, "no read that succeeds was answered at a wrong length")


def bad_value(evidence: Evidence) -> Settlement:
    """Look at the answers to a request for the commands of a device that cannot exist."""
    codec = evidence.codec
    row = row_for(codec.generation, WellKnown.CLAIMED_COMMANDS)
    absent = bytes(IMPOSSIBLE_DIDS[:1])
    asked = [
        one
        for one in evidence.answers
        if row and one.command[:2] == (row.did, row.cid)
        if codec.verdict(one.code or 0) is not Verdict.BUSY
    ]
    right = {one.code: one for one in asked if one.command.payload == absent}
    longer = {one.code for one in asked if one.command.payload == absent + b"\0"}
    verdicts = {codec.verdict(code) for code in right if code is not None}
    if not right or verdicts & {Verdict.NO_COMMAND, Verdict.NO_DEVICE}:
        return unsettled("the robot has no command whose values could be tried")
    names = " or ".join(sorted(code_text(codec, code) for code in right))
    text = f"0x{row.did:02x}:0x{row.cid:02x} answers {names} for device 0xee" if row else ""
    if verdicts == {Verdict.OK}:
        return settled(f"{text}: this value is not checked")
    if {codec.verdict(code) for code in longer if code is not None} == {Verdict.BAD_LENGTH}:
        return settled(f"{text}; with a surplus byte the length is rejected first")
    if longer == set(right):
        return settled(f"{text}, also with a surplus byte")
    return settled(text)


def _by_node(
    evidence: Evidence, judge: Callable[[Mapping[_Pair, _Lengths]], str], missing: str
) -> Settlement:
    """Judge the answers of calibration and of the order of checks, node by node."""
    codec = evidence.codec
    nodes: defaultdict[str, defaultdict[_Pair, dict[int, Verdict]]] = defaultdict(lambda: defaultdict(dict))
    for one in evidence.answers:
        is_served = codec.verdict(one.code or 0) is not Verdict.BUSY
        if is_served and one.topic in (Topic.CALIBRATION, Topic.ORDER, Topic.LISTS):
            lengths = nodes[node_of(evidence, one)][one.command[:2]]
            lengths.setdefault(len(one.command.payload), codec.verdict(one.code or 0))
    said = {node: judged for node, pairs in nodes.items() if (judged := judge(pairs))}
    return told(evidence, said, missing)
