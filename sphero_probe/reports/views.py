"""Defines the columns of each type of row, and how their cells read.

Cells are raw text: each format makes them visible in its own way. The record columns (``plain``, ``csv``)
have the names and the order of the row's keys. Scripts depend on that, so a new column goes to the end.
"""

from collections.abc import Callable, Iterable
from enum import Enum
from typing import Final, NamedTuple

from sphero_probe.reports import address_phrases, phrases
from sphero_probe.reports.phrases import Data, hex_id, shown, spaced_hex
from sphero_probe.reports.selection import Selection

Render = Callable[[Data], str]


class Place(Enum):
    """Where a column is shown."""

    BOTH = "both"
    TABLE = "table"
    RECORD = "record"


class Column(NamedTuple):
    """One column.

    Attributes:
        key: of the row's data; names the column in a header of records.
        title: for people.
        render: a row's data -> the cell's raw text.
        place: where it is shown.
        right: aligned to the right.
        whole: its cells are never folded.
        show: the value of ``key`` -> the cell's raw text; None where ``render`` reads other keys, too.
        reads: the keys that ``render`` reads, if it is known; None for any.
    """

    key: str
    title: str
    render: Render
    place: Place = Place.BOTH
    right: bool = False
    whole: bool = False
    show: Callable[[object], str] | None = None
    reads: tuple[str, ...] | None = None


class View(NamedTuple):
    """How a list of rows is shown.

    Attributes:
        type: the rows it shows.
        columns: in order.
        empty: what a table says without a row.
        upright: a table shows each row as lines of title and value.
        legend: a row's data -> what a table explains below, each line once.
        selection: which findings of a run are shown, and in which order.
        document: the findings of a run become a reference of the robot's commands.
        below: another list that a table shows below this one, None for none.
        heading: what is said above the list where it stands below another one.
    """

    type: str
    columns: tuple[Column, ...]
    empty: str
    upright: bool = False
    legend: Callable[[Data], Iterable[str]] = lambda _: ()
    selection: Selection = Selection()
    document: bool = False
    below: "View | None" = None
    heading: str = ""

    @property
    def table_columns(self) -> tuple[Column, ...]:
        """The columns that people see."""
        return tuple(column for column in self.columns if column.place is not Place.RECORD)

    @property
    def record_columns(self) -> tuple[Column, ...]:
        """The columns that scripts read."""
        return tuple(column for column in self.columns if column.place is not Place.TABLE)


def both(
    key: str,
    title: str = "",
    show: Callable[[object], str] = shown,
    *,
    right: bool = False,
    whole: bool = False,
) -> Column:
    """A column of one key for people and scripts."""
    title = title or key.capitalize()
    return Column(key, title, lambda data: show(data.get(key)), Place.BOTH, right, whole, show)


def record_only(*keys: str, show: Callable[[object], str] = shown) -> tuple[Column, ...]:
    """Columns of one key each for scripts."""
    return tuple(both(key, show=show)._replace(place=Place.RECORD) for key in keys)


def table_only(title: str, render: Render, *, right: bool = False, whole: bool = False) -> Column:
    """A column for people, made of any keys."""
    return Column("", title, render, Place.TABLE, right, whole)


def _units(units: object) -> list[str]:
    """Return the different units of a row."""
    return list(dict.fromkeys(map(shown, units.values()))) if isinstance(units, dict) else []


_PAIR: Final = table_only("DID:CID", phrases.pair, whole=True)
_FIELDS: Final = Column(
    "fields", "Fields", phrases.fields, Place.RECORD, reads=("fields", "units", "payload")
)

_FINDING_RECORD: Final = (
    *record_only("number"),
    *record_only("target", "answered_by", "did", "cid", show=hex_id),
    *record_only("name", "risk", "outcome", "confidence"),
    *record_only("code", show=hex_id),
    *record_only("code_name"),
    *record_only("payload", show=spaced_hex),
    _FIELDS,
    *record_only("sent", "received", show=spaced_hex),
    *record_only("rtt_ms", "attempts", "note", "state"),
    *record_only("request", show=spaced_hex),
    Column("arguments", "Arguments", phrases.arguments, Place.RECORD),
)

FINDINGS: Final = View("finding", _FINDING_RECORD, "Nothing was asked.")
"""Findings of a run; their table has a layout of its own."""

PROTOCOL: Final = FINDINGS._replace(document=True)
"""A reference of the commands of the robot that a run asked."""

FINDING: Final = View(
    "finding",
    (
        *_FINDING_RECORD,
        _PAIR,
        table_only("Name", lambda data: shown(data.get("name")) or "not in any catalogue"),
        table_only("Node", address_phrases.node_asked),
        table_only("Answered by", address_phrases.answered_by),
        table_only("Risk", lambda data: shown(data.get("risk"))),
        table_only("Arguments", phrases.arguments),
        table_only("State", lambda data: phrases.remarked(shown(data.get("state")), data.get("note"))),
        table_only("Answer", lambda data: phrases.outcome(data) if data.get("sent") else ""),
        table_only("Time", lambda data: "" if data.get("rtt_ms") is None else f"{shown(data['rtt_ms'])} ms"),
        table_only("Sent", lambda data: spaced_hex(data.get("sent"))),
        table_only("Received", lambda data: spaced_hex(data.get("received"))),
    ),
    "Nothing was asked.",
    upright=True,
)
"""One finding in full."""

NOTES: Final = View(
    "note",
    (
        both("kind", whole=True),
        *record_only("text"),
        *record_only("did", "cid", "source", show=hex_id),
        *record_only("name"),
        *record_only("payload", show=spaced_hex),
        _FIELDS,
        *record_only("raw", "received", show=spaced_hex),
        table_only("What", phrases.note),
    ),
    "Nothing was heard.",
)
"""Notes: what was heard besides the answers."""

ROBOTS: Final = View(
    "robot",
    (
        both("name"),
        both("model"),
        both("generation", "Protocol", whole=True),
        both("address"),
        both("rssi", "RSSI dBm", right=True, whole=True),
        table_only("Note", lambda data: "connected to this machine" if data.get("connected") else ""),
    ),
    "No robots found.",
)

PACKETS: Final = View(
    "packet",
    (
        *record_only("generation"),
        both("kind", whole=True),
        *record_only("did", "cid", show=hex_id),
        _PAIR,
        both("seq", right=True, whole=True),
        *record_only("code", show=hex_id),
        *record_only("code_name"),
        *record_only("target", "source", show=hex_id),
        table_only("Nodes", address_phrases.addresses),
        both("name"),
        _FIELDS,
        *record_only("payload", "raw", show=spaced_hex),
        *record_only("reason", "note", "leds", "target_means", "source_means", "flags"),
        table_only("Says", phrases.packet),
    ),
    "No packets.",
    legend=address_phrases.legend,
)

HEARD: Final = PACKETS._replace(
    columns=(both("time", whole=True), *PACKETS.columns), empty="Nothing was heard."
)
"""Packets with the time they arrived, as ``listen`` shows them."""

_COMMAND_RECORD: Final = (
    *record_only("generation"),
    *record_only("did", "cid", show=hex_id),
    *record_only("name", "kind", "risk"),
    *record_only("request", "response", show=phrases.layout_record),
    *record_only("robots", show=phrases.robots),
    *record_only("sources", "aliases", "note"),
    *record_only("provenance", show=phrases.provenance),
    *record_only("firmware", show=phrases.sightings),
    *record_only("enabled_by", "since"),
)
_COMMAND_TABLE: Final = (
    _PAIR,
    table_only("Name", lambda data: shown(data.get("name"))),
    table_only("Risk", phrases.role, whole=True),
)

COMMANDS: Final = View(
    "command",
    (
        *_COMMAND_RECORD,
        *_COMMAND_TABLE,
        table_only("Takes -> gives", phrases.exchanged),
        table_only("Remark", phrases.catalogue_remark),
    ),
    "No known command.",
)
"""The catalogue, one line per command."""

COMMAND: Final = View(
    "command",
    (
        *_COMMAND_RECORD,
        table_only("Protocol", lambda data: shown(data.get("generation"))),
        *_COMMAND_TABLE,
        table_only("Takes -> gives", phrases.exchanged),
        table_only("Robots", lambda data: phrases.robots(data.get("robots"))),
        table_only("Known from", lambda data: shown(data.get("sources"))),
        table_only("Uncertain", phrases.weak_provenance),
        table_only("Firmware", phrases.firmware),
        table_only("Enabled by", phrases.switch),
        table_only("Also called", lambda data: shown(data.get("aliases"))),
        table_only("Note", lambda data: shown(data.get("note"))),
    ),
    "No known command.",
    upright=True,
)
"""One catalogue entry in full."""

DIFFERENCES: Final = View(
    "library",
    (
        both("known_by", "Known by", whole=True),
        *record_only("generation"),
        *record_only("did", "cid", show=hex_id),
        *record_only("kind"),
        _PAIR,
        both("name"),
        both("their_name", "Their name"),
        both("robots"),
    ),
    "Both know the same.",
)
"""What only the catalogue or only another library knows."""

PLANNED: Final = View(
    "planned",
    (
        both("number", "#", right=True, whole=True),
        both("target", "Node", hex_id, whole=True),
        *record_only("did", "cid", show=hex_id),
        _PAIR,
        *record_only("name"),
        table_only("Name", lambda data: shown(data.get("name")) or "not in any catalogue"),
        both("risk", whole=True),
        *record_only("payload", show=spaced_hex),
        both("sent", "Bytes", spaced_hex),
        both("withheld", "Blocked because"),
    ),
    "No probes.",
)
"""What a run would send, and what it would block."""

SENSORS: Final = View(
    "sensor",
    (both("robot"), both("name"), both("values"), both("units", show=lambda units: ", ".join(_units(units)))),
    "No sensor streams are known of this robot.",
)

LEDS: Final = View(
    "led",
    (
        both("robot", whole=True),
        both("name", "LED", whole=True),
        *record_only("aliases"),
        *record_only("channels"),
        table_only("Also", lambda data: shown(data.get("aliases"))),
        table_only("Channels", phrases.channels),
    ),
    "No LEDs are known for this robot.",
)
"""The LEDs of a robot, as ``led --list`` shows them."""

PLANS: Final = View(
    "plan",
    (
        both("name"),
        both("summary"),
        *record_only("file", "robots"),
        table_only("Robots", lambda data: shown(data.get("robots")) or "any"),
        table_only("File", lambda data: shown(data.get("file"))),
    ),
    "No plans.",
)

CODES: Final = View(
    "code",
    (
        both("generation", "Protocol", whole=True),
        both("code", "Code", hex_id, whole=True),
        both("name"),
        both("meaning"),
        both("proves", "What it tells"),
    ),
    "No codes.",
)

FACTS: Final = View(
    "fact",
    (
        both("name", "What"),
        *record_only("value", "unit"),
        table_only("Value", phrases.measured),
        both("node"),
    ),
    "The robot reported nothing about itself.",
)


def _name_of_run(data: Data) -> str:
    """Return the file's name as ``report`` takes it: when, which robot, which plan."""
    return shown(data.get("file")).replace("\\", "/").rpartition("/")[2].removesuffix(".jsonl")


RUNS: Final = View(
    "run_file",
    (
        Column("", "Run", _name_of_run, Place.TABLE, whole=True),
        *record_only("when"),
        both("robot"),
        *record_only("model", "command", "plan", "counts", "complete"),
        table_only("Found", phrases.found),
        table_only("End", phrases.end_of_run),
        *record_only("file", "problem"),
        both("tags"),
        *record_only("firmware"),
    ),
    "No runs are recorded yet.",
)
"""Journals, as ``runs`` lists them."""
