"""``nodes``: the nodes of a robot, and the documented way of a command to one of them."""

import re
from asyncio import Event
from typing import TYPE_CHECKING, Final

from sphero_probe.catalogue import ROBOTS, lookup
from sphero_probe.catalogue.addresses import BLE_PORT, UART_PORT
from sphero_probe.catalogue.naming import pair
from sphero_probe.catalogue.routing import Route, documented_hops
from sphero_probe.cli.connect import connect
from sphero_probe.cli.messages import say
from sphero_probe.cli.output import show
from sphero_probe.cli.signals import Interrupts, run_interruptible
from sphero_probe.cli.values import ConnectOptions, Output
from sphero_probe.errors import UsageError
from sphero_probe.link.policy import Consent
from sphero_probe.probing.nodes import survey
from sphero_probe.probing.notes import tolerance_notes
from sphero_probe.protocol.address import PRIMARY
from sphero_probe.reports.nodes import HOPS, NODES, hop_row, system_rows
from sphero_probe.session.addressing import address_of, model_behind, port_behind

if TYPE_CHECKING:
    from sphero_probe.reports.rows import Row

_HEX_PAIR: Final = re.compile(r"[0-9a-fA-F]{1,2}[:/][0-9a-fA-F]{1,2}")
_LARGEST: Final = ROBOTS["rvr"]
"""Stands for a robot that is not named: its system is the one that the vendor describes."""


def show_nodes(output: Output, connecting: ConnectOptions) -> None:
    """Ask a robot about its nodes and show them.

    Args:
        output: where and how.
        connecting: which robot.

    Raises:
        SpheroProbeError: the robot cannot be reached, or does not answer.
    """
    interrupts = Interrupts()
    rows: list[Row] = []

    async def work() -> None:
        async with connect(connecting, Consent()) as session:
            stop = Event()
            interrupts.stop_politely(stop)
            system = await survey(session, stop)
            rows.extend(system_rows(system, session.link.codec))
            for note in tolerance_notes(session.link.tolerated):
                say(f"note: {note.text}")
            if system.note and output.format in ("plain", "csv"):
                say(system.note)

    run_interruptible(interrupts, work())
    show(output, NODES, rows)


def trace_hops(output: Output, connecting: ConnectOptions, what: str) -> None:
    """Show the documented hops of a command and its answer; nothing is sent.

    Args:
        output: where and how.
        connecting: which robot; only its address is read.
        what: the command: ``16:41`` in hex, ``0x16:0x41`` or a name.

    Raises:
        UsageError: it makes no sense, or the robot has no nodes.
    """
    place = address_of(connecting.device)
    robot = model_behind(place) or _LARGEST
    if not robot.addressed:
        raise UsageError(f"{robot.name} takes commands without addresses: there is no way to trace")
    if _HEX_PAIR.fullmatch(what):
        did, cid = (int(part, 16) for part in re.split("[:/]", what))
    else:
        did, cid = pair(what, robot.generation)
    row = lookup(robot.generation, did, cid, robot)
    nodes = row.nodes.get(robot.key, ()) if row else ()
    if not nodes:
        say(f"note: no catalogue says which node of {robot.name} serves this; node {PRIMARY} is assumed.")
    port = port_behind(place)
    into = BLE_PORT if port else UART_PORT
    route = Route(PRIMARY, port, into, PRIMARY, nodes[0] if nodes else PRIMARY)
    say("as documented; only the last step is visible on a wire, besides what the client sends.")
    say("Captures show that last step with the addresses before it. That node 1 holds the port is assumed.")
    show(output, HOPS, (hop_row(number, hop) for number, hop in enumerate(documented_hops(route), 1)))
