"""``info``: a robot's address goes in, what it says about itself comes out."""

from typing import TYPE_CHECKING

import click

from sphero_probe.cli.options import device_options, output_options
from sphero_probe.cli.output import Output

if TYPE_CHECKING:
    from sphero_probe.reports.rows import Row


@click.command("info")
@device_options
@output_options
def command(output: Output, device: str, **connecting: object) -> None:
    """Ask a robot about itself: firmware per node, battery, addresses, SKU.

    Example: sphero-probe info --device fake:bolt-plus
    """
    from sphero_probe.catalogue.well_known import FACTS as ASKED
    from sphero_probe.cli.connect import connect
    from sphero_probe.cli.run import start_run
    from sphero_probe.cli.signals import Interrupts, run_interruptible
    from sphero_probe.link.policy import Consent
    from sphero_probe.probing.facts import Fact, facts_of, probes_of
    from sphero_probe.probing.plan import Plan
    from sphero_probe.reports.rows import fact_row
    from sphero_probe.reports.views import FACTS

    interrupts = Interrupts()
    rows: list[Row] = []

    async def work() -> None:
        async with connect(device, Consent(), **connecting) as session:  # type: ignore[arg-type]
            connection = session.connection
            robot = connection.robot
            rows.append(fact_row(Fact("name", connection.name)))
            rows.append(fact_row(Fact("model", robot.name if robot else "unknown")))
            rows.append(fact_row(Fact("generation", connection.generation.value)))
            rows.append(fact_row(Fact("address", connection.address)))
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
                rows.extend(map(fact_row, facts_of(finding, robot)))

    run_interruptible(interrupts, work())
    output.show(FACTS, rows)
