"""``send`` with arguments by name, its help for one command, and the hint to ask another node."""

import json

import pytest

from tests.support.cli import Cli

BOLT = ("--device", "fake:bolt", "--dry-run", "--json")
DRIVE = "drive.drive_with_heading"


def payload(cli: Cli, *words: str) -> str:
    ran = cli("send", *words, *BOLT)
    assert ran.code == 0, ran.err
    (row,) = json.loads(ran.out)
    return str(row["payload"])


@pytest.mark.parametrize(
    "words",
    [
        pytest.param(("speed=64", "heading=90", "flags=backward"), id="names"),
        pytest.param(("64", "90deg", "backward"), id="places"),
        pytest.param(("40", "005a", "01"), id="hex"),
        pytest.param(("40005a01",), id="one-word-of-hex"),
        pytest.param(("64", "90", "1"), id="numbers-that-fit-as-values-only"),
    ],
)
def test_all_spellings_give_the_same_bytes(cli: Cli, words: tuple[str, ...]) -> None:
    assert payload(cli, DRIVE, *words) == payload(cli, "0x16", "0x07", *words) == "40005a01"


def test_a_reading_that_may_surprise_is_said(cli: Cli) -> None:
    ran = cli("send", DRIVE, "64", "90", "1", *BOLT)
    assert ran.err.startswith("note: read as speed 64, heading 90, flags backward;")
    assert "note" not in cli("send", DRIVE, "40", "005a", "01", *BOLT).err


def test_bytes_in_one_word_are_sent_as_they_are(cli: Cli) -> None:
    assert payload(cli, DRIVE, "649001") == "649001"


def test_an_unknown_command_has_no_names(cli: Cli) -> None:
    ran = cli("send", "0x16", "0x99", "speed=1", *BOLT)
    assert ran.code == 2
    assert "have no names" in ran.err


def test_what_is_typed_wrong_is_said_before_connecting(cli: Cli) -> None:
    ran = cli("send", DRIVE, "speed=999", "heading=0", "flags=0", "--device", "ble:nowhere")
    assert ran.code == 2
    assert "speed: 999 is out of range" in ran.err


def test_listen_sends_typed_arguments_too(cli: Cli) -> None:
    line = "sensor.set_sensor_streaming_mask interval=50ms count=1 sensor_masks=0x0007e000"
    ran = cli("listen", "--send", line, "--allow", "write", "--count", "1", "--device", "fake:bolt")
    assert ran.code == 0, ran.err
    assert "sensor_streaming_data_notify" in ran.out


@pytest.mark.parametrize("name", [DRIVE, "0x16:0x07"])
def test_help_for_one_command_has_an_example_that_runs(cli: Cli, name: str) -> None:
    ran = cli("send", name, "--help")
    assert ran.code == 0
    lines = ran.out.splitlines()
    assert lines[0] == f"{DRIVE}  0x16:0x07  v2  risk: motion"
    assert "  heading              u16      0..65535[deg]" in lines
    example = next(line for line in lines if line.startswith("Example: sphero-probe "))
    words = example.removeprefix("Example: sphero-probe ").split()
    sent = json.loads(cli(*words, *BOLT).out)[0]
    assert next(line for line in lines if line.startswith("Bytes:")).split()[4:7] == ["07", "00", "00"]
    assert sent["payload"] == "00000000"
    assert sent["withheld"] is None


def test_help_for_a_word_that_is_no_command_is_the_help_of_send(cli: Cli) -> None:
    assert cli("send", "nonsense", "--help").out == cli("send", "--help").out


def test_help_for_a_command_of_the_first_generation(cli: Cli) -> None:
    assert cli("send", "sphero.roll", "--help").out.startswith("sphero.roll  0x02:0x30  v1  risk: motion")


def test_the_node_that_the_catalogue_knows_is_suggested(cli: Cli) -> None:
    name = "drive.get_active_control_system_id"
    ran = cli("send", name, "--target", "primary", "--device", "fake:rvr")
    assert ran.code == 7
    assert f"the catalogue knows {name} on another node: --target secondary" in ran.err
    assert cli("send", name, "--target", "secondary", "--device", "fake:rvr").code == 0


@pytest.mark.parametrize(("colour", "said"), [("orange", "07 ff a5 00"), ("RED", "07 ff 00 00")])
def test_leds_take_colours_by_name(cli: Cli, colour: str, said: str) -> None:
    assert said in cli("led", "--front", colour, "--device", "fake:bolt", "--dry-run").out


def test_a_near_colour_is_suggested(cli: Cli) -> None:
    ran = cli("led", "--front", "oragne", "--device", "fake:bolt")
    assert ran.code == 2
    assert "did you mean 'orange'?" in ran.err
