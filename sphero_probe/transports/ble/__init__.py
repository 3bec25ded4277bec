"""Robots over Bluetooth LE, through bleak: the only place that knows it."""

from sphero_probe.transports.ble.connection import open_connection
from sphero_probe.transports.ble.scanner import scan, watch

__all__ = ["open_connection", "scan", "watch"]
