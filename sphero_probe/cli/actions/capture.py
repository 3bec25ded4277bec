"""``capture``: what is in a recording."""

from typing import NamedTuple

from sphero_probe.captures.packet import CapturedPacket
from sphero_probe.captures.reader import Capture
from sphero_probe.captures.summary import RobotSummary
from sphero_probe.catalogue.commands import notification_row, rows_of
from sphero_probe.catalogue.naming import id_range
from sphero_probe.cli.captured import capture_in, captured_rows
from sphero_probe.cli.messages import say
from sphero_probe.cli.output import report
from sphero_probe.cli.values import Output
from sphero_probe.protocol.packets import Generation, Notification, Packet, Request, Response
from sphero_probe.reports.captures import (
    CAPTURED,
    HEARD_COMMANDS,
    connection_line,
    connection_row,
    tally_row,
)


class Wanted(NamedTuple):
    """Which packets to show: those of one robot, of some devices, those that no catalogue has."""

    name: str | None
    did: str | None
    unknown: bool


def show_capture(output: Output, path: str, wanted: Wanted, *, summary: bool) -> None:
    """Show the packets of a capture, or what they amount to.

    Args:
        output: where and how.
        path: the file.
        wanted: which packets.
        summary: a line for each command instead of each packet.

    Raises:
        UsageError: the device ids make no sense.
        BadInputFileError: the file is no capture, or nothing in it can be read.
    """
    chosen = None if wanted.did is None else frozenset(id_range(wanted.did, Generation.V2, devices=True))
    with capture_in(path) as capture:
        if summary:
            _summary(output, capture, wanted, chosen)
        else:
            with report(output, CAPTURED) as rows:
                for captured, packet, row in captured_rows(capture, None):
                    if _is_wanted(captured, packet, wanted, chosen):
                        rows.add(row)
        say(f"{path}: {capture.said}")
        if capture.found:
            say("To share it without names and addresses: sphero-probe capture redact FILE -o shared.pcapng")


def _summary(output: Output, capture: Capture, wanted: Wanted, chosen: frozenset[int] | None) -> None:
    robots: dict[int, RobotSummary] = {}
    for captured in capture.packets():
        if wanted.name is None or _is_named(captured, wanted.name):
            number = captured.connection.number
            robots.setdefault(number, RobotSummary(captured.connection)).add(captured)
    tallies = [(robot, tally) for robot in robots.values() for tally in robot.tallies.values()]
    tallies.sort(key=lambda pair: pair[1].name is not None)
    with report(output, HEARD_COMMANDS) as rows:
        for robot, tally in tallies:
            if (chosen is None or tally.did in chosen) and not (wanted.unknown and tally.name):
                rows.add(tally_row(robot, tally))
        for robot in robots.values():
            rows.add(connection_row(robot))
    for robot in robots.values():
        say(connection_line(robot))


def _is_named(captured: CapturedPacket, name: str) -> bool:
    number, peer, said = captured.connection
    return name == str(number) or name.casefold() in {(peer or "").casefold(), (said or "").casefold()}


def _is_wanted(
    captured: CapturedPacket, packet: Packet, wanted: Wanted, chosen: frozenset[int] | None
) -> bool:
    if wanted.name is not None and not _is_named(captured, wanted.name):
        return False
    match packet:
        case Request(command=command):
            did, cid = command.did, command.cid
        case Response(did=int(did), cid=int(cid)) | Notification(did=did, cid=int(cid)):
            pass
        case _:
            return chosen is None and not wanted.unknown
    if wanted.unknown:
        spoken = captured.generation
        known = notification_row(spoken, did, cid, None) if did is None else rows_of(spoken, did, cid)
        if known:
            return False
    return chosen is None or did in chosen
