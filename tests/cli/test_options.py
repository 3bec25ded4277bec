"""Options: each is one typed value, takes what it should, and refuses the rest before anything is sent."""

from collections.abc import Iterator
from pathlib import Path

import click
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.cli.group import whole_group
from sphero_probe.cli.parse import hex_bytes, is_hex
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.time_type import Seconds
from sphero_probe.cli.values import SUFFIXES
from sphero_probe.errors import UsageError
from tests.support.cli import Cli

FAKE = ("--device", "fake:bolt")
USAGE = 2


def leaves(group: click.Group) -> Iterator[tuple[str, click.Command]]:
    for name, command in group.commands.items():
        if isinstance(command, click.Group):
            yield from ((f"{name} {inner}", leaf) for inner, leaf in leaves(command))
        else:
            yield name, command


COMMANDS = dict(leaves(whole_group()))
TIMES = [
    pytest.param(name, max(option.opts, key=len), id=f"{name} {option.opts[0]}")
    for name, command in COMMANDS.items()
    for option in command.params
    if isinstance(option.type, Seconds)
]


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("500ms", 0.5),
        ("2s", 2.0),
        ("1m", 60.0),
        ("1min", 60.0),
        ("2", 2.0),
        ("0.5", 0.5),
        (".5s", 0.5),
        ("1.5m", 90.0),
        (" 3 ", 3.0),
    ],
)
def test_a_time_is_read(text: str, seconds: float) -> None:
    assert Seconds(0.1, 600).convert(text, None, None) == pytest.approx(seconds)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        pytest.param("nan", "'nan' is not a time; write it as 500ms, 2s, 1m", id="nan"),
        pytest.param("inf", "not a time", id="inf"),
        pytest.param("-inf", "not a time", id="minus-inf"),
        pytest.param("-1", "not a time", id="negative"),
        pytest.param("+1", "not a time", id="plus"),
        pytest.param("1e3", "not a time", id="exponent"),
        pytest.param("1_0", "not a time", id="underscore"),
        pytest.param("2h", "not a time", id="hours"),
        pytest.param("2S", "not a time", id="upper-case"),
        pytest.param("2 s", "not a time", id="blank-inside"),
        pytest.param("s", "not a time", id="unit-alone"),
        pytest.param("", "not a time", id="empty"),
        pytest.param("٣", "not a time", id="digit-of-another-script"),
        pytest.param("0", "not between 10ms and 1m", id="zero"),
        pytest.param("0ms", "not between 10ms and 1m", id="zero-ms"),
        pytest.param("9ms", "not between 10ms and 1m", id="too-short"),
        pytest.param("61", "not between 10ms and 1m", id="too-long"),
        pytest.param("9" * 400, "not between 10ms and 1m", id="beyond-any-float"),
    ],
)
def test_what_is_no_time_is_refused(text: str, said: str) -> None:
    with pytest.raises(click.BadParameter, match=said):
        Seconds(0.01, 60).convert(text, None, None)


@given(st.text(max_size=12))
def test_any_text_is_a_time_within_bounds_or_refused(text: str) -> None:
    try:
        seconds = Seconds(0.01, 60).convert(text, None, None)
    except click.BadParameter:
        return
    assert 0.01 <= seconds <= 60


RATES = {"rate"}
"""Options that count per second."""


def test_every_option_that_counts_seconds_is_a_time() -> None:
    assert {param.values[1] for param in TIMES} == {
        "--connect-timeout",
        "--idle",
        "--seconds",
        "--timeout",
        "--wait",
    }
    for command in COMMANDS.values():
        for option in command.params:
            is_number = isinstance(option.type, click.FloatRange | click.types.FloatParamType)
            assert not is_number or option.name in RATES, option


@pytest.mark.parametrize(("name", "option"), TIMES)
@pytest.mark.parametrize("text", ["nan", "inf", "-1", "0", "1e999", "9" * 30, ""])
def test_no_command_takes_a_senseless_time(cli: Cli, name: str, option: str, text: str) -> None:
    words = {"send": ("0x13", "0x10"), "sweep": ("--did", "0x13"), "led": ("--off",)}.get(name, ())
    ran = cli(*name.split(), *words, option, text)
    assert ran.code == USAGE
    assert option in ran.err
    assert len(ran.err.splitlines()) == 2
    assert ran.out == ""


@pytest.mark.parametrize("text", ["0", "-1", "nan", "1.5", "inf", "x", "9" * 5000])
def test_a_count_is_a_whole_number_from_one_up(cli: Cli, text: str) -> None:
    assert cli("listen", "--count", text, *FAKE).code == USAGE


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_refuses_repeated_options(name: str) -> None:
    assert isinstance(COMMANDS[name], StrictCommand)


@pytest.mark.parametrize("name", COMMANDS)
def test_what_an_option_offers_exists(name: str) -> None:
    context = click.Context(COMMANDS[name], resilient_parsing=True)
    for param in COMMANDS[name].params:
        offers = param.shell_complete(context, "zz")  # an unknown kind of offer would raise KeyError
        assert all(offer.value.startswith("zz") for offer in offers)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        pytest.param(("sweep", "--did", "0x13", "--did", "0x11", *FAKE), "--did is given twice", id="did"),
        pytest.param(
            ("info", "-d", "fake:bolt", "-d", "fake:mini"),
            "--device is given twice; for several robots: sphero-probe fleet",
            id="device",
        ),
        pytest.param(
            ("info", "-d", "fake:bolt", "--device=fake:bolt"), "--device is given twice", id="both-spellings"
        ),
        pytest.param(
            ("led", "--front", "f00", "--front", "00f", *FAKE), "--front is given twice", id="front"
        ),
        pytest.param(("led", "--led", "front=f00", "--led", "front=00f", *FAKE), "named twice", id="led"),
        pytest.param(
            ("led", "--front", "f00", "--led", "front=00f", *FAKE), "named twice", id="led-and-front"
        ),
        pytest.param(("catalog", "--json", "--format", "csv"), "--json and --format exclude", id="json-csv"),
        pytest.param(("catalog", "--format", "csv", "--json"), "--format and --json exclude", id="csv-json"),
        pytest.param(("catalog", "--v1", "--v2"), "--v1 and --v2 exclude", id="catalog-both"),
        pytest.param(("decode", "--v1", "--v2", "8d"), "--v1 and --v2 exclude", id="decode-both"),
        pytest.param(("decode", "--v1", "--v1", "8d"), "--v1 is given twice", id="a-flag"),
        pytest.param(("plan", "list", "--color", "never", "--color", "auto"), "--color is", id="subcommand"),
        pytest.param(("info", "-d", ""), "is empty; leave --device out", id="empty-device"),
        pytest.param(("info", "-d", " "), "is empty; leave --device out", id="blank-device"),
        pytest.param(
            ("catalog", "-o", "map.doc"), "map.doc: the suffix .doc stands for no format", id="unknown-suffix"
        ),
        pytest.param(
            ("catalog", "-o", "map.DOC"),
            "use .json, .jsonl, .csv, .txt, .md, .html",
            id="suffixes-are-listed",
        ),
    ],
)
def test_contradictions_are_usage_errors(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...], said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    ran = cli(*arguments)
    assert ran.code == USAGE
    assert said in ran.err
    assert ran.out == ""
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "arguments",
    [
        pytest.param(("sweep", "--did", "0x13", "--did", "0x13", "--help"), id="help-wins"),
        pytest.param(("led", "--led", "front=f00", "--led", "back=f00", *FAKE), id="lists"),
        pytest.param(("send", "0x13", "0x03", "--allow", "write", "--allow", "motion", *FAKE), id="allow"),
        pytest.param(("catalog", "--json"), id="json"),
        pytest.param(("catalog", "--format", "csv"), id="format"),
    ],
)
def test_what_is_no_contradiction_works(cli: Cli, arguments: tuple[str, ...]) -> None:
    assert cli(*arguments).code == 0


def test_an_empty_device_in_the_environment_is_none_at_all(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SPHERO_PROBE_DEVICE", "")
    assert cli("send", "power.get_battery_percentage", "--dry-run").code == 0


@pytest.mark.parametrize("suffix", [*SUFFIXES, ".JSON", ""])
def test_known_suffixes_are_written(cli: Cli, tmp_path: Path, suffix: str) -> None:
    assert cli("catalog", "battery", "-o", str(tmp_path / f"out{suffix}")).code == 0


def test_a_format_goes_with_any_suffix(cli: Cli, tmp_path: Path) -> None:
    assert cli("catalog", "battery", "--format", "csv", "-o", str(tmp_path / "map.md")).code == 0


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("0x1 0x2", "0102"),
        ("0x7 0xf 0x0 0x0", "070f0000"),
        ("01 02", "0102"),
        ("0102", "0102"),
        ("01:02", "0102"),
        ("1:2", "0102"),
        ("0x0102", "0102"),
        ("1 2", "0102"),
        ("1,2", "0102"),
        ("8d_0a", "8d0a"),
        ("0X8D", "8d"),
        ("0x1 02 3 0405", "0102030405"),
        ("7", "07"),
        (" 01  02\n", "0102"),
        ("", ""),
    ],
)
def test_hex_is_read_by_token(text: str, expected: str) -> None:
    assert hex_bytes(text, "payload").hex() == expected
    assert is_hex(text) == bool(text)


@pytest.mark.parametrize(
    ("text", "said", "hint"),
    [
        pytest.param(
            "123", "payload: '123' has an odd number of hex digits", "write 01 23 or 12 03", id="bare"
        ),
        pytest.param("0x123", "'0x123' has an odd number", "write 01 23 or 12 03", id="prefixed"),
        pytest.param(
            "01 8d0a1", "'8d0a1' has an odd number", "write 08 d0 a1 or 8d 0a 01", id="second-token"
        ),
        pytest.param("f" * 99, f"'{'f' * 16}...' has an odd number", "a digit is missing", id="long"),
        pytest.param("zz", "'zz' is not hexadecimal", "00ff", id="letters"),
        pytest.param("0x", "'0x' is not hexadecimal", "00ff", id="prefix-alone"),
        pytest.param("0x10x2", "'0x10x2' is not hexadecimal", "00ff", id="prefix-inside"),
        pytest.param("01-02", "'01-02' is not hexadecimal", "00ff", id="dash"),
        pytest.param("z" * 999, f"'{'z' * 16}' is not", "00ff", id="long-and-wrong"),
    ],
)
def test_unclear_hex_is_a_usage_error(text: str, said: str, hint: str) -> None:
    with pytest.raises(UsageError) as caught:
        hex_bytes(text, "payload")
    assert said in str(caught.value)
    assert hint in caught.value.hint


@given(st.lists(st.binary(min_size=1, max_size=4)), st.sampled_from(" :,_"))
def test_bytes_in_tokens_come_back(groups: list[bytes], separator: str) -> None:
    assert hex_bytes(separator.join(f"0x{group.hex()}" for group in groups), "payload") == b"".join(groups)
    assert hex_bytes(separator.join(group.hex() for group in groups), "payload") == b"".join(groups)


def test_the_same_bytes_are_sent_however_they_are_written(cli: Cli) -> None:
    sent = {
        cli("send", "drive.set_raw_motors", *words, "--dry-run", "--format", "csv", *FAKE).out
        for words in (("0x1", "0x7f", "0x0", "0x0"), ("017f0000",), ("1 7f 0 0",), ("01:7f:00:00",))
    }
    assert len(sent) == 1
    assert "01 7f 00 00" in sent.pop()
