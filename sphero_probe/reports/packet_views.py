"""The views that explain a packet: its addresses, and its bytes."""

from typing import Final

from sphero_probe.reports.phrases import hex_id, shown, spaced_hex
from sphero_probe.reports.views import View, both, record_only, table_only

ADDRESSES: Final = View(
    "address",
    (
        both("address", "Address", hex_id, whole=True),
        both("use", "As the", whole=True),
        *record_only("port", "node"),
        *record_only("meaning"),
        table_only("Means", lambda data: shown(data.get("words"))),
        *record_only("words"),
        both("basis", "Evidence"),
    ),
    "No addresses.",
)
"""What an address byte stands for, place by place."""

BYTES: Final = View(
    "byte",
    (
        both("packet", "#", right=True, whole=True),
        both("offset", "Offset", right=True, whole=True),
        both("raw", "Raw", spaced_hex, whole=True),
        both("field", "Field", whole=True),
        both("value", "Value", hex_id, whole=True),
        both("meaning", "Meaning"),
    ),
    "No packets.",
)
"""Packets byte by byte."""
