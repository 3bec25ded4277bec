"""``listen``: a robot's address goes in, what it says unasked comes out as it comes."""

from typing import TYPE_CHECKING

import click

from sphero_probe.cli.options import RISKS, device_options, output_options
from sphero_probe.cli.output import Output

if TYPE_CHECKING:
    from asyncio import Event

    from sphero_probe.link.exchange import Unsolicited
    from sphero_probe.protocol.packets import Command, Packet
    from sphero_probe.reports.registry import Report
    from sphero_probe.session.session import Session


@click.command("listen")
@click.option("--count", type=click.IntRange(min=1), metavar="N", help="Stop after N packets.")
@click.option(
    "--seconds", type=click.FloatRange(min=0.01), metavar="SECONDS", help="Stop after so much time."
)
@click.option(
    "--send",
    "commands",
    multiple=True,
    metavar="COMMAND",
    help="Send this first, like 'power.wake' or '0x18 0x00 0096000000E000'; may be repeated.",
)
@click.option("--allow", multiple=True, type=click.Choice(RISKS), help="Allow a risk class, for --send.")
@click.option("--confirm", default="", metavar="NAME", help="The robot's name, to allow the brick class.")
@device_options
@output_options
def command(
    output: Output,
    count: int | None,
    seconds: float | None,
    commands: tuple[str, ...],
    allow: tuple[str, ...],
    confirm: str,
    device: str,
    **connecting: object,
) -> None:
    """Show notifications as they come, decoded, until Ctrl-C.

    Most have to be switched on first; --send does that.

    Example: sphero-probe listen --send power.wake --seconds 1 --device fake:bolt
    """
    from asyncio import Event

    from sphero_probe.cli.connect import connect
    from sphero_probe.cli.signals import Interrupts, run_interruptible
    from sphero_probe.link.policy import Consent
    from sphero_probe.reports.views import HEARD

    interrupts = Interrupts()
    stop = Event()

    async def work() -> None:
        interrupts.stop_politely(stop)
        consent = Consent.of(allow, confirm)
        async with connect(device, consent, **connecting) as session:  # type: ignore[arg-type]
            lines = output if output.chosen or output.file else output._replace(chosen="plain")
            with lines.report(HEARD, live=True) as report:
                ear = _Ear(session, report, count, stop)
                for text in commands:
                    await _send(session, text, ear)
                await _wait(session, stop, seconds)
                ear.complain()

    run_interruptible(interrupts, work())


class _Ear:
    """Reports every aside of a link as it comes, sensor streams by what was switched on.

    Once nobody takes the report any more, it stops; the link does not suffer from that.
    """

    def __init__(self, session: "Session", report: "Report", count: int | None, stop: "Event") -> None:
        from sphero_probe.catalogue.sensors import Masks

        self._session = session
        self._report = report
        self._left = count
        self._stop = stop
        self._masks = Masks()
        self._failed: OSError | None = None
        session.link.on_unsolicited = self._hear

    def expect(self, command: "Command") -> None:
        """Take in that a command is sent, which may switch on a stream."""
        from sphero_probe.catalogue.sensors import masks_after

        self._masks = masks_after(self._session.connection.generation, self._masks, command)

    def complain(self) -> None:
        """Tell what kept the report from being written.

        Raises:
            OSError: the disk is full, or the reader is gone.
        """
        if self._failed:
            raise self._failed

    def _hear(self, unsolicited: "Unsolicited") -> None:
        if self._left == 0 or self._failed:
            return
        try:
            self._tell(unsolicited)
        except OSError as error:
            self._failed = error
            self._stop.set()

    def _tell(self, unsolicited: "Unsolicited") -> None:
        from datetime import UTC, datetime

        from sphero_probe.link.exchange import LateResponse
        from sphero_probe.reports.rows import packet_row

        connection, codec = self._session.connection, self._session.link.codec
        packet = unsolicited.response if isinstance(unsolicited, LateResponse) else unsolicited
        row = packet_row(packet, connection.generation, codec.frame_of(packet), connection.robot)
        time = datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
        self._report.add(row._replace(data={"time": time, **row.data, **self._stream(packet)}))
        if self._left is not None:
            self._left -= 1
            if self._left == 0:
                self._stop.set()

    def _stream(self, packet: "Packet") -> "dict[str, object]":
        """The fields and units of a sensor stream, by the masks that were set; nothing for the rest."""
        from sphero_probe.catalogue.sensors import STREAM_IDS, streaming_fields
        from sphero_probe.protocol.packets import Notification

        generation = self._session.connection.generation
        if not isinstance(packet, Notification) or (packet.did, packet.cid) != STREAM_IDS[generation]:
            return {}
        decoded = streaming_fields(generation, self._masks, packet.payload)
        return {"fields": decoded.fields, "units": decoded.units} if decoded.fields else {}


async def _send(session: "Session", text: str, ear: _Ear) -> None:
    """Send a command that was given as words.

    Raises:
        SpheroProbeError: it makes no sense, was withheld, or the robot refused it.
    """
    from sphero_probe.cli.commands.send import complete, parse_command
    from sphero_probe.cli.oneshot import complain
    from sphero_probe.probing.oneshot import send_once

    connection, link = session.connection, session.link
    asked = parse_command(tuple(text.split()), connection.generation)
    command = complete(asked, connection.robot, connection.port, None)
    ear.expect(command)
    finding = await send_once(link, command)
    complain(finding, link.codec)


async def _wait(session: "Session", stop: "Event", seconds: float | None) -> None:
    """Wait for the end: enough heard, the time up, Ctrl-C, or the robot gone.

    Raises:
        LinkLostError: the robot is gone.
    """
    import asyncio

    ended = asyncio.create_task(stop.wait())
    gone = asyncio.create_task(session.link.closed())
    try:
        done, _ = await asyncio.wait({ended, gone}, timeout=seconds, return_when=asyncio.FIRST_COMPLETED)
        if gone in done:
            gone.result()
    finally:
        ended.cancel()
        gone.cancel()
        await asyncio.gather(ended, gone, return_exceptions=True)
