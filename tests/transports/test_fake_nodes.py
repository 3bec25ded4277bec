"""The nodes of a built-in robot through its address: the port of its targets, and the file of a topology."""

import asyncio
import json
from pathlib import Path

import pytest

from sphero_probe.session.addressing import port_behind
from sphero_probe.transports.registry import open_transport, parse_address
from tests.support.cli import Cli

TOPOLOGY = {
    "systems": {
        "robot": {"nodes": [1, 2, 7], "ports": {"3": 2}, "channels": [[1, 2], [2, 7]]},
        "pi": {"nodes": [1], "ports": {"1": 1}},
    },
    "lines": [["pi:1", "robot:3"]],
    "client": "pi:1",
}


@pytest.mark.parametrize(
    ("address", "port"),
    [("fake:rvr", 1), ("fake:rvr?line=ble", 1), ("fake:rvr-plus?line=uart", 0), ("fake:bolt", 1)],
)
def test_targets_have_the_port_of_the_line(address: str, port: int) -> None:
    async def work() -> int:
        async with open_transport(parse_address(address)) as connection:
            return connection.port

    assert asyncio.run(work()) == port_behind(parse_address(address)) == port


def _send(cli: Cli, address: str, target: str) -> tuple[int, int, str, str]:
    ran = cli("send", "0x10", "0x00", "--target", target, "--device", address, "--json")
    (finding,) = json.loads(ran.out)
    return ran.code, finding["code"], finding["sent"].replace(" ", ""), finding["received"].replace(" ", "")


def test_a_command_over_the_uart_is_answered_at_its_port(cli: Cli) -> None:
    code, answered, sent, received = _send(cli, "fake:rvr?line=uart", "2")
    assert (code, answered) == (0, 0)
    assert (sent[:10], received[:8]) == ("8d3a020110", "8d392102")


def test_the_nodes_of_a_topology_file_are_reached(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "net.json"
    path.write_text(json.dumps(TOPOLOGY), encoding="utf-8")
    code, answered, _, received = _send(cli, f"fake:rvr?topology={path}", "0x17")
    assert (code, answered) == (0, 0)
    assert received[:8] == "8d393107"  # to node 1 behind port 3, from node 7


@pytest.mark.parametrize(
    ("content", "words"),
    [
        pytest.param(None, "cannot read topology", id="no file"),
        pytest.param(b"\xff\xfe", "it is no text", id="no text"),
        pytest.param(b"[1, 2", "topology ", id="no JSON"),
        pytest.param(b"{}", '"systems" is an object', id="no topology"),
    ],
)
def test_a_topology_that_cannot_be_used_is_a_bad_input_file(
    cli: Cli, tmp_path: Path, content: bytes | None, words: str
) -> None:
    path = tmp_path / "net.json"
    if content is not None:
        path.write_bytes(content)
    ran = cli("send", "0x10", "0x00", "--device", f"fake:rvr?topology={path}")
    assert (ran.code, ran.out) == (8, "")
    assert words in ran.err
