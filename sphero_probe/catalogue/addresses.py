"""Addresses in words: an address byte and where it stood in, who is meant and on which evidence out."""

from enum import StrEnum
from typing import Final, NamedTuple

from sphero_probe.catalogue.model import Robot
from sphero_probe.catalogue.robots import ROBOTS
from sphero_probe.protocol.address import PRIMARY, Address

BLE_PORT: Final = 1
"""The port through which a robot hears a client over Bluetooth [reference: an answer to 0x11]."""
UART_PORT: Final = 2
"""The port through which an RVR hears a client over its UART [real: command to 01, answer to 21]."""

_LINES: Final = {BLE_PORT: "Bluetooth", UART_PORT: "UART"}
_VENDOR = "the vendor's description"
_REFERENCE = "the BOLT+ reference"
_CAPTURE = "a capture of an RVR over UART"
_INFERRED = "inferred from the model: no capture shows it"


class Use(StrEnum):
    """Where in a packet an address stands; each end counts ports from its own system."""

    COMMAND_TARGET = "target of a command"
    COMMAND_SOURCE = "source of a command"
    ANSWER_TARGET = "target of an answer"
    ANSWER_SOURCE = "source of an answer"


class AddressMeaning(NamedTuple):
    """What an address stands for.

    Attributes:
        use: where it stood.
        address: its port and node.
        meaning: who that is.
        basis: the evidence for it.
    """

    use: Use
    address: Address
    meaning: str
    basis: str

    @property
    def words(self) -> str:
        """The whole in a line: ``port 2, node 1: the client behind the robot's UART``."""
        doubt = " (inferred)" if self.basis is _INFERRED else ""
        return f"port {self.address.port}, node {self.address.node}: {self.meaning}{doubt}"


def address_meaning(byte: int, use: Use, robot: Robot | None = None) -> AddressMeaning:
    """Return what an address byte stands for.

    Args:
        byte: the address.
        use: where it stood.
        robot: the model, None where it is not known.

    Raises:
        ValueError: it is no byte.
    """
    address = Address.from_byte(byte)
    match use:
        case Use.COMMAND_TARGET:
            meaning, basis = _command_target(address, robot)
        case Use.COMMAND_SOURCE:
            meaning, basis = _command_source(address)
        case Use.ANSWER_TARGET:
            meaning, basis = _answer_target(address, robot)
        case Use.ANSWER_SOURCE:
            meaning, basis = _answer_source(address, robot)
    return AddressMeaning(use, address, meaning, basis)


def client_means(byte: int, robot_key: str = "") -> str:
    """Return in words the address under which a robot sees its client.

    Args:
        byte: the target of its answers.
        robot_key: the model's key, empty where it is not known.
    """
    return address_meaning(byte, Use.ANSWER_TARGET, ROBOTS.get(robot_key)).words


def address_meanings(byte: int, robot: Robot | None = None) -> list[AddressMeaning]:
    """Return what an address byte stands for in each place of a packet."""
    return [address_meaning(byte, use, robot) for use in Use]


def _node(address: Address, robot: Robot | None) -> str:
    name = robot.nodes.get(address.node) if robot else None
    return f"node {address.node} ({name})" if name else f"node {address.node}"


def _command_target(address: Address, robot: Robot | None) -> tuple[str, str]:
    node = f"{_node(address, robot)} of the robot"
    if address.is_wildcard:
        node = "whichever node of the robot can serve it"
    if address.port == 0:
        return f"{node}, as the UART addresses it", _CAPTURE
    if address.port == BLE_PORT:
        return f"{node}, behind the client's Bluetooth", _REFERENCE
    return f"{node.replace(' of the robot', '')} behind port {address.port} of the sender", _INFERRED


def _command_source(address: Address) -> tuple[str, str]:
    if address.port == 0:
        client = "the client itself" if address.node == PRIMARY else f"node {address.node} of the client"
        return client, _VENDOR
    return f"node {address.node} behind the receiver's port {address.port}, already translated", _INFERRED


def _answer_target(address: Address, robot: Robot | None) -> tuple[str, str]:
    client = "the client" if address.node == PRIMARY else f"node {address.node} of the client"
    if address.port == 0:
        return f"{_node(address, robot)} of the robot itself", _VENDOR
    line = _LINES.get(address.port)
    if line is None:
        return f"{client} behind port {address.port} of the robot", _INFERRED
    if address.port == UART_PORT:
        known = robot is None or robot.key.startswith("rvr")
        return f"{client} behind the robot's {line}", _CAPTURE if known else _INFERRED
    known = robot is None or robot.key == "bolt-plus"
    return f"{client} behind the robot's {line}", _REFERENCE if known else _INFERRED


def _answer_source(address: Address, robot: Robot | None) -> tuple[str, str]:
    node = "a node that does not name itself" if address.is_wildcard else _node(address, robot)
    if address.port == 0:
        return f"{node} of the robot, which answers", _CAPTURE
    return f"{node} behind port {address.port}, already translated for the client", _INFERRED
