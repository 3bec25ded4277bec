"""``fleet --scheduler`` and ``fleet worker``: their options, and without Dask."""

import sys

import pytest

from tests.support.cli import Cli

NOWHERE = "tcp://127.0.0.1:9"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["health", "--all", "--scheduler", "127.0.0.1:8786"], "write it like tcp://127.0.0.1:8786"),
        (["health", "--all", "--scheduler", NOWHERE, "--adapter", "hci0"], "give --adapter to fleet worker"),
        (["health", "-d", "fake:bolt", "--wait", "3s"], "--wait needs --scheduler"),
        (["worker", "-d", "fake:bolt"], "--scheduler"),
        (["worker", "--scheduler", NOWHERE, "-d", "fake:bolt", "-d", "fake:bolt"], "named twice"),
        (["worker", "--scheduler", NOWHERE, "-d", "fake:bolt", "--listen", "here"], "not an IP address"),
    ],
)
def test_options_that_make_no_sense(cli: Cli, arguments: list[str], said: str) -> None:
    ran = cli("fleet", *arguments)
    assert (ran.code, ran.out) == (2, "")
    assert said in ran.err


@pytest.mark.parametrize("arguments", [["health", "--all"], ["worker", "-d", "fake:bolt"]])
def test_without_dask_one_line_says_how_to_install_it(
    cli: Cli, arguments: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    ran = cli("fleet", *arguments, "--scheduler", NOWHERE)
    assert (ran.code, ran.out) == (9, "")
    assert "Dask, which is not installed" in ran.err
    assert "pip install 'sphero-probe[dask]'" in ran.err
