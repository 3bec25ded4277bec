"""``stream``: switch on sensor streams by name, show the samples, and switch the streams off again."""

import asyncio
import sys
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from sphero_probe.catalogue import ROBOTS
from sphero_probe.catalogue.risk import Risk
from sphero_probe.catalogue.stream_plan import StreamPlan, sensor_groups, stream_plan
from sphero_probe.catalogue.switches import taken_back
from sphero_probe.cli.connect import connect
from sphero_probe.cli.dry_run import show_dry_run
from sphero_probe.cli.listening import CountedReport, switch_off, wait_for_end
from sphero_probe.cli.messages import say
from sphero_probe.cli.output import report, show
from sphero_probe.cli.signals import Interrupts, run_interruptible
from sphero_probe.cli.values import AskOptions, ConnectOptions, Output
from sphero_probe.errors import OutputError, UsageError
from sphero_probe.link.exchange import Unsolicited
from sphero_probe.link.policy import Consent
from sphero_probe.link.unsolicited import describe_unsolicited
from sphero_probe.probing.failures import check
from sphero_probe.probing.oneshot import send_once
from sphero_probe.probing.plan import Plan, Probe
from sphero_probe.reports.registry import Report
from sphero_probe.reports.rows import Row, sensor_row
from sphero_probe.reports.samples import Samples, sample_view
from sphero_probe.reports.stream_chart import chart
from sphero_probe.reports.streams import takes_unicode, wants_color
from sphero_probe.reports.views import SENSORS
from sphero_probe.session.addressing import address_of, generation_behind, model_behind, port_behind
from sphero_probe.session.session import Session


class StreamOptions(NamedTuple):
    """What to stream, as typed.

    Attributes:
        sensors: names of groups or values.
        rate: samples per second.
        seconds: to stream, None for no limit.
        samples: to stop after, None for any number.
        plot: the file of a chart, None for none.
    """

    sensors: tuple[str, ...]
    rate: float
    seconds: float | None
    samples: int | None
    plot: str | None


def list_sensors(output: Output, device: str) -> None:
    """Show the sensors of the robot that an address names, without connecting, or those of every robot.

    Raises:
        UsageError: the address is not valid.
    """
    robot = model_behind(address_of(device)) if device else None
    robots = (robot,) if robot else tuple(ROBOTS.values())
    rows = [
        sensor_row(one, group, columns) for one in robots for group, columns in sensor_groups(one).items()
    ]
    show(output, SENSORS, rows)


def stream(output: Output, connecting: ConnectOptions, asking: AskOptions, options: StreamOptions) -> None:
    """Stream sensors until there are enough samples, the time is up, or Ctrl-C.

    Args:
        output: where and how to show the samples.
        connecting: which robot.
        asking: whether this is a dry run; streaming is allowed by asking for it.
        options: what to stream.

    Raises:
        SpheroProbeError: the robot has no such sensor, cannot be reached, or rejects the commands.
    """
    if not options.sensors:
        raise UsageError("no sensor is named", "sphero-probe stream --list prints the sensors")
    if options.plot and Path(options.plot).suffix.lower() != ".svg":
        raise UsageError(f"{options.plot}: a chart is an .svg picture", "for example: --plot run.svg")
    place = address_of(connecting.device)
    consent = Consent.of(asking.allow, asking.confirm, Risk.WRITE)  # streaming is what was asked for
    if asking.dry_run:
        plan = stream_plan(model_behind(place), port_behind(place), options.sensors, options.rate)
        off = taken_back(generation_behind(place), plan.start)
        probes = [Probe(command, exact=True) for command in (*plan.start, *off)]
        show_dry_run(output, Plan("stream", "", [probes]), place, consent, None)
        return
    if robot := model_behind(place):
        stream_plan(robot, port_behind(place), options.sensors, options.rate)  # errors before connecting
    interrupts, stop = Interrupts(), asyncio.Event()
    kept: deque[Row] = deque(maxlen=None if options.plot else 0)

    async def work() -> None:
        interrupts.stop_politely(stop)
        async with connect(connecting, consent, timeout=asking.timeout) as session:
            connection = session.connection
            plan = stream_plan(connection.robot, connection.port, options.sensors, options.rate)
            with _report(output, plan) as rows:
                taken = _Taker(CountedReport(rows, options.samples, stop), Samples(plan.columns), kept)
                await _run(session, plan, taken, stop, options.seconds)
                taken.end()
            if options.plot:
                _draw(options.plot, f"{connection.name}, {', '.join(options.sensors)}", plan, kept)

    run_interruptible(interrupts, work())


async def _run(
    session: Session, plan: StreamPlan, taken: "_Taker", stop: asyncio.Event, seconds: float | None
) -> None:
    """Switch the streams on, wait for the end, and switch them off."""
    executed = []
    try:
        with describe_unsolicited(session.link, taken.hear):
            for command in plan.start:
                executed.append(command)
                await check(await send_once(session.link, command), session)
            await wait_for_end(session, stop, seconds)
    finally:
        await switch_off(session, executed)


@contextmanager
def _report(output: Output, plan: StreamPlan) -> Iterator[Report]:
    """Open a live table on a terminal, any other report elsewhere."""
    if output.file is None and output.format == "table" and sys.stdout.isatty():
        from sphero_probe.reports.stream_watch import StreamWatch  # noqa: PLC0415 - imports rich

        color, unicode = wants_color(output.color, sys.stdout), takes_unicode(sys.stdout)
        with StreamWatch(sys.stdout, plan.columns, color=color, unicode=unicode) as watch:
            yield watch
        return
    with report(output, sample_view(plan.columns), live=True) as rows:
        yield rows


def _draw(file: str, title: str, plan: StreamPlan, samples: Iterable[Row]) -> None:
    """Write the chart.

    Raises:
        OutputError: the file cannot be written.
    """
    try:
        Path(file).write_text(chart(title, plan.columns, samples), encoding="utf-8")
    except OSError as error:
        raise OutputError(f"cannot write {file}: {error.strerror}") from error
    say(f"chart: {file}")


class _Taker:
    """Makes samples of notifications, reports them until there are enough, and keeps them for the chart."""

    def __init__(self, rows: CountedReport, samples: Samples, kept: deque[Row]) -> None:
        self._rows, self._samples, self._kept = rows, samples, kept

    def hear(self, _: Unsolicited, described: dict[str, object]) -> None:
        """Take the values of a notification."""
        fields = described.get("fields")
        if isinstance(fields, dict) and not self._rows.is_full:
            now = asyncio.get_running_loop().time()
            self._add(self._samples.add(fields, now, str(described.get("time"))))

    def end(self) -> None:
        """Report the last sample.

        Raises:
            OSError: the disk is full, or the reader is gone.
        """
        if not self._rows.is_full:
            self._add(self._samples.end())
        self._rows.raise_failure()

    def _add(self, row: Row | None) -> None:
        if row:
            self._kept.append(row)
            self._rows.add(row)
