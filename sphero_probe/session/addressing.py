"""Tell model, protocol and node addresses from a device address, before anything is opened."""

from typing import Final

from sphero_probe.catalogue import robot_by_prefix
from sphero_probe.catalogue.model import Robot
from sphero_probe.protocol.address import PRIMARY, Address
from sphero_probe.protocol.packets import Generation
from sphero_probe.simulator import parse_settings
from sphero_probe.simulator.readings import identity
from sphero_probe.transports.base import BLE_PORT
from sphero_probe.transports.fake_address import CLIENT_PORTS
from sphero_probe.transports.registry import DeviceAddress, parse_address
from sphero_probe.transports.replay import recorded_behind, recorded_port
from sphero_probe.transports.serial_address import PORT, USUAL, parse_port

_AFTER_PREFIX: Final = 4
"""Characters of a name after the prefix of its model; ``--device`` takes fewer, too."""


def address_of(device: str) -> DeviceAddress:
    """Return the address to open; an empty one means the only robot nearby.

    Raises:
        UsageError: the address is not valid.
    """
    return parse_address(device) if device else DeviceAddress("ble", "")


def model_behind(address: DeviceAddress) -> Robot | None:
    """Return the model that an address names, without connecting; None if it names none.

    Raises:
        UsageError: a ``fake:`` or ``replay:`` address that is not valid.
        BadInputFileError: the file of a ``replay:`` address cannot be used.
    """
    if address.scheme == "fake":
        return parse_settings(address.rest).model
    if address.scheme == "replay":
        return recorded_behind(address.rest).robot
    if address.scheme in USUAL:
        return parse_port(address.rest, USUAL[address.scheme]).robot
    return robot_by_prefix(address.rest)


def name_behind(address: DeviceAddress) -> str:
    """Return the whole name that a robot advertises, if its address tells; empty if it does not.

    Raises:
        UsageError: a ``fake:`` address that is not valid.
    """
    if address.scheme == "fake":
        settings = parse_settings(address.rest)
        return identity(settings.model, settings.seed).name
    robot = robot_by_prefix(address.rest) if address.scheme == "ble" else None
    return address.rest if robot and len(address.rest) == len(robot.prefix) + _AFTER_PREFIX else ""


def port_behind(address: DeviceAddress) -> int:
    """Return the port nibble of target addresses over this kind of connection.

    Raises:
        UsageError: a ``fake:`` or ``replay:`` address that makes no sense.
        BadInputFileError: the file of a ``replay:`` address cannot be used.
    """
    if address.scheme == "fake":
        return CLIENT_PORTS[parse_settings(address.rest).line]
    if address.scheme == "replay":
        return recorded_port(recorded_behind(address.rest))
    return PORT if address.scheme in USUAL else BLE_PORT


def generation_behind(address: DeviceAddress) -> Generation:
    """Return the protocol that an address implies; V2 if it implies none, as most robots speak it.

    Raises:
        UsageError: a ``fake:`` or ``replay:`` address that is not valid.
        BadInputFileError: the file of a ``replay:`` address cannot be used.
    """
    if address.scheme == "replay":
        return recorded_behind(address.rest).generation
    robot = model_behind(address)
    return robot.generation if robot else Generation.V2


def usual_target(robot: Robot | None, port: int) -> int | None:
    """Return the address byte of a robot's usual node; None if the robot takes no addresses.

    Args:
        robot: the model, None if it is not known.
        port: the port nibble of this kind of connection.
    """
    return Address(port, PRIMARY).byte if robot is None or robot.addressed else None
