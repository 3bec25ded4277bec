"""What ``-v`` prints while connecting is harmless and bounded, whatever the names are."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

from sphero_probe.session import addressing, session
from sphero_probe.transports.base import Connection, OpenOptions
from sphero_probe.transports.registry import DeviceAddress, open_transport, parse_address
from tests.support.cli import Cli

HOSTILE = "BP\x1b]0;pwn\x07\n\u202e\ud800"


def test_what_is_told_of_connecting_cannot_reach_the_terminal(
    cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    @asynccontextmanager
    async def hostile(address: DeviceAddress, options: OpenOptions) -> AsyncIterator[Connection]:
        options.on_step(f"connect: {HOSTILE} {'x' * 5000}")
        async with open_transport(address, options) as connection:
            yield connection._replace(name=HOSTILE)

    monkeypatch.setattr(session, "open_transport", hostile)
    ran = cli("info", "-v", "--device", "fake:bolt")
    assert ran.code == 0, ran.err
    steps = ran.err.split("\n")
    assert any("connected to BP\\x1b]0;pwn" in step for step in steps)
    assert all(step.isprintable() and len(step) <= 400 for step in steps)


def test_nodes_at_any_kind_of_wire_are_addressed_by_its_port() -> None:
    kinds = ("serial:/dev/ttyS0", "rfcomm:/dev/rfcomm0", "BP-1234", "fake:rvr")
    assert [addressing.port_behind(parse_address(kind)) for kind in kinds] == [0, 0, 1, 1]
