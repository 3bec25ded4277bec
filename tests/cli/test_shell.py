"""``shell``: lines over one connection, with the same consent as outside."""

import io
import json
from pathlib import Path

import pytest
from prompt_toolkit.application import create_app_session
from prompt_toolkit.completion import CompleteEvent
from prompt_toolkit.document import Document
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.output import DummyOutput

from sphero_probe.cli import shell_prompt
from sphero_probe.cli.shared_connection import SharedConnection
from sphero_probe.cli.shell_prompt import GroupCompleter
from sphero_probe.simulator import FakeRobot, parse_settings
from tests.support.cli import Cli, Ran, objects
from tests.support.fake_bluez import FakeBlueZ, Peripheral, sphero_v2

ADDRESS = "AA:BB:CC:DD:EE:01"


def script(cli: Cli, monkeypatch: pytest.MonkeyPatch, lines: str, *options: str) -> Ran:
    monkeypatch.setattr("sys.stdin", io.StringIO(lines))
    ran = cli("shell", *options)
    assert SharedConnection.current() is None
    return ran


def test_the_lines_print_what_the_commands_print(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    lines = "# a comment\n\nsphero-probe explain 0x05\nled --list --format csv\nexit\nexplain 0x06\n"
    ran = script(cli, monkeypatch, lines, "--device", "fake:bolt")
    assert ran.code == 0
    assert (
        ran.out
        == cli("explain", "0x05").out + cli(*["led", "--list", "--format", "csv", "-d", "fake:bolt"]).out
    )


def test_all_lines_use_one_connection(
    cli: Cli, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = FakeRobot(parse_settings("bolt"))
    peripheral = Peripheral(robot.name, ADDRESS, robot=robot, services=sphero_v2(gate=False))
    with FakeBlueZ([peripheral]) as air:
        monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", air.address)
        lines = "led --front red\nsend api_and_shell.ping 01\nsweep --did 0x13 --cid 0-5\n"
        ran = script(cli, monkeypatch, lines, "--device", robot.name)
    assert ran.code == 0, ran.err
    assert len(ran.out.splitlines()) == 1 + 1 + 6
    assert peripheral.counts.connects == 1


def test_a_lost_connection_is_opened_again(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    line = "send power.get_battery_voltage --no-journal\n"
    ran = script(cli, monkeypatch, line * 9, "--keep-going", "--device", "fake:bolt?disconnect_after=3")
    answered = [row for row in ran.out.splitlines() if "\texists\t" in row]
    assert 5 <= len(answered) < 9
    assert ran.code == 4


@pytest.mark.parametrize(
    ("lines", "code", "said"),
    [
        pytest.param("led --front red\nsend power.sleep\nled --off\n", 6, "line 2 failed", id="blocked"),
        pytest.param("swep\n", 2, "did you mean 'sweep'", id="unknown"),
        pytest.param("shell\n", 2, "cannot run inside", id="shell"),
        pytest.param("led --front 'red\n", 2, "no closing quotation", id="quote"),
    ],
)
def test_a_script_stops_at_the_first_line_that_fails(
    cli: Cli, monkeypatch: pytest.MonkeyPatch, lines: str, code: int, said: str, tmp_path: Path
) -> None:
    ledger = tmp_path / "ledger.jsonl"
    ran = script(cli, monkeypatch, lines, "--device", f"fake:bolt?ledger={ledger}")
    assert ran.code == code
    assert said in ran.err
    executed = objects(ledger.read_text()) if ledger.exists() else []
    assert sum(entry["cid"] == 0x1C for entry in executed) == lines.count("--front red\n")


def test_a_consent_counts_for_one_line(cli: Cli, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    ledger = tmp_path / "ledger.jsonl"
    lines = "send power.sleep --allow motion\nsend power.wake\nsend power.sleep\n"
    ran = script(cli, monkeypatch, lines, "--device", f"fake:bolt?ledger={ledger}")
    assert ran.code == 6
    slept = [entry for entry in objects(ledger.read_text()) if (entry["did"], entry["cid"]) == (0x13, 0x01)]
    assert len(slept) == 1


def test_another_device_can_be_named(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    ran = script(cli, monkeypatch, "info --json --device fake:mini\n", "--device", "fake:bolt")
    facts = {fact["name"]: fact["value"] for fact in json.loads(ran.out)}
    assert facts["model"] == "Sphero Mini"


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def typed(cli: Cli, monkeypatch: pytest.MonkeyPatch, keys: str, *options: str) -> Ran:
    """Type keys at the prompt of a terminal."""
    monkeypatch.setattr("sys.stdin", Terminal())
    with create_pipe_input() as keyboard, create_app_session(input=keyboard, output=DummyOutput()):
        keyboard.send_text(keys)
        return cli("shell", *options)


def test_an_error_does_not_end_the_shell(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    ran = typed(cli, monkeypatch, "swep\rexplain 0x05\r\x04", "--device", "fake:bolt")
    assert ran.code == 0
    assert "did you mean 'sweep'" in ran.err
    assert ran.out == cli("explain", "0x05").out


def test_ctrl_c_clears_the_line(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    ran = typed(cli, monkeypatch, "nonsense\x03exit\r", "--device", "fake:bolt")
    assert (ran.code, ran.err) == (0, "")


def test_the_history_outlives_the_shell(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    typed(cli, monkeypatch, "explain 0x05\r\x04", "--device", "fake:bolt")
    again = typed(cli, monkeypatch, "\x10\r\x04", "--device", "fake:bolt")
    assert again.out == cli("explain", "0x05").out


def test_notifications_are_printed_at_the_prompt(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    monkeypatch.setattr("sys.stdin", Terminal())
    with create_pipe_input() as keyboard, create_app_session(input=keyboard, output=DummyOutput()):

        def hear(text: str) -> None:
            if not said:
                keyboard.send_text("exit\r")
            said.append(text)

        monkeypatch.setattr(shell_prompt, "say", hear)
        line = "send sensor.set_sensor_streaming_mask interval=20 count=0 sensor_masks=0x40000 --allow write"
        keyboard.send_text(f"{line}\r")
        assert cli("shell", "--device", "fake:bolt").code == 0
    assert said[0].startswith("sensor.sensor_streaming_data_notify: ")
    assert "pitch" in said[0], "the mask was set by an earlier command"


MASK = "send sensor.set_sensor_streaming_mask interval=20 count=0 sensor_masks={} --allow write\n"
PITCH, ROLL = MASK.format("0x40000"), MASK.format("0x20000")
LISTEN = "listen --count 1 --format jsonl\n"


def heard(ran: Ran) -> list[set[str]]:
    """The names of the values of each notification that a command heard, however it is shown."""
    assert ran.code == 0, ran.err
    lines = [objects(line)[0] for line in ran.out.splitlines() if line.startswith("{")]
    return [set(line["fields"]) for line in lines if line.get("kind") == "notification"]


@pytest.mark.parametrize(
    ("lines", "named"),
    [
        pytest.param(PITCH + LISTEN, [{"pitch"}], id="the command before"),
        pytest.param(PITCH + "explain 0x05\ninfo\n" + LISTEN * 2, [{"pitch"}] * 2, id="others between"),
        pytest.param(PITCH + LISTEN + ROLL + LISTEN, [{"pitch"}, {"roll"}], id="another mask"),
        pytest.param(PITCH + "info -d fake:mini\n" + LISTEN, [{"pitch"}], id="another robot between"),
    ],
)
def test_values_are_named_by_what_an_earlier_line_told_the_robot_to_stream(
    cli: Cli, monkeypatch: pytest.MonkeyPatch, lines: str, named: list[set[str]]
) -> None:
    assert heard(script(cli, monkeypatch, lines, "--device", "fake:bolt")) == named


def test_notes_of_a_run_name_them_too(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    lines = PITCH + "sweep --did 0x13 --cid 0-0x20 --format jsonl\n"
    found = heard(script(cli, monkeypatch, lines, "--device", "fake:bolt?latency=20ms"))
    assert found
    assert all(names == {"pitch"} for names in found)


def test_a_rejected_or_blocked_mask_names_nothing(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    blocked = ROLL.replace(" --allow write", "")
    rejected = "send 0x18 0x00 00 --target 0x12 --allow write\n"
    lines = PITCH + blocked + rejected + LISTEN
    ran = script(cli, monkeypatch, lines, "--keep-going", "--device", "fake:bolt")
    assert ran.code != 0
    assert heard(ran._replace(code=0)) == [{"pitch"}]


def test_another_shell_begins_with_nothing(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    assert heard(script(cli, monkeypatch, PITCH + LISTEN, "--device", "fake:bolt")) == [{"pitch"}]
    lines = "listen --seconds 0.1 --format jsonl\n"
    assert heard(script(cli, monkeypatch, lines, "--device", "fake:bolt")) == []


def test_services_of_rvr_are_named_too(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    lines = (
        "send sensor.configure_streaming_service token=1 configuration=000100 --target 0x12 --allow write\n"
        "send sensor.start_streaming_service period=20 --target 0x12 --allow write\n" + LISTEN
    )
    (names,) = heard(script(cli, monkeypatch, lines, "--device", "fake:rvr"))
    assert len(names) > 1, names


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        pytest.param("swe", "sweep", id="command"),
        pytest.param("sweep --all", "--allow", id="option"),
        pytest.param("send power.get_battery_p", "power.get_battery_percentage", id="name"),
        pytest.param("stream accele", "accelerometer", id="sensor"),
    ],
)
def test_what_the_shells_complete_is_offered(line: str, offered: str) -> None:
    offers = GroupCompleter().get_completions(Document(line), CompleteEvent())
    assert offered in [offer.text for offer in offers]
