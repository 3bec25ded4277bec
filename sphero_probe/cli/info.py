"""``info``: a robot's address goes in, what it says about itself comes out."""

from typing import TYPE_CHECKING

import click

from sphero_probe.cli.options import device_options, output_options
from sphero_probe.cli.output import Output

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from sphero_probe.catalogue.model import Robot
    from sphero_probe.probing.finding import Finding
    from sphero_probe.probing.plan import Probe
    from sphero_probe.protocol.packets import Generation
    from sphero_probe.reports.rows import Row


@click.command("info")
@device_options
@output_options
def command(output: Output, device: str, **connecting: object) -> None:
    """Ask a robot about itself: firmware per node, battery, addresses, SKU.

    Example: sphero-probe info --device fake:bolt-plus
    """
    from sphero_probe.catalogue.roles import FACTS as ASKED
    from sphero_probe.cli.interrupts import Interrupts, run_interruptible
    from sphero_probe.cli.running import start_run
    from sphero_probe.cli.session import consent_of, open_session
    from sphero_probe.probing.plan import Plan
    from sphero_probe.reports.rows import fact_row
    from sphero_probe.reports.views import FACTS

    interrupts = Interrupts()
    rows: list[Row] = []

    async def work() -> None:
        async with open_session(device, consent_of(()), **connecting) as session:  # type: ignore[arg-type]
            connection = session.connection
            robot = connection.robot
            rows.append(fact_row("name", connection.name, "", ""))
            rows.append(fact_row("model", robot.name if robot else "unknown", "", ""))
            rows.append(fact_row("generation", connection.generation.value, "", ""))
            rows.append(fact_row("address", connection.address, "", ""))
            names = ASKED[connection.generation]
            plan = Plan(
                "info",
                "what a robot says about itself",
                [list(probes_of(names, connection.generation, robot, connection.port))],
            )
            run = start_run(plan, session, None, interrupts)
            async for _ in run.records():
                pass
            for finding in sorted(run.findings, key=lambda finding: finding.number):
                rows.extend(facts_of(finding, robot))

    run_interruptible(interrupts, work())
    output.show(FACTS, rows)


def probes_of(
    names: "Iterable[str]", generation: "Generation", robot: "Robot | None", port: int
) -> "Iterator[Probe]":
    """Yield a read per fact, on each node that serves it.

    Args:
        names: the commands that ask for the facts.
        generation: whose catalogue has them.
        robot: the model, None where it is not known.
        port: the port nibble on this kind of line.
    """
    from sphero_probe.catalogue import row_by_name
    from sphero_probe.probing.plan import Probe
    from sphero_probe.protocol.packets import Command

    for name in names:
        row = row_by_name(generation, name)
        if row is None:
            continue
        nodes = row.nodes.get(robot.key, ()) if robot else ()
        if robot and not robot.addressed:
            nodes = ()
        for node in nodes or (None,):
            yield Probe(Command(row.did, row.cid, b"", None if node is None else port << 4 | node))


def facts_of(finding: "Finding", robot: "Robot | None") -> "Iterator[Row]":
    """Yield what one answer says; an answer that is none says nothing about the robot.

    Args:
        finding: of a probe of ``probes_of``.
        robot: the model, None where it is not known.
    """
    from sphero_probe.catalogue.roles import VERSION_FIELDS
    from sphero_probe.link.exchange import Answered
    from sphero_probe.probing.notes import node_name
    from sphero_probe.reports.rows import fact_row

    row, exchange = finding.knowledge, finding.exchange
    if (
        row is None
        or row.response is None
        or not isinstance(exchange, Answered)
        or not exchange.response.payload
    ):
        return
    decoded = row.response.decode(exchange.response.payload)
    name = row.name.partition(".")[2].removeprefix("get_")
    node = node_name(finding.command.target, robot) if robot and len(robot.nodes) > 1 else ""
    fields = dict(decoded.fields)
    parts = VERSION_FIELDS[row.generation]
    if all(part in fields for part in parts):
        yield fact_row(name, ".".join(str(fields.pop(part)) for part in parts), "", node)
    alone = len(decoded.fields) == 1
    for field, value in fields.items():
        yield fact_row(name if alone else f"{name} {field}", value, decoded.units.get(field, ""), node)
