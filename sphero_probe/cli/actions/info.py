"""``info``: print what a robot says about itself."""

from sphero_probe.catalogue.well_known import FACTS as ASKED
from sphero_probe.cli.connect import connect
from sphero_probe.cli.output import show
from sphero_probe.cli.run import start_run
from sphero_probe.cli.signals import Interrupts, run_interruptible
from sphero_probe.cli.values import ConnectOptions, Output
from sphero_probe.link.policy import Consent
from sphero_probe.probing.facts import Fact, facts_of, facts_of_line, probes_of
from sphero_probe.probing.finding import Finding, Heading
from sphero_probe.probing.plan import Plan
from sphero_probe.reports.rows import Row, fact_row
from sphero_probe.reports.views import FACTS


def show_info(output: Output, connecting: ConnectOptions) -> None:
    """Send the documented reads that describe a robot, and show the answers.

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
            findings: dict[int, Finding] = {}
            async for record in run.records():
                if isinstance(record, Heading):
                    rows.extend(map(fact_row, facts_of_line(record)))
                elif isinstance(record, Finding):
                    findings[record.number] = record
            for _, finding in sorted(findings.items()):
                rows.extend(map(fact_row, facts_of(finding, robot)))

    run_interruptible(interrupts, work())
    show(output, FACTS, rows)
