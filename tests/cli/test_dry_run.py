"""What a dry run says about the size of a run: against the rows that it prints, and by other arithmetic."""

import re

import pytest

from tests.support.cli import Cli, objects

FAKE = ("--device", "fake:bolt")


@pytest.mark.parametrize(
    "asked",
    [
        pytest.param(("sweep", "--did", "0x13"), id="sweep"),
        pytest.param(("sweep", "--did", "0x13", "--cid", "0x10"), id="one"),
        pytest.param(("sweep", "--did", "0x13", "--allow", "motion"), id="allowed"),
        pytest.param(("discover",), id="discover"),
    ],
)
def test_it_counts_what_it_shows(cli: Cli, asked: tuple[str, ...]) -> None:
    ran = cli(*asked, *FAKE, "--dry-run", "--format", "jsonl")
    rows = objects(ran.out)
    blocked = sum(row["withheld"] is not None for row in rows)
    found = re.search(r"^(\d+) probes? to send(?:, (\d+) blocked)?", ran.err, re.MULTILINE)
    assert found
    assert (int(found[1]), int(found[2] or 0)) == (len(rows) - blocked, blocked)


@pytest.mark.parametrize(
    ("asked", "following"),
    [
        pytest.param(("sweep", "--did", "0x13"), None, id="sweep"),
        pytest.param(("sweep", "--plan", "self_description"), "ask each device", id="plan"),
        pytest.param(("discover",), "own list, devices, commands", id="discover"),
        pytest.param(
            ("discover", "--lengths", "--values"),
            "own list, devices, commands, lengths, values",
            id="everything",
        ),
    ],
)
def test_it_says_what_follows_from_findings(cli: Cli, asked: tuple[str, ...], following: str | None) -> None:
    err = cli(*asked, *FAKE, "--dry-run", "--format", "jsonl").err
    assert ("for each 1000 that follow" in err) is (following is not None)
    assert re.findall(r"more follow from what is found \((.*)\)", err) == ([following] if following else [])


def test_a_run_takes_as_long_as_it_says(cli: Cli) -> None:
    """The fast link is that of ``fake:bolt?interval=15ms&per_event=6``, here by its own arithmetic."""
    err = cli("sweep", "--did", "0x40-0x4f", *FAKE, "--dry-run", "--format", "jsonl").err
    found = re.search(r"(\d+) probes to send.* (\d+) s on a fast Bluetooth link, (\d+) s with", err)
    assert found
    probes, fast, slow = map(int, found.groups())
    assert probes == 16 * 256
    assert fast == -(-probes * 15 // 6 // 1000)  # six packets in each 15 ms, rounded up
    assert slow == -(
        -probes * 388 // 20 // 1000
    )  # two in flight, and 38.8 ms for each: the median of the Mini


def test_a_single_command_has_no_forecast(cli: Cli) -> None:
    assert "Estimated time" not in cli("send", "power.sleep", *FAKE, "--dry-run").err


@pytest.mark.parametrize(
    ("device", "confirm", "sent"),
    [
        pytest.param("fake:bolt", "SB-DE8E", True, id="its name"),
        pytest.param("fake:bolt", "SB-DE8F", False, id="another name"),
        pytest.param("BP-1234", "BP-1234", True, id="over Bluetooth"),
        pytest.param("BP-12", "BP-1234", False, id="the beginning of a name"),
        pytest.param("AA:BB:CC:DD:EE:FF", "BP-1234", False, id="an address tells no name"),
    ],
)
def test_brick_is_confirmed_by_a_name_that_the_address_tells(
    cli: Cli, device: str, confirm: str, sent: bool
) -> None:
    allowed = ("--allow", "brick", "--confirm", confirm)
    ran = cli("send", "0x13", "0xfd", "-d", device, *allowed, "--dry-run", "--format", "jsonl")
    assert ran.code == 0, ran.err
    (row,) = objects(ran.out)
    assert (row["withheld"] is None) is sent
    assert sent or "--confirm needs this robot's name" in row["withheld"]
