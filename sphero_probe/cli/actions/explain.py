"""``explain``: print what is known about an error code or a command."""

from sphero_probe.catalogue import ROBOTS, all_rows, async_rows, robot_by_word, rows_of
from sphero_probe.catalogue.addresses import address_meanings
from sphero_probe.catalogue.commands import DEVICE_NAMES, device_by_name, row_by_name
from sphero_probe.catalogue.naming import byte, choose, pair
from sphero_probe.cli.messages import say
from sphero_probe.cli.output import show
from sphero_probe.cli.values import Output
from sphero_probe.errors import UsageError
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Generation, Verdict
from sphero_probe.reports.packet_views import ADDRESSES
from sphero_probe.reports.rows import address_row, code_row, command_row
from sphero_probe.reports.views import CODES, COMMAND, COMMANDS


def explain_address(output: Output, address: str, model: str | None) -> None:
    """Show what an address byte stands for, in each place of a packet.

    Args:
        output: where and how.
        address: as it was typed.
        model: the robot whose nodes have names, None for none.

    Raises:
        UsageError: it is no byte, or no robot is called so.
    """
    robot = None if model is None else robot_by_word(model) or ROBOTS[choose(model, ROBOTS, "robot")]
    show(output, ADDRESSES, map(address_row, address_meanings(byte(address, "address"), robot)))


def explain(output: Output, subject: str, *, v1: bool) -> None:
    """Show what is known about a code, a device, a pair of ids or a name.

    A number that no document lists as a code, and that is a device, is read as a device.

    Args:
        output: where and how.
        subject: as typed.
        v1: use the first generation.

    Raises:
        UsageError: it is not valid, or not in the catalogue.
    """
    generation = Generation.V1 if v1 else Generation.V2
    if subject[:1].isdigit() and ":" not in subject:
        number = byte(subject, "error code or device")
        device = DEVICE_NAMES[generation].get(number)
        if device and CODECS[generation].verdict(number) is Verdict.UNLISTED:
            say(f"0x{number:02x} is read as the device {device}; no document lists it as an error code")
            _explain_device(output, generation, number)
            return
        show(output, CODES, [code_row(generation, number)])
        if device:
            say(f"as a device, 0x{number:02x} is {device}: sphero-probe explain {device}{' --v1' * v1}")
        return
    named = device_by_name(generation, subject)
    if named is not None and row_by_name(generation, subject) is None:
        _explain_device(output, generation, named)
        return
    did, cid = pair(subject, generation)
    rows = rows_of(generation, did, cid)
    if not rows:
        raise UsageError(
            f"0x{did:02x}:0x{cid:02x} is not in the catalogue",
            f"ask a robot: sphero-probe sweep --did 0x{did:02x} --cid 0x{cid:02x}",
        )
    show(output, COMMAND, map(command_row, rows))


def _explain_device(output: Output, generation: Generation, did: int) -> None:
    rows = [row for row in (*all_rows(generation), *async_rows(generation)) if row.did == did]
    show(output, COMMANDS, map(command_row, rows))
