"""The subcommands of ``capture`` and their options."""

import click

from sphero_probe.cli.complete.lazily import offer
from sphero_probe.cli.options import output_options
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.values import Output


@click.group("capture", context_settings={"help_option_names": ["-h", "--help"]})
def command() -> None:
    """Show what a recording of Bluetooth or serial traffic tells about robots.

    Example: sphero-probe capture show btsnoop_hci.log
    """


@command.command("show", cls=StrictCommand)
@click.argument("file", metavar="FILE", shell_complete=offer("files"))
@click.option("--summary", is_flag=True, help="A line for each command: how often, payloads, answers.")
@click.option("--unknown", is_flag=True, help="Only commands and notifications that no catalogue has.")
@click.option("--did", metavar="IDS", help="Only these device ids: 0x13, 0x10-0x1a.")
@click.option("--robot", "name", metavar="NAME", help="Only the robot with this name, address or number.")
@output_options
def show(
    output: Output, file: str, name: str | None, did: str | None, *, summary: bool, unknown: bool
) -> None:
    """Show the packets in a btsnoop, pcap, pcapng or PacketLogger file, each with its time and direction.

    Captures of other devices give no packet. With --summary, unknown commands come first, and a line for each
    robot tells its round trips and how many commands were in flight.

    Example: sphero-probe capture show btsnoop_hci.log --summary
    """
    from sphero_probe.cli.actions.capture import Wanted, show_capture

    show_capture(output, file, Wanted(name, did, unknown), summary=summary)


@command.command("convert", cls=StrictCommand)
@click.argument("source", metavar="FILE|RUN", shell_complete=offer("files"))
@click.option("-o", "--output", "target", metavar="FILE", required=True, help="The file to write.")
@click.option("--to", "form", type=click.Choice(["pcapng"]), default="pcapng", help="The format to write.")
def convert(source: str, target: str, form: str) -> None:
    """Write the packets of the robots in a capture or of a recorded run to a pcapng file.

    Traffic of other devices is left out. Times and frames are those of the capture. The advertisement, the
    connection and the discovery around them are made up, so that Wireshark shows the characteristics.
    A run is a journal, its name, or "last". Comments on its packets name the probe and its
    verdict.

    Example: sphero-probe capture convert last -o run.pcapng
    """
    from sphero_probe.cli.actions.capture_convert import convert as convert_to_pcapng

    del form
    convert_to_pcapng(source, target)


@command.command("redact", cls=StrictCommand)
@click.argument("file", metavar="FILE", shell_complete=offer("files"))
@click.option("-o", "--output", "target", metavar="FILE", required=True, help="The pcapng file to write.")
@click.option(
    "--seed", type=int, metavar="N", help="Choose the pseudonyms; without it they differ each time."
)
def redact(file: str, target: str, seed: int | None) -> None:
    """Write a capture to a pcapng file without what identifies people and devices, to share it.

    Bluetooth addresses, names and other values that identify a robot or its owner are replaced, in HCI and
    radio packets and in the robots' payloads; equal values stay equal. Keys are blanked. Traffic of other
    devices and comments are left out. Times stay, and so do the payloads of unknown commands.

    Example: sphero-probe capture redact btsnoop_hci.log -o shared.pcapng
    """
    from sphero_probe.cli.actions.capture_redact import redact_capture

    redact_capture(file, target, seed)


@command.command("dissector", cls=StrictCommand)
def dissector() -> None:
    """Print a Wireshark dissector for the packets of V1 and V2 robots, written in Lua.

    It names devices, commands, response codes, flags and payload fields from the catalogue, checks checksums,
    links each response to its command, and marks damaged packets. Wireshark loads it from its folder of
    personal Lua plugins, or with -X lua_script:sphero.lua.

    Example: sphero-probe capture dissector > sphero.lua
    """
    from sphero_probe.cli.actions.capture_dissector import print_dissector

    print_dissector()
