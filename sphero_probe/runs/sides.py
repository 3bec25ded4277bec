"""The sides of a comparison: what a run, a report, the catalogue or a robot's own list says about commands.

``Side`` is the main class. ``Observations`` makes one from the findings of a run, ``listed_sides`` those that
need no run, ``side_files`` reads one from a file.
"""

from collections.abc import Callable, Iterable, Mapping
from enum import StrEnum
from typing import Final, NamedTuple

from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.exchange import Answered
from sphero_probe.probing.finding import Confidence, Finding, Heading, Outcome
from sphero_probe.protocol.address import Address
from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Generation, Response, Verdict

Key = tuple[int | None, int, int]
"""The number of the node that was asked, None without addresses; DID; CID."""


class Standing(StrEnum):
    """What a side says about a command."""

    EXISTS = "exists"
    ABSENT = "absent"
    SILENT = "silent"
    INCONCLUSIVE = "inconclusive"
    """It was asked, and nothing is certain."""
    WITHHELD = "withheld"
    """It was blocked, so nothing was sent."""
    NOT_ASKED = "not_asked"


SETTLED: Final = frozenset((Standing.EXISTS, Standing.ABSENT, Standing.SILENT))
"""What can be compared."""


class Answer(NamedTuple):
    """The answer to one request.

    Attributes:
        verdict: what its code means, None for no answer.
        code: its code, None for no answer.
        code_name: the code in words, empty for no answer.
        payload: its data bytes.
    """

    verdict: Verdict | None
    code: int | None
    code_name: str
    payload: bytes


class Entry(NamedTuple):
    """What a side says about one command.

    Attributes:
        standing: whether it exists.
        name: in the catalogue, None where it has none.
        risk: the class of executing it, None where the side does not tell.
        answers: argument bytes -> the answer to them; only of requests that settle something.
        note: why it is not settled, or empty.
    """

    standing: Standing
    name: str | None = None
    risk: Risk | None = None
    answers: Mapping[bytes, Answer] = {}  # never changed
    note: str = ""


_ABSENT: Final = Entry(Standing.ABSENT)
_NOT_ASKED: Final = Entry(Standing.NOT_ASKED)


class Side(NamedTuple):
    """One side of a comparison.

    Attributes:
        source: as the user named it.
        kind: ``run``, ``report``, ``catalogue``, ``fake`` or ``claims``.
        generation: the protocol.
        robot: the model's key, empty if it is not known.
        model: the model's name.
        device: the robot's name, empty if no particular robot is meant.
        firmware: node name -> version.
        started: of a run, RFC 3339; empty for the others.
        complete: whether a run asked everything that it should.
        entries: what it says.
        covers: whether a command without an entry is absent; otherwise nothing is known of it.
    """

    source: str
    kind: str
    generation: Generation
    robot: str
    model: str
    device: str
    firmware: Mapping[str, str]
    started: str
    complete: bool
    entries: Mapping[Key, Entry]
    covers: Callable[[Key], bool]

    def entry(self, key: Key) -> Entry:
        """Return what this side says about a command."""
        return self.entries.get(key) or (_ABSENT if self.covers(key) else _NOT_ASKED)


def node_of(target: int | None) -> int | None:
    """Return the number of the node that an address byte names; over another port it is the same node."""
    return None if target is None else Address.from_byte(target).node


class Observation(NamedTuple):
    """What one probe tells about a command, from a journal or a report.

    Attributes:
        target: address byte of the node that was asked, None without addresses.
        did: device id.
        cid: command id.
        request: the argument bytes.
        outcome: of the probe.
        is_certain: the outcome can be trusted; only runs of version 0.1.0 have others.
        risk: the class of sending it.
        response: the answer, None for none.
        name: in the catalogue, None where it has none.
        note: a remark, or empty.
    """

    target: int | None
    did: int
    cid: int
    request: bytes
    outcome: Outcome
    is_certain: bool
    risk: Risk
    response: Response | None
    name: str | None
    note: str


def observation_of(finding: Finding) -> Observation:
    """Return what a finding tells."""
    command, exchange, known = finding.command, finding.exchange, finding.knowledge
    return Observation(
        command.target,
        command.did,
        command.cid,
        command.payload,
        finding.outcome,
        finding.confidence is Confidence.CERTAIN,
        finding.risk,
        exchange.response if isinstance(exchange, Answered) else None,
        known.name if known else None,
        finding.note,
    )


_STANDINGS: Final = {
    Outcome.EXISTS: Standing.EXISTS,
    Outcome.ABSENT: Standing.ABSENT,
    Outcome.SILENT: Standing.SILENT,
    Outcome.INCONCLUSIVE: Standing.INCONCLUSIVE,
    Outcome.SENT: Standing.INCONCLUSIVE,
    Outcome.SKIPPED: Standing.WITHHELD,
}
_STRENGTH: Final = {standing: at for at, standing in enumerate(reversed(Standing))}
"""Standing -> how much it says; of several probes of one command, the one that says most counts."""


class Observations:
    """Collects the observations of one run; their order does not matter, nor does repetition.

    A device whose answers all say that it does not exist has no commands, and nor has such a node.
    """

    def __init__(self, codec: Codec) -> None:
        self.entries: dict[Key, Entry] = {}
        self._codec = codec
        self._alike: dict[tuple[object, ...], Entry] = {}
        self._devices: dict[tuple[int | None, int], bool] = {}
        self._nodes: dict[int | None, bool] = {}

    def add(self, observed: Observation) -> None:
        """Take what one probe tells."""
        target, did, cid, request, outcome, is_certain, risk, response, name, note = observed
        standing = _STANDINGS[outcome] if is_certain else Standing.INCONCLUSIVE
        known_risk = None if risk is Risk.PROBE else risk
        settled = standing in SETTLED
        code, payload = (response.code, response.payload) if response else (None, b"")
        alike = (standing, name, known_risk, request, code, payload, "" if settled else note)
        entry = self._alike.get(alike)
        verdict = None if code is None else self._codec.verdict(code)
        if entry is None:
            code_name = "" if code is None else self._codec.code_name(code)
            answers = {request: Answer(verdict, code, code_name, payload)} if settled else {}
            entry = self._alike[alike] = Entry(standing, name, known_risk, answers, alike[-1])
        node = node_of(target)
        key = (node, did, cid)
        earlier = self.entries.get(key)
        self.entries[key] = entry if earlier is None else _merged(earlier, entry)
        if verdict is not None:
            device = (node, did)
            self._devices[device] = self._devices.get(device, True) and verdict is Verdict.NO_DEVICE
            self._nodes[node] = self._nodes.get(node, True) and verdict is Verdict.NO_TARGET

    def covers(self, key: Key) -> bool:
        """Return whether a command that was not asked is absent, because its device or node is."""
        return self._devices.get(key[:2], False) or self._nodes.get(key[0], False)


def _merged(one: Entry, other: Entry) -> Entry:
    """Return what two probes of one command tell together."""
    if one is other:
        return one
    first, second = sorted((one, other), key=lambda entry: (-_STRENGTH[entry.standing], entry.note))
    answers = dict(first.answers)
    for request, answer in second.answers.items():
        answers[request] = min(answers.get(request, answer), answer, key=_answer_order)
    risks = [entry.risk for entry in (one, other) if entry.risk is not None]
    return first._replace(
        name=first.name if first.name is not None else second.name,
        risk=max(risks, default=None),
        answers=answers,
    )


def _answer_order(answer: Answer) -> tuple[int, bytes]:
    return (-1 if answer.code is None else answer.code, answer.payload)


def run_side(
    source: str,
    kind: str,
    codec: Codec,
    heading: Heading | None,
    observed: Iterable[Observation],
    *,
    complete: bool,
) -> Side:
    """Return the side of a run.

    Args:
        source: as the user named it.
        kind: ``run`` or ``report``.
        codec: of the robot's protocol.
        heading: of the run, None if it is not known.
        observed: what its probes tell.
        complete: whether it asked everything that it should.
    """
    observations = Observations(codec)
    for one in observed:
        observations.add(one)
    robot, model, device, firmware = heading[:4] if heading else ("", "", "", {})
    return Side(
        source,
        kind,
        codec.generation,
        robot,
        model,
        device,
        firmware,
        heading.started if heading else "",
        complete,
        observations.entries,
        observations.covers,
    )
