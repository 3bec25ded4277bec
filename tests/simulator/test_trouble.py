"""A robot in trouble: it sleeps, loses the line, starts anew, is asked too much at once."""

from collections.abc import Sequence

import pytest

from sphero_probe.catalogue import ROBOTS
from sphero_probe.catalogue.leds import led_commands
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Malformed, Notification, Packet, Response, Role
from sphero_probe.simulator import Executed, FakeRobot, parse_settings
from sphero_probe.simulator.command_queue import SERVICE
from sphero_probe.simulator.robot import BOOTING
from tests.support.narrowing import every, only

ECHO, WAKE, BATTERY, SLEEP = (Command(*pair) for pair in ((0x10, 0), (0x13, 0x0D), (0x13, 0x10), (0x13, 1)))
PING = Command(0x00, 0x01)
SET_NAME = {"bolt": Command(0x19, 0x03, b"Rey\0"), "bb8": Command(0x00, 0x10, b"Rey\0")}
SET_LED = {key: led_commands(ROBOTS[key], {"front": (1, 2, 3)})[0] for key in SET_NAME}
WARNED, SLEPT, AWAKE = (0x13, 0x19), (0x13, 0x1A), (0x13, 0x11)


class Host:
    """A host at the other end of one robot, with the time in its hand."""

    def __init__(self, text: str) -> None:
        self.executed: list[Executed] = []
        self.robot = FakeRobot(parse_settings(text), self.executed.append)
        self.codec = CODECS[self.robot.model.generation]
        self.decoder = self.codec.decoder(Role.HOST)

    def write(self, *commands: Command, now: float = 0.0, **flags: bool) -> None:
        for seq, command in enumerate(commands):
            self.robot.hear(self.codec.encode_command(command, seq, **flags), now=now)

    def hear(self, now: float) -> list[Packet]:
        return self.decoder.feed(b"".join(self.robot.speak(now=now)))

    def ask(self, *commands: Command, now: float = 0.0, **flags: bool) -> list[Packet]:
        self.write(*commands, now=now, **flags)
        return self.hear(now)

    def news(self, now: float) -> list[tuple[int | None, int]]:
        return [(one.did, one.cid) for one in self.hear(now) if isinstance(one, Notification)]


def _seqs(packets: Sequence[Packet]) -> list[int]:
    return [packet.seq for packet in packets if isinstance(packet, Response)]


@pytest.mark.parametrize(
    ("after", "turns"),
    [
        pytest.param(60.0, [(50.0, WARNED), (60.0, SLEPT)], id="with a warning"),
        pytest.param(10.0, [(10.0, SLEPT)], id="too short for a warning"),
        pytest.param(0.5, [(0.5, SLEPT)], id="half a second"),
    ],
)
def test_it_sleeps_when_nothing_was_heard(after: float, turns: list[tuple[float, tuple[int, int]]]) -> None:
    host = Host(f"bolt?sleep_after={after}s")
    assert _seqs(host.ask(ECHO, now=100.0)) == [0]
    for when, pair in turns:
        assert host.robot.next_time() == 100.0 + when
        assert host.news(100.0 + when) == [pair]
    assert host.robot.asleep
    assert host.robot.next_time() is None
    assert host.ask(ECHO, BATTERY, now=300.0) == []
    answer, news = host.ask(WAKE, now=301.0)
    assert isinstance(answer, Response)
    assert isinstance(news, Notification)
    assert (answer.code, news.cid) == (0, 0x11)
    assert _seqs(host.ask(ECHO, now=301.0)) == [0]


def test_only_activity_keeps_it_awake() -> None:
    host = Host("bolt?sleep_after=60s")
    host.ask(ECHO, now=0.0)
    assert _seqs(host.ask(ECHO, now=40.0, activity=False)) == [0]
    assert _seqs(host.ask(ECHO, now=45.0)) == [0]
    assert host.news(104.0) == [WARNED]
    assert host.news(105.0) == [SLEPT]


def test_who_was_woken_sleeps_again_whatever_the_flag() -> None:
    host = Host("bolt?sleep_after=5s")
    assert host.ask(SLEEP, now=0.0)
    assert host.ask(WAKE, now=10.0, activity=False)
    assert host.news(15.0) == [SLEPT]


def test_a_short_sleep_of_the_first_generation() -> None:
    host = Host("bb8?sleep_after=20s")
    host.ask(PING, now=0.0)
    assert host.news(10.0) == [(None, 0x05)]
    assert host.news(20.0) == [(None, 0x14)]
    assert host.ask(PING, now=21.0) == []
    host.robot.connect(now=22.0)
    assert _seqs(host.ask(PING, now=22.0)) == [0]


def test_connecting_wakes_no_robot_that_has_a_command_for_it() -> None:
    host = Host("bolt?sleep_after=5s")
    assert host.news(0.0) == []
    assert host.news(5.0) == [SLEPT]
    host.robot.connect(now=6.0)
    assert host.robot.asleep
    assert host.ask(ECHO, now=6.0) == []


@pytest.mark.parametrize("number", [1, 3])
def test_the_line_drops_after_so_many_commands_and_again(number: int) -> None:
    host = Host(f"bolt?disconnect_after={number}")
    for connection in range(1, 4):
        assert (host.robot.connected, host.robot.connection) == (True, connection)
        assert _seqs(host.ask(*[ECHO] * (number + 2), now=float(connection))) == list(range(number))
        assert not host.robot.connected
        assert host.ask(ECHO, now=connection + 0.5) == []
        host.robot.connect(now=connection + 0.75)
    assert len(host.executed) == 3 * number


def test_commands_in_one_write_count_each() -> None:
    host = Host("bolt?disconnect_after=2")
    host.robot.hear(b"".join(host.codec.encode_command(ECHO, seq) for seq in range(5)), now=0.0)
    assert _seqs(host.hear(0.0)) == [0, 1]
    assert len(host.executed) == 2


@pytest.mark.parametrize("delay", ["latency=10ms", "queue=4", "interval=30ms"])
def test_what_is_in_the_air_when_the_line_drops_is_lost(delay: str) -> None:
    host = Host(f"bolt?disconnect_after=2&{delay}")
    host.write(ECHO, now=0.0)
    assert _seqs(host.hear(0.5)) == [0]
    host.write(ECHO, now=1.0)
    assert host.hear(1.5) == []
    assert not host.robot.connected
    host.robot.connect(now=2.0)
    assert host.hear(3.0) == []
    host.write(ECHO, now=4.0)
    assert _seqs(host.hear(5.0)) == [0]


def test_a_new_connection_knows_nothing_of_half_a_packet() -> None:
    host = Host("bolt")
    frame = host.codec.encode_command(ECHO, 9)
    host.robot.hear(frame[:4], now=0.0)
    host.robot.connect(now=1.0)
    host.robot.hear(frame, now=1.0)
    assert _seqs(host.hear(1.0)) == [9]
    assert host.robot.malformed == 0


def test_a_robot_does_not_change_when_the_line_does() -> None:
    host = Host("bolt")
    host.ask(SET_LED["bolt"], SET_NAME["bolt"])
    leds = host.robot.leds
    host.robot.connect(now=1.0)
    assert host.robot.leds == leds
    assert set(leds.values()) == {0, 1, 2, 3}
    assert host.robot.name == "Rey"


@pytest.mark.parametrize("trigger", [b"", bytes(11), b"\1"], ids=["empty", "wrong length", "one byte"])
@pytest.mark.parametrize(("model", "read"), [("bolt", ECHO), ("bb8", PING)])
def test_a_reboot_is_silence_and_then_a_greeting(model: str, read: Command, trigger: bytes) -> None:
    host = Host(f"{model}?reboot_on=0x00:0x77")
    host.ask(SET_NAME[model], SET_LED[model])
    assert any(host.robot.leds.values())
    before = list(host.executed)
    assert host.ask(Command(0x00, 0x77, trigger), now=1.0) == []
    assert host.executed == before
    assert not host.robot.connected
    host.robot.connect(now=1.25)
    assert host.ask(read, WAKE, now=1.25) == []
    assert host.ask(read, now=1.0 + BOOTING - 0.01) == []
    assert host.robot.next_time() == 1.0 + BOOTING
    (greeting,) = host.hear(1.0 + BOOTING) or [Malformed(b"u>", "a prompt, told with the next packet")]
    if model == "bolt":
        assert isinstance(greeting, Notification)
        assert (greeting.did, greeting.cid) == AWAKE
    packets = host.ask(read, now=3.0)
    assert _seqs(packets) == [0]
    assert [one.raw for one in packets if isinstance(one, Malformed)] == ([b"u>"] if model == "bb8" else [])
    assert not any(host.robot.leds.values())
    assert host.robot.name == "Rey"


def test_nobody_hears_a_greeting_without_a_line() -> None:
    host = Host("bolt?reboot_on=0x13:0x10")
    host.ask(BATTERY)
    assert host.hear(60.0) == []
    host.robot.connect(now=61.0)
    assert host.hear(62.0) == []
    assert _seqs(host.ask(ECHO, now=62.0)) == [0]


def test_a_reboot_ends_streams_and_what_was_set_for_now() -> None:
    host = Host("bolt?reboot_on=0x13:0x2a")
    stream = Command(0x18, 0x00, bytes.fromhex("00640000070000"), 0x12)
    assert only(Response, host.ask(stream)).code == 0
    assert host.news(0.25) == [(0x18, 0x02)] * 2
    host.write(Command(0x13, 0x2A), now=0.25)
    host.robot.connect(now=0.3)
    assert host.news(20.0) == [AWAKE]
    assert host.robot.next_time() is None


def test_a_sleeper_does_not_hear_what_would_reboot_it() -> None:
    host = Host("bolt?reboot_on=0x13:0x10")
    host.ask(SLEEP)
    assert host.ask(BATTERY, now=1.0) == []
    assert host.robot.connected
    assert host.ask(WAKE, now=2.0)


def test_time_until_sleep_starts_with_the_boot() -> None:
    host = Host("bolt?reboot_on=0x13:0x10&sleep_after=5s")
    host.ask(BATTERY)
    host.robot.connect(now=0.0)
    assert host.news(6.4) == [AWAKE]
    assert host.news(6.5) == [SLEPT]


@pytest.mark.parametrize("number", [5, 9, 10, 30])
def test_a_burst_beyond_the_queue_loses_the_surplus(number: int) -> None:
    host = Host("bolt?queue=8")
    host.write(*[ECHO] * number, now=0.0)
    assert host.hear(0.0) == []
    assert _seqs(host.hear(1.0)) == list(range(min(number, 9)))
    assert len(host.executed) == min(number, 9)


def test_a_burst_beyond_the_queue_may_be_told_so() -> None:
    host = Host("bolt?queue=2&overflow=busy")
    host.write(*[ECHO] * 5, now=0.0)
    codes = {packet.seq: packet.code for packet in every(Response, host.hear(1.0))}
    assert codes == {0: 0x00, 1: 0x00, 2: 0x00, 3: 0x08, 4: 0x08}
    assert len(host.executed) == 3


def test_serving_takes_the_time_that_is_set() -> None:
    host = Host("bolt?queue=8&service=250ms")
    host.write(ECHO, ECHO, now=0.0)
    assert _seqs(host.hear(0.25)) == [0]
    assert _seqs(host.hear(0.5)) == [1]


def test_who_waits_for_service_loses_nothing() -> None:
    host = Host("bolt?queue=1")
    for number in range(50):
        host.write(ECHO, now=number * 2 * SERVICE)
    assert len(_seqs(host.hear(9.0))) == 50


def test_a_queue_executes_in_order_with_what_happens_by_itself() -> None:
    host = Host("bolt?queue=8")
    host.write(ECHO, SLEEP, BATTERY, now=0.0)
    assert _seqs(host.hear(1.0)) == [0, 1]
    assert [(one.did, one.cid) for one in host.executed] == [(0x10, 0), (0x13, 1)]


def test_events_carry_what_they_can_and_no_more() -> None:
    host = Host("bolt?interval=30ms&per_event=4")
    assert host.hear(0.0) == []
    host.write(*[ECHO] * 10, now=0.0)
    arrived = []
    while (now := host.robot.next_time()) is not None:
        chunks = host.robot.speak(now=now)
        assert len(chunks) <= 4
        arrived += [(round(now / 0.03), seq) for seq in _seqs(host.decoder.feed(b"".join(chunks)))]
    assert arrived == [(2 + seq // 4, seq) for seq in range(10)]
    assert len(host.executed) == 10


def test_reordered_answers_all_come() -> None:
    host = Host("bolt?reorder=0.4&seed=3")
    host.write(*[ECHO] * 100, now=0.0)
    seqs = _seqs(host.hear(0.0)) + _seqs(host.hear(1.0))
    assert sorted(seqs) == list(range(100)) != seqs


def test_equal_settings_give_equal_trouble() -> None:
    text = (
        "bolt?seed=5&reorder=.3&loss=.1&queue=2&interval=15ms&per_event=2&disconnect_after=9&reboot_on=19:16"
    )

    def play() -> tuple[list[tuple[bool, list[bytes]]], list[Executed], int]:
        host, said = Host(text), []
        for step in range(400):
            host.write(BATTERY if step % 50 == 49 else ECHO, now=step * 0.01)
            said.append((host.robot.connected, host.robot.speak(now=step * 0.01)))
            if not host.robot.connected:
                host.robot.connect(now=step * 0.01)
        return said, host.executed, host.robot.connection

    first = play()
    assert first == play()
    assert first[2] > 10
