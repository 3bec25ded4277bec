"""The nodes of a robot as rows, and the views that show them."""

from collections.abc import Iterator
from typing import Final

from sphero_probe.catalogue.routing import Hop
from sphero_probe.probing.node_notes import node_data, system_data
from sphero_probe.probing.system import System
from sphero_probe.protocol.codec import Codec
from sphero_probe.reports.phrases import Data, hex_id, shown
from sphero_probe.reports.rows import Row
from sphero_probe.reports.views import Column, Place, View


def system_rows(system: System, codec: Codec) -> Iterator[Row]:
    """Yield the row of a system, then one for each address that was asked."""
    yield Row("system", system_data(system))
    for one in system.nodes:
        yield Row("node", node_data(one, system.robot, codec))


def hop_row(number: int, hop: Hop) -> Row:
    """Return the row of a documented hop; ``number`` is its place, from 1."""
    (target, source), (to, by) = hop.before, hop.after
    return Row(
        "hop",
        {
            "number": number,
            "packet": hop.packet,
            "step": hop.step,
            "target_before": target.byte,
            "source_before": source.byte,
            "target_after": to.byte,
            "source_after": by.byte,
            "visible": hop.visible,
            "basis": "documented",
        },
    )


def _serves(data: Data) -> str:
    """Return which node served which command: ``0x16:0x41 node 2``."""
    held = data.get("serves")
    return ", ".join(
        f"{hex_id(one.get('did'))}:{hex_id(one.get('cid'))} "
        + ("not told" if one.get("node") is None else f"node {shown(one.get('node'))}")
        for one in (held if isinstance(held, list) else ())
        if isinstance(one, dict)
    )


def _column(key: str, title: str = "", *, by_hex: bool = False, place: Place = Place.RECORD) -> Column:
    show = hex_id if by_hex else shown
    return Column(key, title or key.capitalize(), lambda data: show(data.get(key)), place, whole=True)


def _dids(data: Data) -> str:
    held = data.get("dids")
    return " ".join(map(hex_id, held if isinstance(held, list) else ()))


NODES: Final = View(
    "node",
    (
        _column("address", by_hex=True),
        _column("node"),
        _column("name"),
        _column("state"),
        _column("code", by_hex=True),
        _column("code_name"),
        _column("answered_by", by_hex=True),
        _column("firmware"),
        _column("devices"),
        Column("dids", "DIDs", _dids, Place.RECORD),
        _column("devices_from"),
        Column("serves", "Serves", _serves, Place.RECORD),
    ),
    "No nodes.",
)
"""The addresses of a robot; their table has a layout of its own."""


def _addresses(data: Data, when: str) -> str:
    """Return target and source of a hop: ``to 0x12 from 0x01``."""
    return f"to {hex_id(data.get(f'target_{when}'))} from {hex_id(data.get(f'source_{when}'))}"


HOPS: Final = View(
    "hop",
    (
        _column("number", "#", place=Place.BOTH),
        _column("packet", place=Place.BOTH),
        Column("step", "Step, as documented", lambda data: shown(data.get("step"))),
        *(
            _column(f"{end}_{when}", by_hex=True)
            for when in ("before", "after")
            for end in ("target", "source")
        ),
        Column("", "Before", lambda data: _addresses(data, "before"), Place.TABLE, whole=True),
        Column("", "After", lambda data: _addresses(data, "after"), Place.TABLE, whole=True),
        Column("visible", "On a wire", lambda data: shown(data.get("visible")), whole=True),
        _column("basis"),
    ),
    "No hops.",
)
"""The documented hops of a command and its answer."""
