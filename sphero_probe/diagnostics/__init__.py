"""Checks of this machine, its Bluetooth and a robot."""
