"""Defines the columns of each type of row, and how their cells read.

Cells are raw text: each format makes them visible in its own way. The record columns (``plain``, ``csv``)
have the names and the order of the row's keys. Scripts depend on that, so a new column goes to the end.
"""

from collections.abc import Callable
from enum import Enum
from typing import Final, NamedTuple

from sphero_probe.reports import phrases
from sphero_probe.reports.phrases import Data, hex_id, shown, spaced_hex

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
    """

    key: str
    title: str
    render: Render
    place: Place = Place.BOTH
    right: bool = False
    whole: bool = False


class View(NamedTuple):
    """How a list of rows is shown.

    Attributes:
        type: the rows it shows.
        columns: in order.
        empty: what a table says without a row.
        upright: a table shows each row as lines of title and value.
    """

    type: str
    columns: tuple[Column, ...]
    empty: str
    upright: bool = False

    @property
    def table_columns(self) -> tuple[Column, ...]:
        """The columns that people see."""
        return tuple(column for column in self.columns if column.place is not Place.RECORD)

    @property
    def record_columns(self) -> tuple[Column, ...]:
        """The columns that scripts read."""
        return tuple(column for column in self.columns if column.place is not Place.TABLE)


def _both(
    key: str,
    title: str = "",
    show: Callable[[object], str] = shown,
    *,
    right: bool = False,
    whole: bool = False,
) -> Column:
    """A column of one key for people and scripts."""
    title = title or key.capitalize()
    return Column(key, title, lambda data: show(data.get(key)), Place.BOTH, right, whole)


def _record(*keys: str, show: Callable[[object], str] = shown) -> tuple[Column, ...]:
    """Columns of one key each for scripts."""
    return tuple(_both(key, show=show)._replace(place=Place.RECORD) for key in keys)


def _table(title: str, render: Render, *, right: bool = False, whole: bool = False) -> Column:
    """A column for people, made of any keys."""
    return Column("", title, render, Place.TABLE, right, whole)


_PAIR: Final = _table("DID:CID", phrases.pair, whole=True)
_FIELDS: Final = Column("fields", "Fields", phrases.fields, Place.RECORD)

_FINDING_RECORD: Final = (
    *_record("number"),
    *_record("target", "answered_by", "did", "cid", show=hex_id),
    *_record("name", "risk", "outcome", "confidence"),
    *_record("code", show=hex_id),
    *_record("code_name"),
    *_record("payload", show=spaced_hex),
    _FIELDS,
    *_record("sent", "received", show=spaced_hex),
    *_record("rtt_ms", "attempts", "note"),
)

FINDINGS: Final = View("finding", _FINDING_RECORD, "Nothing was asked.")
"""Findings of a run; their table has a layout of its own."""

FINDING: Final = View(
    "finding",
    (
        *_FINDING_RECORD,
        _PAIR,
        _table("Name", lambda data: shown(data.get("name")) or "not in any catalogue"),
        _table("Node", phrases.node_asked),
        _table("Answered by", phrases.answered_by),
        _table("Risk", lambda data: shown(data.get("risk"))),
        _table("Outcome", lambda data: phrases.remarked(shown(data.get("outcome")), data.get("note"))),
        _table("Answer", lambda data: phrases.outcome(data) if data.get("sent") else ""),
        _table("Time", lambda data: "" if data.get("rtt_ms") is None else f"{shown(data['rtt_ms'])} ms"),
        _table("Sent", lambda data: spaced_hex(data.get("sent"))),
        _table("Received", lambda data: spaced_hex(data.get("received"))),
    ),
    "Nothing was asked.",
    upright=True,
)
"""One finding in full."""

NOTES: Final = View(
    "note",
    (
        _both("kind", whole=True),
        *_record("text"),
        *_record("did", "cid", "source", show=hex_id),
        *_record("name"),
        *_record("payload", show=spaced_hex),
        _FIELDS,
        *_record("raw", "received", show=spaced_hex),
        _table("What", phrases.note),
    ),
    "Nothing was heard.",
)
"""Notes: what was heard besides the answers."""

ROBOTS: Final = View(
    "robot",
    (
        _both("name"),
        _both("model"),
        _both("generation", "Protocol", whole=True),
        _both("address"),
        _both("rssi", "RSSI dBm", right=True, whole=True),
        _table("Note", lambda data: "connected to this machine" if data.get("connected") else ""),
    ),
    "No robots found.",
)

PACKETS: Final = View(
    "packet",
    (
        *_record("generation"),
        _both("kind", whole=True),
        *_record("did", "cid", show=hex_id),
        _PAIR,
        _both("seq", right=True, whole=True),
        *_record("code", show=hex_id),
        *_record("code_name"),
        *_record("target", "source", show=hex_id),
        _table("Nodes", phrases.addresses),
        _both("name"),
        _FIELDS,
        *_record("payload", "raw", show=spaced_hex),
        *_record("reason", "note", "leds", "target_means", "source_means", "flags"),
        _table("Says", phrases.packet),
    ),
    "No packets.",
)

HEARD: Final = View("packet", (_both("time", whole=True), *PACKETS.columns), "Nothing was heard.")
"""Packets with the time they arrived, as ``listen`` shows them."""

_COMMAND_RECORD: Final = (
    *_record("generation"),
    *_record("did", "cid", show=hex_id),
    *_record("name", "kind", "risk"),
    *_record("request", "response", show=phrases.layout_record),
    *_record("robots", show=phrases.robots),
    *_record("sources", "aliases", "note"),
    *_record("provenance", show=phrases.provenance),
    *_record("firmware", show=phrases.sightings),
    *_record("enabled_by", "since"),
)
_COMMAND_TABLE: Final = (
    _PAIR,
    _table("Name", lambda data: shown(data.get("name"))),
    _table("Risk", phrases.role, whole=True),
)

COMMANDS: Final = View(
    "command",
    (
        *_COMMAND_RECORD,
        *_COMMAND_TABLE,
        _table("Takes -> gives", phrases.exchanged),
        _table("Remark", phrases.catalogue_remark),
    ),
    "No known command.",
)
"""The catalogue, one line per command."""

COMMAND: Final = View(
    "command",
    (
        *_COMMAND_RECORD,
        _table("Protocol", lambda data: shown(data.get("generation"))),
        *_COMMAND_TABLE,
        _table("Takes -> gives", phrases.exchanged),
        _table("Robots", lambda data: phrases.robots(data.get("robots"))),
        _table("Known from", lambda data: shown(data.get("sources"))),
        _table("Uncertain", phrases.weak_provenance),
        _table("Firmware", phrases.firmware),
        _table("Enabled by", phrases.switch),
        _table("Also called", lambda data: shown(data.get("aliases"))),
        _table("Note", lambda data: shown(data.get("note"))),
    ),
    "No known command.",
    upright=True,
)
"""One catalogue entry in full."""

PLANNED: Final = View(
    "planned",
    (
        _both("number", "#", right=True, whole=True),
        _both("target", "Node", hex_id, whole=True),
        *_record("did", "cid", show=hex_id),
        _PAIR,
        *_record("name"),
        _table("Name", lambda data: shown(data.get("name")) or "not in any catalogue"),
        _both("risk", whole=True),
        *_record("payload", show=spaced_hex),
        _both("sent", "Bytes", spaced_hex),
        _both("withheld", "Blocked because"),
    ),
    "No probes.",
)
"""What a run would send, and what it would block."""

ADDRESSES: Final = View(
    "address",
    (
        _both("address", "Address", hex_id, whole=True),
        _both("use", "As the", whole=True),
        *_record("port", "node"),
        *_record("meaning"),
        _table("Means", lambda data: shown(data.get("words"))),
        *_record("words"),
        _both("basis", "Evidence"),
    ),
    "No addresses.",
)
"""What an address byte stands for, place by place."""

BYTES: Final = View(
    "byte",
    (
        _both("packet", "#", right=True, whole=True),
        _both("offset", "Offset", right=True, whole=True),
        _both("raw", "Raw", spaced_hex, whole=True),
        _both("field", "Field", whole=True),
        _both("value", "Value", hex_id, whole=True),
        _both("meaning", "Meaning"),
    ),
    "No packets.",
)
"""Packets byte by byte."""

LEDS: Final = View(
    "led",
    (
        _both("robot", whole=True),
        _both("name", "LED", whole=True),
        *_record("aliases"),
        *_record("channels"),
        _table("Also", lambda data: shown(data.get("aliases"))),
        _table("Channels", phrases.channels),
    ),
    "No LEDs are known for this robot.",
)
"""The LEDs of a robot, as ``led --list`` shows them."""

PLANS: Final = View(
    "plan",
    (
        _both("name"),
        _both("summary"),
        *_record("file", "robots"),
        _table("Robots", lambda data: shown(data.get("robots")) or "any"),
        _table("File", lambda data: shown(data.get("file"))),
    ),
    "No plans.",
)

CODES: Final = View(
    "code",
    (
        _both("generation", "Protocol", whole=True),
        _both("code", "Code", hex_id, whole=True),
        _both("name"),
        _both("meaning"),
        _both("proves", "What it tells"),
    ),
    "No codes.",
)

FACTS: Final = View(
    "fact",
    (
        _both("name", "What"),
        *_record("value", "unit"),
        _table("Value", phrases.measured),
        _both("node"),
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
        *_record("when"),
        _both("robot"),
        *_record("model", "command", "plan", "counts", "complete"),
        _table("Found", phrases.found),
        _table("End", phrases.end_of_run),
        *_record("file", "problem"),
    ),
    "No runs are recorded yet.",
)
"""Journals, as ``runs`` lists them."""
