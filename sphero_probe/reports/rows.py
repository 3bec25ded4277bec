"""Turns records of every layer into rows: JSON-able, keys in a fixed order, the same for every format.

In a row, ids and codes are integers, bytes are lower-case hex strings without blanks, times are RFC 3339
strings, durations are milliseconds (``_ms``) or, in a summary, ``seconds``. Unknown values are null.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from sphero_probe.catalogue.addresses import AddressMeaning, client_means
from sphero_probe.catalogue.dissection import Part
from sphero_probe.catalogue.meaning import answer_meaning, request_fields
from sphero_probe.catalogue.model import NO_DEVICE, CommandRow, LedGroup, Robot
from sphero_probe.catalogue.packet_json import SharedKeys, packet_keys
from sphero_probe.catalogue.packet_reader import ReadPacket
from sphero_probe.catalogue.proofs import PROVES
from sphero_probe.catalogue.stream_plan import StreamColumn
from sphero_probe.catalogue.streams import StreamDecoder
from sphero_probe.link.exchange import Answered, Blocked
from sphero_probe.probing.finding import Finding, Heading, Note, Outcome, Summary
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Generation, Packet
from sphero_probe.reports.catalogue_keys import evidence_keys, led_keys
from sphero_probe.reports.states import state
from sphero_probe.transports.base import Seen

if TYPE_CHECKING:
    from sphero_probe.catalogue.libraries.comparison import Difference
    from sphero_probe.probing.dry_run import PlannedProbe
    from sphero_probe.probing.facts import Fact

_new: Final = tuple.__new__  # a NamedTuple's own __new__ costs twice as much
UNKNOWN_SPHERO: Final = "unknown Sphero"
"""The model of a robot that has the services of a Sphero and an unknown name."""


class Row(NamedTuple):
    """One thing to show.

    Attributes:
        type: which keys ``data`` has: ``run``, ``finding``, ``note``, ``summary``, ``robot``, ``packet``,
            ``command``, ``difference``, ``library``, ``led``, ``planned``, ``plan``, ``code``, ``fact``,
            ``check``, ``run_file``, ``address``, ``byte``, ``system``, ``node``, ``hop``, ``sensor``,
            ``sample``.
        own: key -> value, in the order in which they are written; None where ``keys`` and ``values`` say it.
        keys: what the row has in common with others of its type, so that a format writes that once.
        values: of the keys that are not in common.
    """

    type: str
    own: dict[str, object] | None
    keys: SharedKeys | None = None
    values: tuple[object, ...] = ()

    @property
    def data(self) -> dict[str, object]:
        """The values by key, in the order in which they are written; a new dict where ``own`` is None."""
        if self.own is not None:
            return self.own
        return self.keys.data(self.values) if self.keys else {}


def heading_row(heading: Heading) -> Row:
    """Return the first row of a run."""
    return Row(
        "run",
        {
            "robot": heading.robot,
            "model": heading.model,
            "device": heading.device,
            "firmware": dict(heading.firmware),
            "plan": heading.plan,
            "tool_version": heading.tool_version,
            "consent": list(heading.consent),
            "strictness": dict(heading.strictness),
            "started": heading.started,
            "line": heading.line or None,
            "client": heading.client,
            "client_means": None if heading.client is None else client_means(heading.client, heading.robot),
        },
    )


def finding_row(finding: Finding) -> Row:
    """Return the row of a finding; the keys of an answer are null if none arrived.

    ``fields`` are those of a successful answer, by the catalogue's layout, ``units`` their units. If the
    answer does not fit the layout, the end of ``note`` says how. ``request`` are the argument bytes of the
    command, ``arguments`` their fields, null where they fit no layout of the catalogue.
    """
    known = finding.knowledge
    exchange = finding.exchange
    answer = exchange if isinstance(exchange, Answered) else None
    sent = None if isinstance(exchange, Blocked) else exchange.sent.hex() or None
    decoded = answer_meaning(answer.response, known) if answer else None
    data: dict[str, object] = {
        "number": finding.number,
        "target": finding.command.target,
        "answered_by": finding.answered_by,
        "did": finding.command.did,
        "cid": finding.command.cid,
        "name": known.name if known else None,
        "risk": finding.risk.word,
        "outcome": finding.outcome.value,
        "confidence": finding.confidence.value,
        "code": answer.response.code if answer else None,
        "code_name": finding.code_name if answer else None,
        "payload": answer.response.payload.hex() if answer else None,
        "fields": decoded.fields if decoded else None,
        "units": decoded.units if decoded else {},
        "sent": sent,
        "received": answer.received.hex() if answer else None,
        "rtt_ms": round(answer.rtt * 1000, 3) if answer else None,
        "attempts": finding.attempts,
        "note": "; ".join(filter(None, (finding.note, decoded.problem if decoded else ""))),
    }
    data["state"] = state(data)
    data["request"] = finding.command.payload.hex()
    data["arguments"] = request_fields(finding.command, known)
    return Row("finding", data)


def note_row(note: Note) -> Row:
    """Return the row of a note, with its details as further keys."""
    return Row("note", {"kind": note.kind, "text": note.text} | note.data)


def counts_by_word(counts: Mapping[Outcome, int]) -> dict[str, int]:
    """Return the findings of each outcome, zeros too; ``sent`` only where there are some: no plan has any."""
    return {
        outcome.value: counts.get(outcome, 0)
        for outcome in Outcome
        if outcome is not Outcome.SENT or counts.get(outcome)
    }


def summary_row(summary: Summary) -> Row:
    """Return the last row of a run; it counts every outcome, zeros included."""
    return Row(
        "summary",
        {
            "counts": counts_by_word(summary.counts),
            "seconds": round(summary.seconds, 3),
            "probes_sent": summary.probes_sent,
            "frames_sent": summary.frames_sent,
            "complete": summary.complete,
            "strictness": dict(summary.strictness),
        },
    )


def robot_row(seen: Seen) -> Row:
    """Return the row of a robot of a scan; ``rssi`` is in dBm, null for a robot that was not heard.

    ``connected`` is present, and true, for a robot that is connected to this machine.
    """
    model = seen.robot.name if seen.robot else UNKNOWN_SPHERO if seen.is_sphero else None
    generation = seen.robot.generation if seen.robot else seen.generation
    keys: dict[str, object] = {
        "name": seen.name,
        "model": model,
        "generation": generation.value if generation else None,
        "address": seen.address,
        "rssi": seen.rssi,
    }
    return Row("robot", keys | {"connected": True} if seen.connected else keys)


def packet_row(
    packet: Packet,
    generation: Generation,
    raw: bytes,
    robot: Robot | None = None,
    streams: StreamDecoder | None = None,
    *,
    raw_floats: bool = False,
) -> Row:
    """Return the row of a packet; the arguments are those of ``packet_keys``."""
    keys, values = packet_keys(packet, generation, raw, robot, streams, raw_floats=raw_floats)
    return _new(Row, ("packet", None, keys, values))


def read_row(read: ReadPacket) -> Row:
    """Return the row of a packet of a recording, as ``packet_row`` does."""
    _, _, keys, values = read
    return _new(Row, ("packet", None, keys, values))


def command_row(command: CommandRow) -> Row:
    """Return the row of a catalogue entry; ``request`` and ``response`` are layouts, null where unknown.

    The further keys are those of ``evidence_keys``.
    """
    return Row(
        "command",
        {
            "generation": command.generation.value,
            "did": None if command.did == NO_DEVICE else command.did,
            "cid": command.cid,
            "name": command.name,
            "kind": command.kind.value,
            "risk": command.risk.word,
            "request": command.request.text if command.request else None,
            "response": command.response.text if command.response else None,
            "robots": {key: list(nodes) for key, nodes in command.nodes.items()},
            "sources": list(command.sources),
            "aliases": list(command.aliases),
            "note": command.note,
        }
        | evidence_keys(command),
    )


def difference_row(difference: "Difference") -> Row:
    """Return the row of what only the catalogue or only a library knows; unknown names are null."""
    known_by, generation, did, cid, kind, name, their_name, robots = difference
    data: dict[str, object] = {"known_by": known_by, "generation": generation.value}
    data |= {"did": None if did == NO_DEVICE else did, "cid": cid, "kind": kind.value}
    return Row(
        "library", data | {"name": name or None, "their_name": their_name or None, "robots": list(robots)}
    )


def led_row(robot: Robot, group: LedGroup) -> Row:
    """Return the row of a robot's LED."""
    return Row("led", led_keys(robot, group))


def sensor_row(robot: Robot, group: str, columns: Iterable[StreamColumn]) -> Row:
    """Return the row of a group of sensors; ``values`` are the names of its values, ``units`` their units."""
    columns = tuple(columns)
    data: dict[str, object] = {"robot": robot.key, "name": group}
    data["values"] = [column.name for column in columns]
    return Row("sensor", data | {"units": {column.name: column.unit for column in columns if column.unit}})


def planned_row(planned: "PlannedProbe") -> Row:
    """Return the row of a probe of a dry run; ``sent`` are the bytes that would be sent."""
    command, known = planned.command, planned.knowledge
    return Row(
        "planned",
        {
            "number": planned.number,
            "target": command.target,
            "did": command.did,
            "cid": command.cid,
            "name": known.name if known else None,
            "risk": planned.risk.word,
            "payload": command.payload.hex(),
            "sent": planned.frame.hex(),
            "withheld": planned.blocked,
        },
    )


def address_row(said: AddressMeaning) -> Row:
    """Return the row of what an address stands for in one place of a packet."""
    use, address, meaning, basis = said
    data: dict[str, object] = {"address": address.byte, "use": use.value}
    data |= {"port": address.port, "node": address.node, "meaning": meaning, "words": said.words}
    return Row("address", data | {"basis": basis})


def byte_row(number: int, part: Part) -> Row:
    """Return the row of one byte of a packet; ``number`` is the packet's place in the input, from 1."""
    offset, raw, name, value, meaning = part
    data: dict[str, object] = {"packet": number, "offset": offset, "raw": raw.hex()}
    return Row("byte", data | {"field": name or None, "value": value, "meaning": meaning})


def plan_row(name: str, summary: str, file: Path | str | None, robots: Iterable[str]) -> Row:
    """Return the row of a plan; ``robots`` are keys, empty for any robot."""
    return Row(
        "plan",
        {"name": name, "summary": summary, "file": str(file) if file else None, "robots": list(robots)},
    )


def code_row(generation: Generation, code: int) -> Row:
    """Return the row of an answer's code; ``proves`` says what it tells about the command."""
    codec = CODECS[generation]
    verdict = codec.verdict(code)
    data: dict[str, object] = {"generation": generation.value, "code": code, "name": codec.code_name(code)}
    return Row("code", data | {"meaning": verdict.value, "proves": PROVES[verdict]})


def fact_row(fact: "Fact") -> Row:
    """Return the row of a fact that a robot reports; ``node`` is a node's name, null for the robot."""
    name, value, unit, node = fact
    return Row("fact", {"name": name, "value": value, "unit": unit, "node": node or None})
