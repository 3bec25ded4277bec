"""A robot made of tables: the bytes of a host go in, the bytes of a robot come out; no I/O and no clock.

``parse_settings`` reads what follows ``fake:`` in an address, ``FakeRobot`` plays that robot.
"""

from sphero_probe.simulator.execution import Executed
from sphero_probe.simulator.firmware import Fact
from sphero_probe.simulator.robot import FakeRobot
from sphero_probe.simulator.settings import Claims, Settings, Strict, parse_settings

__all__ = ["Claims", "Executed", "Fact", "FakeRobot", "Settings", "Strict", "parse_settings"]
