import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue import ROBOTS
from sphero_probe.errors import UsageError
from sphero_probe.simulator import Claims, Settings, Strict, parse_settings
from sphero_probe.simulator.settings import KEYS, Line, Overflow, Timing

BOLT = ROBOTS["bolt"]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        pytest.param("bolt", Settings(BOLT), id="nothing set"),
        pytest.param("bolt?", Settings(BOLT), id="empty query"),
        pytest.param("BOLT+", Settings(ROBOTS["bolt-plus"]), id="alias, upper case"),
        pytest.param(
            "bolt-plus?seed=3&latency=15ms&silent=0x13:0x10,0x11:0x00",
            Settings(
                ROBOTS["bolt-plus"], seed=3, latency=0.015, silent=frozenset({(0x13, 0x10), (0x11, 0x00)})
            ),
            id="the address of the manual",
        ),
        pytest.param("bolt?latency=0.5s", Settings(BOLT, latency=0.5), id="seconds"),
        pytest.param("bolt?latency=2min", Settings(BOLT, latency=120.0), id="minutes"),
        pytest.param("bolt?seed=0x1f&hidden=12", Settings(BOLT, seed=31, hidden=12), id="numbers"),
        pytest.param("bolt?silent=19:16", Settings(BOLT, silent=frozenset({(19, 16)})), id="decimal pair"),
        pytest.param("bolt?strict=none", Settings(BOLT, strict=Strict.NONE), id="strictness"),
        pytest.param("bolt?claims=lying", Settings(BOLT, claims=Claims.LYING), id="claims"),
        pytest.param("bolt?mask=1", Settings(BOLT, mask=frozenset(range(256))), id="mask everywhere"),
        pytest.param("bolt?mask=0x13,23", Settings(BOLT, mask=frozenset({0x13, 23})), id="mask in devices"),
        pytest.param("bolt?mask=0", Settings(BOLT), id="mask nowhere"),
        pytest.param(
            "bolt?loss=0.02&corrupt=1&duplicate=0&busy=.5",
            Settings(BOLT, loss=0.02, corrupt=1.0, busy=0.5),
            id="probabilities",
        ),
        pytest.param(
            "bolt?interval=30ms&per_event=4&queue=8&reorder=0.25",
            Settings(BOLT, interval=0.03, per_event=4, queue=8, reorder=0.25),
            id="link",
        ),
        pytest.param(
            "bolt?queue=2&overflow=busy&service=3ms",
            Settings(BOLT, queue=2, overflow=Overflow.BUSY, service=0.003),
            id="queue",
        ),
        pytest.param(
            "bolt?sleep_after=2min&disconnect_after=20&reboot_on=0x13:0x2a",
            Settings(BOLT, sleep_after=120.0, disconnect_after=20, reboot_on=(0x13, 0x2A)),
            id="trouble",
        ),
        pytest.param("bolt?split=1", Settings(BOLT, split=1), id="split"),
        pytest.param("bolt?timing=measured", Settings(BOLT, timing=Timing.MEASURED), id="measured"),
        pytest.param(
            "bolt?line=uart&baud=9600", Settings(BOLT, line=Line.UART, baud=9600), id="UART with a baud rate"
        ),
        pytest.param(
            "bolt?truth=/a/t.jsonl&ledger=a%26b",
            Settings(BOLT, truth="/a/t.jsonl", ledger="a&b"),
            id="paths, percent-encoded",
        ),
    ],
)
def test_settings_are_read(text: str, expected: Settings) -> None:
    assert parse_settings(text) == expected


@pytest.mark.parametrize(
    ("text", "words"),
    [
        pytest.param("blot", ["'blot'", "did you mean bolt?", "bolt-plus"], id="model, one off"),
        pytest.param("toaster", ["'toaster'", "bolt, bolt-plus"], id="model, nothing near"),
        pytest.param("", ["bolt, bolt-plus"], id="no model"),
        pytest.param("bolt?latensy=15ms", ["'latensy'", "did you mean latency?"], id="key, one off"),
        pytest.param("bolt?zzz=1", ["'zzz'", "seed", "ledger"], id="key, nothing near"),
        pytest.param("bolt?Seed=1", ["did you mean seed?"], id="key in upper case"),
        pytest.param("bolt?seed=1&seed=1", ["seed", "twice"], id="key twice"),
        pytest.param("bolt?baud=9600", ["baud", "UART"], id="baud rate of a radio"),
        pytest.param("bolt?line=uart&baud=1", ["baud=1", "from 300"], id="baud rate too low"),
        pytest.param("bolt?timing=guessed", ["fixed, measured"], id="timing that is none"),
        pytest.param("bolt?latency=15", ["latency", "unit", "15ms"], id="time without a unit"),
        pytest.param("bolt?latency=0", ["latency", "unit"], id="zero without a unit"),
        pytest.param("bolt?latency=5h", ["latency=5h", "15ms"], id="unit that is none"),
        pytest.param("bolt?latency=-5ms", ["latency=-5ms"], id="negative time"),
        pytest.param("bolt?latency=nan", ["latency"], id="time that is no number"),
        pytest.param("bolt?loss=1.01", ["loss=1.01", "0 to 1"], id="probability above one"),
        pytest.param("bolt?busy=-0.1", ["busy", "0 to 1"], id="probability below zero"),
        pytest.param("bolt?corrupt=nan", ["corrupt", "0 to 1"], id="probability that is no number"),
        pytest.param("bolt?duplicate=", ["duplicate"], id="no value"),
        pytest.param("bolt?seed", ["seed", "whole number"], id="no equals sign"),
        pytest.param("bolt?seed=1.5", ["seed=1.5", "whole number"], id="half a number"),
        pytest.param("bolt?seed=1_0", ["seed=1_0"], id="number with an underscore"),
        pytest.param("bolt?seed=٣", ["seed"], id="digit of another script"),
        pytest.param("bolt?hidden=501", ["hidden=501", "500"], id="too many hidden"),
        pytest.param("bolt?split=0", ["split=0", "from 1"], id="chunks of nothing"),
        pytest.param("bolt?mask=yes", ["mask=yes", "0, 1 or device ids"], id="no switch"),
        pytest.param("bolt?strict=exakt", ["exact, minimum, none"], id="no strictness"),
        pytest.param("bolt?claims=maybe", ["true, partial, lying, none"], id="no claim"),
        pytest.param("bolt?silent=0x13", ["silent", "DID:CID"], id="half a pair"),
        pytest.param("bolt?silent=0x13:0x100", ["silent", "DID:CID"], id="pair out of range"),
        pytest.param("bolt?silent=0x13:0x10,", ["silent", "DID:CID"], id="pair missing"),
        pytest.param("bolt?silent=1:2:3", ["silent", "DID:CID"], id="a triple"),
        pytest.param("bolt?interval=30", ["interval", "unit", "30ms"], id="interval without a unit"),
        pytest.param("bolt?interval=0ms", ["interval=0ms", "1ms or more"], id="no time between events"),
        pytest.param("bolt?sleep_after=60", ["sleep_after", "60s"], id="idleness without a unit"),
        pytest.param("bolt?sleep_after=0s", ["sleep_after=0s", "1ms or more"], id="no idleness"),
        pytest.param("bolt?per_event=0", ["per_event=0", "from 1 up"], id="empty events"),
        pytest.param("bolt?overflow=full", ["overflow", "lost", "busy"], id="no such overflow"),
        pytest.param("bolt?queue=0", ["queue=0", "from 1 up"], id="no queue"),
        pytest.param("bolt?disconnect_after=0", ["disconnect_after=0", "from 1 up"], id="no connection"),
        pytest.param("bolt?reorder=2", ["reorder=2", "0 to 1"], id="order above one"),
        pytest.param("bolt?reboot_on=0x13", ["reboot_on", "DID:CID"], id="half a trigger"),
        pytest.param("bolt?reboot_on=1:2,3:4", ["reboot_on", "DID:CID"], id="two triggers"),
        pytest.param("bolt?truth=", ["truth", "file name"], id="no file name"),
    ],
)
def test_what_makes_no_sense_is_a_usage_error_of_one_line(text: str, words: list[str]) -> None:
    with pytest.raises(UsageError) as caught:
        parse_settings(text)
    message = str(caught.value)
    assert [word for word in words if word not in message] == []
    assert "\n" not in message


def test_a_robot_whose_generation_cannot_be_played(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sphero_probe.simulator.settings.RESPONSE_STYLES", {})
    with pytest.raises(UsageError, match="no fake bolt yet"):
        parse_settings("bolt")


def test_every_key_is_a_field() -> None:
    assert set(KEYS) == set(Settings._fields) - {"model"}


@given(st.text(max_size=40), st.text(max_size=10))
def test_any_text_gives_settings_or_a_usage_error(query: str, value: str) -> None:
    for text in (query, f"bolt?{query}", *(f"bolt?{key}={value}" for key in KEYS)):
        try:
            settings = parse_settings(text)
        except UsageError:
            continue
        assert settings.model in ROBOTS.values()
