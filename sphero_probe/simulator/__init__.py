"""A robot made of tables: the bytes of a host in, the bytes of a robot out; no I/O and no clock.

``parse_settings`` reads what follows ``fake:`` in an address, ``FakeRobot`` plays that robot. Its nodes are a
``Network``; how packets travel between them is in ``topology``.
"""

from sphero_probe.simulator.execution import Executed
from sphero_probe.simulator.firmware import Fact
from sphero_probe.simulator.robot import FakeRobot
from sphero_probe.simulator.settings import Claims, Line, Settings, Strict, parse_settings
from sphero_probe.simulator.topology_file import parse_topology

__all__ = [
    "Claims",
    "Executed",
    "Fact",
    "FakeRobot",
    "Line",
    "Settings",
    "Strict",
    "parse_settings",
    "parse_topology",
]
