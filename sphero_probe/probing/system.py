"""A robot as a system of nodes: the values that a survey of its nodes makes, and reports show."""

from enum import StrEnum
from typing import Final, NamedTuple

from sphero_probe.catalogue.model import CommandRow, Robot

NODES: Final = range(1, 16)
"""Every node number that an address holds, but for the wildcard."""


class NodeState(StrEnum):
    """What became of an echo."""

    ANSWERS = "answers"
    UNAVAILABLE = "unavailable"
    ABSENT = "absent"
    SILENT = "silent"


class Served(NamedTuple):
    """Who served a command that was sent to the wildcard.

    Attributes:
        row: the command, a documented read.
        node: the number of the node that answered, None where no answer says it.
    """

    row: CommandRow
    node: int | None


class NodeAnswer(NamedTuple):
    """One address and who is there.

    Attributes:
        target: the address byte that was asked; None for no address at all.
        state: what became of the echo.
        code: the answer's code, None without an answer.
        answered_by: the address byte of the node that answered, None where the answer names none.
        devices: device ids that it serves.
        claimed: they come from the node's own list; else from the catalogue.
        firmware: its version, empty where it tells none.
        served: of a wildcard, which node served which command.
    """

    target: int | None
    state: NodeState
    code: int | None = None
    answered_by: int | None = None
    devices: tuple[int, ...] = ()
    claimed: bool = False
    firmware: str = ""
    served: tuple[Served, ...] = ()


class System(NamedTuple):
    """A robot as a system of nodes.

    Attributes:
        name: the robot's name.
        robot: the model, None where it is not known.
        line: ``BLE`` or ``UART``.
        client: address byte under which the robot sees the client, None where its answers do not tell.
        addressing: which addresses its answers carry: ``swapped``, ``SID only``, ``TID only``, ``none``.
        nodes: the addresses, in the order in which they were asked.
        note: why there are none, or empty.
    """

    name: str
    robot: Robot | None
    line: str
    client: int | None = None
    addressing: str = ""
    nodes: tuple[NodeAnswer, ...] = ()
    note: str = ""
