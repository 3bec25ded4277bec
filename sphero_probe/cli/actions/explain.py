"""``explain``: print what is known about an error code or a command."""

from sphero_probe.catalogue import ROBOTS, robot_by_word, rows_of
from sphero_probe.catalogue.addresses import address_meanings
from sphero_probe.catalogue.naming import byte, choose, pair
from sphero_probe.cli.output import show
from sphero_probe.cli.values import Output
from sphero_probe.errors import UsageError
from sphero_probe.protocol.packets import Generation
from sphero_probe.reports.packet_views import ADDRESSES
from sphero_probe.reports.rows import address_row, code_row, command_row
from sphero_probe.reports.views import CODES, COMMAND


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
    """Show what is known about a code, a pair of ids or a name.

    Args:
        output: where and how.
        subject: as typed.
        v1: use the first generation.

    Raises:
        UsageError: it is not valid, or not in the catalogue.
    """
    generation = Generation.V1 if v1 else Generation.V2
    if subject[:1].isdigit() and ":" not in subject:
        show(output, CODES, [code_row(generation, byte(subject, "error code"))])
        return
    did, cid = pair(subject, generation)
    rows = rows_of(generation, did, cid)
    if not rows:
        raise UsageError(
            f"0x{did:02x}:0x{cid:02x} is not in the catalogue",
            f"ask a robot: sphero-probe sweep --did 0x{did:02x} --cid 0x{cid:02x}",
        )
    show(output, COMMAND, map(command_row, rows))
