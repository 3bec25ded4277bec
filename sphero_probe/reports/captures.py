"""Rows and columns of captures: packets with time, direction and connection, and what a capture shows."""

from datetime import UTC, datetime, timedelta
from typing import Final

from sphero_probe.captures.packet import CapturedPacket
from sphero_probe.captures.summary import RobotSummary, Tally, spread
from sphero_probe.catalogue.model import Robot
from sphero_probe.catalogue.streams import StreamDecoder
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Packet
from sphero_probe.reports import phrases
from sphero_probe.reports.phrases import Data, hex_id, shown, spaced_hex
from sphero_probe.reports.rows import Row, packet_row
from sphero_probe.reports.views import PACKETS, Column, Place, View

_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)
_DIRECTIONS: Final = {True: "to robot", False: "from robot"}


def captured_row(
    captured: CapturedPacket, packet: Packet, robot: Robot | None, streams: StreamDecoder | None
) -> Row:
    """Return the row of a packet of a capture: the keys of ``packet_row`` and where and when it was heard.

    ``time`` is an RFC 3339 text with microseconds, ``direction`` is ``to robot`` or ``from robot``,
    ``connection`` its number and the robot's name, if known. What the capture does not tell is null.
    ``doubt``, where there is some, is why damage may have made the packet.

    Args:
        captured: the packet.
        packet: the same, with what its neighbours tell about it.
        robot: the model whose meaning of the packet counts, None where it is not known.
        streams: what reads the robot's sensor streams.
    """
    row = packet_row(packet, captured.generation, captured.raw, robot, streams)
    return Row(
        "packet",
        row.data
        | {
            "time": time_text(captured.time),
            "direction": _DIRECTIONS.get(captured.to_robot) if captured.to_robot is not None else None,
            "connection": captured.connection.label,
        }
        | ({"doubt": captured.doubt} if captured.doubt else {}),
    )


def placed(row: Row, time: str | None, to_robot: bool | None) -> Row:
    """Return the row of a packet of a text, with time, as the text writes it, and direction."""
    told = {"time": time, "direction": None if to_robot is None else _DIRECTIONS[to_robot]}
    return Row(row.type, row.data | {key: value for key, value in told.items() if value is not None})


def time_text(time: int | None) -> str | None:
    """Return nanoseconds since 1970 as RFC 3339 UTC, None where no calendar has them."""
    try:
        when = None if time is None else _EPOCH + timedelta(microseconds=time // 1000)
    except OverflowError:
        return None
    return when.isoformat(timespec="microseconds").replace("+00:00", "Z") if when else None


def tally_row(robot: RobotSummary, tally: Tally) -> Row:
    """Return the row of one command or notification of one robot; ``codes`` are answers by name."""
    codec = CODECS[tally.generation]
    times = spread(tally.times)
    return Row(
        "heard",
        {
            "connection": robot.connection.label,
            "generation": tally.generation.value,
            "kind": tally.kind,
            "did": tally.did,
            "cid": tally.cid,
            "name": tally.name,
            "known": tally.name is not None,
            "count": tally.count,
            "lengths": sorted(tally.lengths),
            "first": None if tally.first is None else tally.first.hex(),
            "codes": {f"0x{code:02x} {codec.code_name(code)}": count for code, count in tally.codes.items()},
            "answers": tally.codes.total(),
            "rtt_ms": list(times) if times else None,
        },
    )


def connection_row(robot: RobotSummary) -> Row:
    """Return the row of one robot as a whole; ``rtt_ms`` is the least, the middle and the most."""
    times = spread(robot.times)
    return Row(
        "connection",
        {
            "connection": robot.connection.label,
            "address": robot.connection.peer,
            "commands": robot.commands,
            "answers": robot.answers,
            "answers_to_none": robot.stray,
            "notifications": robot.notifications,
            "malformed": robot.malformed,
            "rtt_ms": list(times) if times else None,
            "most_in_flight": robot.pairing.most_in_flight,
            "out_of_order": robot.out_of_order,
            "splits": {str(size): count for size, count in sorted(robot.splits.items())},
        },
    )


def connection_line(robot: RobotSummary) -> str:
    """Return the same in a line."""
    data = connection_row(robot).data
    order = "in order" if not robot.out_of_order else f"{robot.out_of_order} out of order"
    parts = [
        f"{robot.commands} commands",
        f"{robot.answers} answers, {order}",
        f"{robot.notifications} notifications",
        f"at most {robot.pairing.most_in_flight} in flight",
    ]
    if times := spread(robot.times):
        parts.insert(2, f"round trips {times[0]:g} to {times[2]:g} ms, median {times[1]:g} ms")
    if robot.stray:
        parts.append(f"{robot.stray} answers to no command of the capture")
    if robot.malformed:
        parts.append(f"{robot.malformed} malformed")
    if robot.splits:
        sizes = ", ".join(f"{size} bytes" for size in sorted(robot.splits))
        parts.append(f"frames are split at {sizes}")
    return f"Connection {data['connection']}: {'; '.join(parts)}."


def _column(key: str, place: Place, title: str = "") -> Column:
    return Column(key, title or key.capitalize(), lambda data: shown(data.get(key)), place, whole=True)


def _id(key: str) -> Column:
    return Column(key, key, lambda data: hex_id(data.get(key)), Place.RECORD)


def _clock(data: Data) -> str:
    return shown(data.get("time")).rpartition("T")[2].rstrip("Z")


_WHERE: Final = ("time", "direction", "connection")
CAPTURED: Final = PACKETS._replace(
    columns=(
        Column("", "Time", _clock, Place.TABLE, whole=True),
        Column("", "Robot", lambda data: shown(data.get("connection")), Place.TABLE),
        Column("", "Way", lambda data: shown(data.get("direction")).partition(" ")[0], Place.TABLE),
        *PACKETS.columns,
        *(_column(key, Place.RECORD) for key in ("doubt", *_WHERE)),
    )
)
"""Packets of captures: their columns, and behind them time, direction and connection."""


def _answers(data: Data) -> str:
    codes = data.get("codes")
    return ", ".join(f"{count} x {name}" for name, count in codes.items()) if isinstance(codes, dict) else ""


HEARD_COMMANDS: Final = View(
    "heard",
    (
        _column("connection", Place.BOTH, "Robot"),
        *(_column(key, Place.RECORD) for key in ("generation", "kind")),
        *map(_id, ("did", "cid")),
        Column("", "DID:CID", phrases.pair, Place.TABLE, whole=True),
        Column("", "Name", lambda data: shown(data.get("name")) or "unknown", Place.TABLE),
        *(_column(key, Place.RECORD) for key in ("name", "known")),
        Column("count", "Count", lambda data: shown(data.get("count")), right=True, whole=True),
        Column("lengths", "Bytes", lambda data: shown(data.get("lengths"))),
        Column("first", "First payload", lambda data: spaced_hex(data.get("first"))),
        Column("codes", "Answers", _answers),
        _column("answers", Place.RECORD),
        Column("rtt_ms", "Round trip ms", lambda data: shown(data.get("rtt_ms"))),
    ),
    "No Sphero packets.",
)
"""What a capture holds, a command or notification a line."""
