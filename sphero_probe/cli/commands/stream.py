"""The options of ``stream``."""

import click

from sphero_probe.cli.complete.lazily import offer
from sphero_probe.cli.options import asking_options, device_options, output_options, seconds_option
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.values import AskOptions, ConnectOptions, Output


@click.command("stream", cls=StrictCommand)
@click.argument("sensors", nargs=-1, metavar="SENSOR...", shell_complete=offer("sensors"))
@click.option("--list", "listed", is_flag=True, help="List the robot's sensors and stream none.")
@click.option(
    "--rate",
    type=click.FloatRange(0.1, 400),
    default=10.0,
    show_default=True,
    metavar="HZ",
    help="Samples per second.",
)
@seconds_option("--seconds", least=0.01, most=30 * 86400, about="Stop after this time.")
@click.option("--count", type=click.IntRange(min=1), metavar="N", help="Stop after N samples.")
@click.option(
    "--plot", metavar="FILE", help="Draw a chart at the end: an .svg picture.", shell_complete=offer("files")
)
@asking_options
@device_options
@output_options
def command(
    output: Output,
    connecting: ConnectOptions,
    asking: AskOptions,
    sensors: tuple[str, ...],
    listed: bool,
    rate: float,
    seconds: float | None,
    count: int | None,
    plot: str | None,
) -> None:
    """Stream sensors by name: live on a terminal, else one sample per line, until Ctrl-C.

    A sensor is a group (accelerometer, gyroscope, attitude) or one value (pitch). The tool finds the
    commands and nodes that they need. What was switched on is switched off at the end, also after Ctrl-C.

    Example: sphero-probe stream accelerometer gyroscope --seconds 1 --device fake:bolt
    """
    from sphero_probe.cli.actions.stream import StreamOptions, list_sensors, stream

    if listed:
        list_sensors(output, connecting.device)
        return
    stream(output, connecting, asking, StreamOptions(sensors, rate, seconds, count, plot))
