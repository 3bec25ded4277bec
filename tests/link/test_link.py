"""A link on a virtual clock: pace and window, commands sent alone, silence, loss, and cancelled calls."""

import asyncio
from collections import Counter
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager, suppress
from typing import Any

import pytest

from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import LinkLostError
from sphero_probe.link.events import Events, UnsolicitedReceived
from sphero_probe.link.exchange import Answered, Blocked, Exchange, LateResponse, Silent, Unsolicited
from sphero_probe.link.link import Link
from sphero_probe.link.pacing import (
    BACKOFF,
    FIRST_TIMEOUT,
    FIRST_WINDOW,
    GRACE,
    LONGEST_BACKOFF,
    LONGEST_TIMEOUT,
    SHORTEST_TIMEOUT,
    WIDEST,
)
from sphero_probe.link.policy import Consent, Policy
from sphero_probe.link.tracker import QUIET, REUSE_AFTER_SILENCE
from sphero_probe.protocol.packets import (
    Command,
    Generation,
    Malformed,
    Notification,
    Request,
    Response,
    Verdict,
)
from sphero_probe.protocol.v2 import V2
from tests.support.line import Line, Robot, after, answer_to, clock, never
from tests.support.narrowing import every, known
from tests.support.virtual_clock import run

BATTERY, VOLTAGE = Command(0x13, 0x10), Command(0x13, 0x03)
SLEEP = Command(0x13, 0x01)
AWAKE = Notification(0x13, 0x11, b"", 1, None, 0xFF, 0x28)
EVERYTHING = Consent(frozenset(Risk), "BP-1234")


@asynccontextmanager
async def linked(
    robot: Robot,
    consent: Consent = EVERYTHING,
    line: Line | None = None,
    on_unsolicited: Callable[[Unsolicited], object] | None = None,
    **options: Any,
) -> AsyncIterator[tuple[Link, Line]]:
    """A link to a robot, and its line."""
    line = line or Line(robot)
    policy = Policy(Generation.V2, None, consent, ("BP-1234",))
    if on_unsolicited:
        options["events"] = Events()
        options["events"].subscribe(lambda event: on_unsolicited(event.unsolicited), UnsolicitedReceived)
    async with Link(line, V2, policy, **options) as link:
        yield link, line


async def silence_of(asking: Coroutine[Any, Any, Exchange]) -> Silent:
    """Wait for the end of a command that must not be answered."""
    exchange = await asking
    assert isinstance(exchange, Silent)
    return exchange


async def ask_all(link: Link, commands: list[Command], **options: Any) -> list[Exchange]:
    return await asyncio.gather(*[link.ask(command, **options) for command in commands])


def test_an_answer() -> None:
    async def scenario() -> None:
        async with linked(after(0.25)) as (link, line):
            exchange = await link.ask(BATTERY)
            ((_, request),) = line.requests
            response = Response(0, 0x00, b"", 0x13, 0x10, flags=0x09)
            sent, received = V2.encode_command(BATTERY, 0), answer_to(request)
            assert exchange == Answered(BATTERY, 0, sent, response, received, 0.25)
            assert link.frames_sent == 1

    run(scenario())


def test_an_answer_in_single_bytes() -> None:
    def robot(request: Request) -> list[tuple[float, bytes]]:
        return [(0.01 * place, bytes([byte])) for place, byte in enumerate(answer_to(request), 1)]

    async def scenario() -> None:
        async with linked(robot) as (link, _):
            exchanges = await ask_all(link, [BATTERY])
            assert [exchange.command for exchange in exchanges] == [BATTERY]
            assert isinstance(exchanges[0], Answered)
            assert exchanges[0].rtt == pytest.approx(0.08)

    run(scenario())


def test_an_answer_that_comes_before_writing_is_over() -> None:
    class Hasty(Line):
        async def write(self, data: bytes) -> None:
            await super().write(data)
            await asyncio.sleep(0.5)

    async def scenario() -> None:
        async with linked(never, line=Hasty(after(0.125))) as (link, _):
            exchange = await link.ask(BATTERY)
            assert isinstance(exchange, Answered)
            assert exchange.rtt == 0.125
            assert clock() == 0.5

    run(scenario())


@pytest.mark.parametrize("window", [1, 2, 4, 8, 100])
def test_the_window_is_used_and_respected(window: int) -> None:
    async def scenario() -> None:
        async with linked(after(0.25), window=window) as (link, line):
            exchanges = await ask_all(link, [BATTERY, VOLTAGE] * 20)
            assert [exchange.command for exchange in exchanges] == [BATTERY, VOLTAGE] * 20
            assert line.commands == [BATTERY, VOLTAGE] * 20
            assert line.most_unanswered == min(window, 40)
            assert clock() == 0.25 * -(-40 // window)
            assert link.frames_sent == 40

    run(scenario())


def test_the_window_grows_from_its_first_size_where_no_answer_is_missed() -> None:
    async def scenario() -> None:
        async with linked(after(0.25)) as (link, line):
            await ask_all(link, [BATTERY, VOLTAGE] * 150)
            at_once = list(Counter(when for when, _ in line.requests).values())
            assert at_once[0] == FIRST_WINDOW < at_once[1]
            assert at_once[:-1] == sorted(at_once[:-1])
            assert line.most_unanswered == at_once[-2] == WIDEST == link.pace(None).window

    run(scenario())


def test_a_limit_may_be_set_on_the_way() -> None:
    async def scenario() -> None:
        async with linked(after(0.25), window=4) as (link, line):
            asking = asyncio.gather(*[link.ask(BATTERY) for _ in range(12)])
            await asyncio.sleep(0.125)
            link.window.limit = 1
            await asyncio.sleep(0.25)
            line.most_unanswered = 0
            await asking
            assert line.most_unanswered == 1
            link.window.limit = 3
            await ask_all(link, [BATTERY] * 9)
            assert line.most_unanswered == 3
            link.window.limit = 100
            await ask_all(link, [BATTERY] * 9)
            assert line.most_unanswered == 4

    run(scenario())


def test_a_limit_holds_for_a_window_that_grows() -> None:
    async def scenario() -> None:
        async with linked(after(0.25)) as (link, line):
            link.window.limit = 3
            await ask_all(link, [BATTERY] * 40)
            assert line.most_unanswered == 3

    run(scenario())


def test_silent_commands_free_their_place() -> None:
    async def scenario() -> None:
        async with linked(never, window=2) as (link, line):
            exchanges = await ask_all(link, [BATTERY] * 6, timeout=0.5)
            assert all(isinstance(exchange, Silent) for exchange in exchanges)
            assert [when for when, _ in line.requests] == pytest.approx(
                [0.0, 0.0, 0.5, 0.5, 1.0, 1.0], abs=1e-5
            )

    run(scenario())


def overlaps(line: Line, command: Command, delay: float) -> int:
    """How many other requests were under way with one of this command, all answered after ``delay``."""
    return sum(
        abs(when - other_time) < delay
        for when, request in line.requests
        for other_time, other in line.requests
        if request.command == command and other is not request
    )


def test_asking_alone() -> None:
    async def scenario() -> None:
        async with linked(after(0.25), window=4) as (link, line):
            commands = [BATTERY, BATTERY, VOLTAGE, BATTERY, BATTERY, BATTERY, VOLTAGE, VOLTAGE]
            await asyncio.gather(*[link.ask(command, alone=command == VOLTAGE) for command in commands])
            assert line.commands.count(VOLTAGE) == 3
            assert overlaps(line, VOLTAGE, 0.25) == 0
            assert overlaps(line, BATTERY, 0.25) > 0

    run(scenario())


def test_a_silent_command_sent_alone_lets_the_next_one_in() -> None:
    async def scenario() -> None:
        async with linked(never, window=4) as (link, line):
            first = asyncio.create_task(link.ask(VOLTAGE, alone=True, timeout=0.5))
            second = asyncio.create_task(link.ask(BATTERY, timeout=0.5))
            assert isinstance(await first, Silent)
            assert isinstance(await second, Silent)
            assert [when for when, _ in line.requests] == pytest.approx([0.0, 0.5], abs=1e-5)

    run(scenario())


def test_a_command_to_be_sent_alone_is_not_overtaken_for_ever() -> None:
    delays = iter([0.25, 0.5, 0.75, 1.0] * 20)

    async def scenario() -> None:
        async with linked(lambda request: [(next(delays), answer_to(request))], timeout=5.0, window=4) as (
            link,
            line,
        ):
            before = [asyncio.create_task(link.ask(BATTERY)) for _ in range(4)]
            await asyncio.sleep(0.125)
            alone = asyncio.create_task(link.ask(VOLTAGE, alone=True))
            await asyncio.sleep(0)
            behind = [asyncio.create_task(link.ask(BATTERY)) for _ in range(40)]
            await alone
            assert line.commands.index(VOLTAGE) < 10
            await asyncio.gather(*before, *behind)

    run(scenario())


@pytest.mark.parametrize(
    ("command", "risk"),
    [
        pytest.param(Command(0x1A, 0x1C, bytes(7)), Risk.WRITE, id="write"),
        pytest.param(SLEEP, Risk.MOTION, id="motion"),
        pytest.param(Command(0x12, 0x11), Risk.PERSIST, id="persist"),
        pytest.param(Command(0x1D, 0x05), Risk.BRICK, id="brick"),
    ],
)
def test_classes_above_probe_are_sent_alone(command: Command, risk: Risk) -> None:
    async def scenario() -> None:
        async with linked(after(0.25), window=4) as (link, line):
            assert link.policy.assess(command).risk is risk
            await ask_all(link, [BATTERY, BATTERY, command, BATTERY, BATTERY, command, command])
            assert line.commands.count(command) == 3
            assert overlaps(line, command, 0.25) == 0
            assert overlaps(line, BATTERY, 0.25) > 0

    run(scenario())


def test_reads_and_probes_share_the_window() -> None:
    probe = Command(0x50, 0x01, bytes(11), 0x11)

    async def scenario() -> None:
        async with linked(after(0.25), window=4) as (link, line):
            link.policy.length_checks.trust(0x11)
            assert link.policy.assess(probe).risk is Risk.PROBE
            await ask_all(link, [BATTERY._replace(target=0x11), probe] * 4)
            assert line.most_unanswered == 4

    run(scenario())


def test_a_blocked_command_is_not_sent() -> None:
    async def scenario() -> None:
        async with linked(after(0.25), consent=Consent()) as (link, line):
            for command, risk in ((SLEEP, Risk.MOTION), (Command(0x1D, 0x05), Risk.BRICK)):
                refused = await link.ask(command)
                assert refused == Blocked(command, risk, known(link.policy.why_blocked(command)))
                assert f"--allow {risk.word}" in refused.reason
            assert (line.requests, link.frames_sent, clock()) == ([], 0, 0.0)
            assert isinstance(await link.ask(BATTERY), Answered)

    run(scenario())


def test_a_blocked_command_does_not_wait_for_a_place() -> None:
    async def scenario() -> None:
        async with linked(after(0.5), consent=Consent(), window=1, timeout=5.0) as (link, _):
            busy = asyncio.create_task(link.ask(BATTERY))
            await asyncio.sleep(0.25)
            assert isinstance(await link.ask(SLEEP), Blocked)
            assert clock() == 0.25
            await busy

    run(scenario())


@pytest.mark.parametrize(
    ("of_link", "of_ask", "waited"),
    [
        pytest.param({}, {}, FIRST_TIMEOUT, id="default"),
        pytest.param({"timeout": 0.25}, {}, 0.25, id="the link's"),
        pytest.param({}, {"timeout": 3.0}, 3.0, id="the command's"),
        pytest.param({"timeout": 9.0}, {"timeout": 0.125}, 0.125, id="the command's before the link's"),
    ],
)
def test_silence(of_link: dict[str, Any], of_ask: dict[str, Any], waited: float) -> None:
    async def scenario() -> None:
        async with linked(never, **of_link) as (link, _):
            await asyncio.sleep(100.0)
            silent = await link.ask(BATTERY, **of_ask)
            assert isinstance(silent, Silent)
            assert silent == Silent(BATTERY, 0, V2.encode_command(BATTERY, 0), silent.waited)
            assert silent.waited == pytest.approx(waited, abs=1e-5)
            assert clock() == pytest.approx(100.0 + waited, abs=1e-5)

    run(scenario())


def test_each_command_has_its_own_deadline() -> None:
    async def scenario() -> None:
        async with linked(never, window=4) as (link, _):
            timeouts = [0.75, 0.25, 1.0, 0.5]
            exchanges = await asyncio.gather(*[link.ask(BATTERY, timeout=timeout) for timeout in timeouts])
            assert [exchange.waited for exchange in every(Silent, exchanges)] == pytest.approx(
                timeouts, abs=1e-5
            )
            assert clock() == pytest.approx(1.0, abs=1e-5)

    run(scenario())


def test_one_is_silent_while_others_are_answered() -> None:
    def robot(request: Request) -> list[tuple[float, bytes]]:
        return [] if request.command == VOLTAGE else after(0.125)(request)

    async def scenario() -> None:
        async with linked(robot, window=4) as (link, _):
            exchanges = await ask_all(link, [BATTERY, VOLTAGE, BATTERY, VOLTAGE, BATTERY])
            kinds = [type(exchange) for exchange in exchanges]
            assert kinds == [Answered, Silent, Answered, Silent, Answered]

    run(scenario())


QUICK, SLOW = 0.02, 0.4
"""Seconds: a robot over USB or a fast BLE link, and one over a slow one."""


async def warm_up(link: Link, target: int | None = None, times: int = 40) -> None:
    """Ask a node until its pace is known and its window wide."""
    await ask_all(link, [BATTERY._replace(target=target)] * times)


@pytest.mark.parametrize("round_trip", [QUICK, SLOW])
def test_a_link_learns_how_long_to_wait(round_trip: float) -> None:
    async def scenario() -> None:
        async with linked(after(round_trip)) as (link, line):
            exchanges = await ask_all(link, [BATTERY] * 40)
            assert all(isinstance(exchange, Answered) for exchange in exchanges)
            assert link.pace(None).round_trip == pytest.approx(round_trip)
            line.robot = never
            waited = (await silence_of(link.ask(BATTERY))).waited
            assert max(SHORTEST_TIMEOUT, round_trip) <= waited <= max(SHORTEST_TIMEOUT, 2 * round_trip) + 0.1

    run(scenario())


def test_a_robot_that_gets_slower_is_waited_for_again() -> None:
    async def scenario() -> None:
        async with linked(after(QUICK)) as (link, line):
            await warm_up(link)
            line.robot = after(SLOW)
            kinds = []
            for _ in range(20):
                kinds.append(type(await link.ask(BATTERY)))
                await asyncio.sleep(0.125)
            assert kinds == sorted(kinds, key=lambda kind: kind is Answered)
            assert 0 < kinds.count(Silent) <= 4
            assert link.pace(None).timeout > SLOW

    run(scenario())


def test_a_silent_robot_is_waited_for_longer_but_not_for_ever() -> None:
    async def scenario() -> None:
        async with linked(never) as (link, _):
            waits = []
            for _ in range(8):
                waits.append((await silence_of(link.ask(BATTERY))).waited)
                await asyncio.sleep(0.125)
            assert waits[0] == pytest.approx(FIRST_TIMEOUT, abs=1e-5)
            assert waits[1] == pytest.approx(min(LONGEST_BACKOFF, FIRST_TIMEOUT * BACKOFF), abs=1e-5)
            assert waits == pytest.approx(sorted(waits), abs=1e-5)
            assert waits[-1] == pytest.approx(LONGEST_BACKOFF, abs=1e-5)

    run(scenario())


def test_a_timeout_that_was_given_stays() -> None:
    async def scenario() -> None:
        async with linked(after(QUICK), timeout=2.0) as (link, line):
            await warm_up(link)
            line.robot = never
            for _ in range(3):
                assert (await silence_of(link.ask(BATTERY))).waited == pytest.approx(2.0, abs=1e-5)
            line.robot = after(1.5)
            assert isinstance(await link.ask(BATTERY), Answered)

    run(scenario())


def test_each_node_has_its_own_pace() -> None:
    near, far, gone = (BATTERY._replace(target=target) for target in (0x11, 0x12, 0x13))
    delays = {near: QUICK, far: SLOW}

    def robot(request: Request) -> list[tuple[float, bytes]]:
        command = request.command
        return [(delays[command], answer_to(request))] if command in delays else []

    async def scenario() -> None:
        async with linked(robot) as (link, _):
            for command in (near, far, gone):
                await ask_all(link, [command] * 20)
            paces = [link.pace(command.target) for command in (near, far, gone)]
            assert [pace.round_trip for pace in paces] == [pytest.approx(QUICK), pytest.approx(SLOW), None]
            assert paces[0].timeout < SLOW < paces[1].timeout < paces[2].timeout == LONGEST_BACKOFF
            assert [pace.window > FIRST_WINDOW for pace in paces] == [True, True, False]
            assert len({id(pace) for pace in (*paces, link.pace(None))}) == 4
            assert link.pace(0x11) is paces[0]

    run(scenario())


def only_battery(request: Request) -> list[tuple[float, bytes]]:
    """A robot that answers one command quickly and never any other."""
    return after(QUICK)(request) if request.command == BATTERY else []


def test_silent_commands_among_answered_ones_do_not_stall_the_line() -> None:
    async def scenario() -> None:
        async with linked(only_battery) as (link, _):
            await warm_up(link)
            timeout, began = link.pace(None).timeout, clock()
            exchanges = await ask_all(link, [VOLTAGE, BATTERY] * 40)
            assert [type(exchange) for exchange in exchanges] == [Silent, Answered] * 40
            assert max(exchange.waited for exchange in every(Silent, exchanges[::2])) < timeout
            assert clock() - began < 40 * timeout / WIDEST
            assert link.pace(None).timeout == pytest.approx(timeout, rel=0.2)
            assert link.pace(None).in_flight == 0

    run(scenario())


def test_an_overtaken_command_is_silent_after_the_grace() -> None:
    async def scenario() -> None:
        async with linked(only_battery, window=2) as (link, _):
            await warm_up(link)
            began = clock()
            silent, answered = await ask_all(link, [VOLTAGE, BATTERY])
            assert isinstance(answered, Answered)
            assert answered.rtt == pytest.approx(QUICK)
            assert isinstance(silent, Silent)
            assert QUICK + GRACE <= silent.waited + 1e-9 < SHORTEST_TIMEOUT
            assert clock() - began == pytest.approx(silent.waited, abs=1e-5)

    run(scenario())


def test_an_overtaken_command_may_be_answered_within_the_grace() -> None:
    def robot(request: Request) -> list[tuple[float, bytes]]:
        return after(QUICK + (GRACE / 2 if request.command == VOLTAGE else 0.0))(request)

    async def scenario() -> None:
        async with linked(robot, window=2) as (link, _):
            await warm_up(link)
            exchanges = await ask_all(link, [VOLTAGE, BATTERY])
            assert [type(exchange) for exchange in exchanges] == [Answered, Answered]

    run(scenario())


def test_an_answer_that_comes_after_the_grace_finds_its_silence() -> None:
    def robot(request: Request) -> list[tuple[float, bytes]]:
        return after(1.0 if request.command == VOLTAGE else QUICK)(request)

    async def scenario() -> None:
        heard: list[Unsolicited] = []
        async with linked(robot, window=2, on_unsolicited=heard.append) as (link, _):
            await warm_up(link)
            silent, _ = await ask_all(link, [VOLTAGE, BATTERY])
            assert isinstance(silent, Silent)
            await asyncio.sleep(2.0)
            assert [late.earlier for late in every(LateResponse, heard)] == [silent]

    run(scenario())


def test_only_the_own_node_overtakes() -> None:
    slow, quick = BATTERY._replace(target=0x12), BATTERY._replace(target=0x11)

    def robot(request: Request) -> list[tuple[float, bytes]]:
        return after(SLOW if request.command == slow else QUICK)(request)

    async def scenario() -> None:
        async with linked(robot) as (link, _):
            exchanges = await ask_all(link, [slow, *[quick] * 10])
            assert all(isinstance(exchange, Answered) for exchange in exchanges)
            assert isinstance(exchanges[0], Answered)
            assert exchanges[0].rtt == pytest.approx(SLOW)

    run(scenario())


def test_a_timeout_that_was_asked_for_is_not_cut_short() -> None:
    def robot(request: Request) -> list[tuple[float, bytes]]:
        return after(2.0 if request.command == VOLTAGE else QUICK)(request)

    async def scenario() -> None:
        async with linked(robot) as (link, _):
            await warm_up(link)
            patient, quick = await asyncio.gather(link.ask(VOLTAGE, timeout=3.0), link.ask(BATTERY))
            assert isinstance(quick, Answered)
            assert isinstance(patient, Answered)
            assert patient.rtt == pytest.approx(2.0)

    run(scenario())


def test_a_link_with_a_timeout_cuts_no_command_short() -> None:
    async def scenario() -> None:
        async with linked(only_battery, timeout=0.5, window=4) as (link, _):
            exchanges = await ask_all(link, [VOLTAGE, BATTERY] * 4)
            assert [type(exchange) for exchange in exchanges] == [Silent, Answered] * 4
            assert {round(exchange.waited, 4) for exchange in every(Silent, exchanges[::2])} == {0.5}

    run(scenario())


@pytest.mark.parametrize(
    ("expected", "left"),
    [pytest.param(True, WIDEST // 2, id="halves"), pytest.param(False, WIDEST, id="does not")],
)
def test_a_silence_halves_the_window_if_an_answer_was_sure_to_come(expected: bool, left: int) -> None:
    async def scenario() -> None:
        async with linked(only_battery) as (link, line):
            await warm_up(link, times=300)
            assert link.pace(None).window == WIDEST
            assert isinstance(await link.ask(VOLTAGE, expected=expected), Silent)
            assert link.pace(None).window == left
            line.unanswered = line.most_unanswered = 0
            await ask_all(link, [BATTERY] * left)
            assert line.most_unanswered == left

    run(scenario())


def test_a_busy_robot_is_asked_less_at_a_time() -> None:
    def busy(request: Request) -> list[tuple[float, bytes]]:
        command = request.command
        return [(QUICK, V2.encode_response(Response(request.seq, 0x08, b"", command.did, command.cid)))]

    async def scenario() -> None:
        async with linked(after(QUICK)) as (link, line):
            await warm_up(link, times=300)
            assert link.pace(None).window == WIDEST
            line.robot = busy
            answered = await link.ask(BATTERY)
            assert isinstance(answered, Answered)
            assert V2.verdict(answered.response.code) is Verdict.BUSY
            assert link.pace(None).window == WIDEST // 2

    run(scenario())


@pytest.mark.parametrize(
    ("round_trip", "of_link", "of_ask", "waited"),
    [
        pytest.param(QUICK, {}, {}, FIRST_TIMEOUT, id="a quick robot"),
        pytest.param(2.0, {"window": 1}, {}, 4.0, id="a slow robot"),
        pytest.param(QUICK, {"timeout": 0.25}, {}, 0.25, id="the link's"),
        pytest.param(QUICK, {}, {"timeout": 0.125}, 0.125, id="the command's"),
    ],
)
def test_classes_above_probe_get_a_long_timeout(
    round_trip: float, of_link: dict[str, Any], of_ask: dict[str, Any], waited: float
) -> None:
    async def scenario() -> None:
        async with linked(after(round_trip), **of_link) as (link, line):
            for _ in range(5):
                await link.ask(BATTERY, timeout=5.0)
            line.robot = never
            assert (await silence_of(link.ask(SLEEP, **of_ask))).waited == pytest.approx(waited, abs=1e-5)

    run(scenario())


def test_classes_above_probe_wait_for_everything_in_flight() -> None:
    """For overtaken commands and those of other nodes, too, though they take no place in its window."""
    other = BATTERY._replace(target=0x12)

    def robot(request: Request) -> list[tuple[float, bytes]]:
        return after(0.5)(request) if request.command == other else only_battery(request)

    async def scenario() -> None:
        async with linked(robot) as (link, line):
            await warm_up(link)
            asking = [asyncio.create_task(link.ask(command)) for command in (VOLTAGE, BATTERY, other)]
            await asyncio.sleep(0)
            began = clock()
            sleep = asyncio.create_task(link.ask(SLEEP, timeout=0.25))
            behind = asyncio.create_task(link.ask(BATTERY))
            await asyncio.gather(*asking, sleep, behind)
            after_other, after_sleep = (when - began for when, _ in line.requests[-2:])
            assert line.commands[-5:] == [VOLTAGE, BATTERY, other, SLEEP, BATTERY]
            assert (after_other, after_sleep) == pytest.approx((0.5, 0.75), abs=1e-4)

    run(scenario())


def test_before_sending_is_called_right_before_the_frame_is_sent() -> None:
    async def scenario() -> None:
        async with linked(after(0.25), window=2) as (link, line):
            told = []

            def tell() -> None:
                told.append((clock(), len(line.requests), link.frames_sent))

            commands = [BATTERY, VOLTAGE, SLEEP, BATTERY, VOLTAGE]
            await ask_all(link, commands, before_sending=tell)
            assert told == [(when, place, place) for place, (when, _) in enumerate(line.requests)]
            assert len(told) == 5

    run(scenario())


@pytest.mark.parametrize(
    "command",
    [pytest.param(SLEEP, id="refused"), pytest.param(BATTERY._replace(target=0x100), id="impossible")],
)
def test_before_sending_is_not_called_for_what_is_not_sent(command: Command) -> None:
    async def scenario() -> None:
        async with linked(after(0.25), consent=Consent()) as (link, _):
            with suppress(ValueError):
                assert isinstance(await link.ask(command, before_sending=pytest.fail), Blocked)
            assert link.frames_sent == 0

    run(scenario())


@pytest.mark.parametrize("alone", [True, False])
def test_an_error_in_before_sending_sends_nothing(alone: bool) -> None:
    def stop() -> None:
        raise ZeroDivisionError("not now")

    async def scenario() -> None:
        async with linked(after(0.25), window=1) as (link, line):
            for _ in range(5):
                with pytest.raises(ZeroDivisionError, match="not now"):
                    await link.ask(BATTERY, alone=alone, before_sending=stop)
            assert (line.requests, link.frames_sent, clock()) == ([], 0, 0.0)
            assert (link.room(None), link.pace(None).in_flight) == (1, 0)
            assert isinstance(await link.ask(BATTERY), Answered)
            timeout = link.pace(None).timeout
            await asyncio.sleep(3 * LONGEST_TIMEOUT)
            assert link.pace(None).timeout == timeout
            assert len(line.requests) == link.frames_sent == 1

    run(scenario())


def test_room() -> None:
    async def scenario() -> None:
        async with linked(after(0.25), window=4) as (link, _):
            rooms = [link.room(None)]
            asking = []
            for _ in range(6):
                asking.append(asyncio.create_task(link.ask(BATTERY)))
                await asyncio.sleep(0)
                rooms.append(link.room(None))
            assert rooms == [4, 3, 2, 1, 0, 0, 0]
            await asyncio.sleep(0.375)
            assert link.room(None) == 2
            link.window.limit = 3
            assert link.room(None) == 1
            link.window.limit = 1
            assert link.room(None) == 0
            await asyncio.gather(*asking)
            assert link.room(None) == 1

    run(scenario())


def test_each_node_has_its_own_room_while_the_queue_is_empty() -> None:
    def at(target: int) -> asyncio.Task[Exchange]:
        return asyncio.create_task(link_of[0].ask(BATTERY._replace(target=target)))

    link_of = []

    async def scenario() -> None:
        async with linked(after(0.25), window=2) as (link, _):
            link_of.append(link)
            asking = [at(0x11), at(0x11), at(0x12)]
            await asyncio.sleep(0)
            assert [link.room(target) for target in (0x11, 0x12, 0x13)] == [0, 1, 2]
            asking.append(at(0x11))
            await asyncio.sleep(0)
            assert [link.room(target) for target in (0x11, 0x12, 0x13)] == [0, 0, 0]
            await asyncio.gather(*asking)
            assert [link.room(target) for target in (0x11, 0x12, 0x13)] == [2, 2, 2]
            alone = asyncio.create_task(link.ask(BATTERY, alone=True))
            await asyncio.sleep(0)
            assert link.room(0x13) == 0
            await alone
            assert link.room(0x13) == 2

    run(scenario())


def test_as_many_as_there_is_room_for_are_sent_at_once() -> None:
    async def scenario() -> None:
        async with linked(after(0.25)) as (link, line):
            rooms: list[int] = []
            while not rooms or rooms[-1] < WIDEST:
                rooms.append(link.room(None))
                before, began = len(line.requests), clock()
                asking = [asyncio.create_task(link.ask(BATTERY)) for _ in range(rooms[-1] + 1)]
                await asyncio.sleep(0.125)
                assert len(line.requests) == before + rooms[-1]
                assert {when for when, _ in line.requests[before:]} == {began}
                await asyncio.gather(*asking)
            assert rooms[0] == FIRST_WINDOW

    run(scenario())


def say_nothing_more(line: Line) -> None:
    line.say(b"")


def break_the_line(line: Line) -> None:
    line.say(LinkLostError("torn off"))


@pytest.mark.parametrize(
    ("happens", "reason"),
    [
        pytest.param(say_nothing_more, "closed the connection", id="the robot closes"),
        pytest.param(break_the_line, "torn off", id="reading fails"),
    ],
)
def test_a_lost_link_ends_every_waiting_call(happens: Callable[[Line], None], reason: str) -> None:
    async def scenario() -> None:
        async with linked(never, window=2) as (link, line):
            asking = [asyncio.create_task(link.ask(BATTERY)) for _ in range(5)]
            asking += [
                asyncio.create_task(link.ask(VOLTAGE, alone=True)),
                asyncio.create_task(link.ask(SLEEP)),
            ]
            await asyncio.sleep(0.25)
            happens(line)
            ends = await asyncio.gather(*asking, return_exceptions=True)
            assert [type(end) for end in ends] == [LinkLostError] * 7
            assert all(reason in str(end) for end in ends)
            assert clock() == 0.25
            with pytest.raises(LinkLostError, match=reason):
                await link.ask(BATTERY)
            assert len(line.requests) == link.frames_sent == 2

    run(scenario())


class Broken(Line):
    """A line on which writing fails from the second time on."""

    async def write(self, data: bytes) -> None:
        if self.requests:
            raise LinkLostError("cannot write")
        await super().write(data)


def test_a_link_lost_in_writing_ends_every_waiting_call() -> None:
    async def scenario() -> None:
        async with linked(never, line=Broken(never), window=4) as (link, _):
            asking = [asyncio.create_task(link.ask(BATTERY)) for _ in range(6)]
            ends = await asyncio.gather(*asking, return_exceptions=True)
            assert [type(end) for end in ends] == [LinkLostError] * 6
            assert {str(end) for end in ends} == {"cannot write"}
            assert clock() == 0.0

    run(scenario())


class Stuck(Line):
    """A line that takes no bytes until the robot is gone."""

    async def write(self, data: bytes) -> None:
        await asyncio.sleep(0.5)
        raise LinkLostError("cannot write")


def test_a_link_lost_while_writing_is_stuck() -> None:
    async def scenario() -> None:
        async with linked(never, line=Stuck(never), window=2) as (link, line):
            asking = [asyncio.create_task(link.ask(BATTERY)) for _ in range(3)]
            await asyncio.sleep(0.25)
            line.say(b"")
            ends = await asyncio.gather(*asking, return_exceptions=True)
            assert [type(end) for end in ends] == [LinkLostError] * 3

    run(scenario())


def test_leaving_ends_what_still_waits() -> None:
    async def scenario() -> None:
        async with linked(never, window=2) as (link, _):
            asking = [asyncio.create_task(link.ask(BATTERY)) for _ in range(4)]
            await asyncio.sleep(0.25)
        ends = await asyncio.gather(*asking, return_exceptions=True)
        assert [type(end) for end in ends] == [LinkLostError] * 4
        assert {str(end) for end in ends} == {"the link was closed"}
        assert clock() == 0.25
        with pytest.raises(LinkLostError):
            await link.ask(BATTERY)

    run(scenario())


def test_leaving_in_the_middle_of_trouble() -> None:
    asking = []

    async def trouble() -> None:
        async with linked(never) as (link, _):
            asking.append(asyncio.create_task(link.ask(BATTERY)))
            await asyncio.sleep(0.25)
            raise ZeroDivisionError

    async def scenario() -> None:
        with pytest.raises(ZeroDivisionError):
            await trouble()
        with pytest.raises(LinkLostError):
            await asking[0]

    run(scenario())


@pytest.mark.parametrize(
    ("happens", "reason"),
    [
        pytest.param(say_nothing_more, "closed the connection", id="the robot closes"),
        pytest.param(break_the_line, "torn off", id="reading fails"),
    ],
)
def test_waiting_for_the_end(happens: Callable[[Line], None], reason: str) -> None:
    async def scenario() -> None:
        async with linked(after(0.25)) as (link, line):
            hasty, patient = asyncio.create_task(link.closed()), asyncio.create_task(link.closed())
            await asyncio.sleep(0.25)
            await cancel(hasty)
            assert isinstance(await link.ask(BATTERY), Answered)
            happens(line)
            with pytest.raises(LinkLostError, match=reason):
                await patient
            with pytest.raises(LinkLostError, match=reason):
                await link.closed()
            assert clock() == 0.5

    run(scenario())


def test_waiting_for_the_end_of_a_link_that_is_left() -> None:
    async def scenario() -> None:
        async with linked(after(0.25)) as (link, _):
            patient = asyncio.create_task(link.closed())
            await asyncio.sleep(0.25)
        with pytest.raises(LinkLostError):
            await patient
        with pytest.raises(LinkLostError, match="closed"):
            await link.closed()

    run(scenario())


def test_a_link_that_was_never_open_has_ended() -> None:
    async def scenario() -> None:
        link = Link(Line(never), V2, Policy(Generation.V2, None, Consent()))
        with pytest.raises(LinkLostError):
            await link.closed()

    run(scenario())


def test_a_link_that_was_lost_is_left_quietly() -> None:
    async def scenario() -> None:
        async with linked(never) as (_, line):
            line.say(b"")
            await asyncio.sleep(0.25)

    run(scenario())


def test_unsolicited_packets_reach_every_listener() -> None:
    spoilt = Malformed(bytes.fromhex("8d09130d0000d7d8"), "checksum 0xd7, expected 0xd6")

    def robot(request: Request) -> list[tuple[float, bytes]]:
        said = answer_to(request)
        return [(0.125, V2.frame_of(AWAKE) + spoilt.raw + said), (0.25, said)]

    async def scenario() -> None:
        heard: list[Unsolicited] = []
        async with linked(robot, on_unsolicited=heard.append) as (link, _):
            answered = await link.ask(BATTERY)
            assert heard == [AWAKE, spoilt]
            await asyncio.sleep(0.25)
            assert isinstance(answered, Answered)
            (late,) = heard[2:]
            assert isinstance(late, LateResponse)
            assert late == LateResponse(answered.response, answered.received, answered, late.took)

    run(scenario())


def test_a_late_answer_is_unsolicited() -> None:
    async def scenario() -> None:
        heard: list[Unsolicited] = []
        async with linked(after(0.75), timeout=0.5, on_unsolicited=heard.append) as (link, _):
            silent = await link.ask(BATTERY)
            assert isinstance(silent, Silent)
            again = await link.ask(BATTERY, timeout=2.0)
            assert isinstance(again, Answered)
            assert again.rtt == pytest.approx(0.75, abs=1e-5)
            (late,) = heard
            assert isinstance(late, LateResponse)
            assert late.earlier == silent

    run(scenario())


def test_an_incomplete_frame_is_given_up_with_the_command_it_blocks() -> None:
    def robot(request: Request) -> list[tuple[float, bytes]]:
        return [(0.5 - 2 * QUIET / 3, answer_to(request)[:-1])] if request.seq == 0 else after(0.125)(request)

    async def scenario() -> None:
        heard: list[Unsolicited] = []
        async with linked(robot, timeout=0.5 + QUIET, on_unsolicited=heard.append) as (link, _):
            assert isinstance(await link.ask(BATTERY), Silent)
            (half,) = heard
            assert isinstance(half, Malformed)
            assert isinstance(await link.ask(BATTERY), Answered)

    run(scenario())


def test_the_next_command_waits_while_no_sequence_number_may_be_reused() -> None:
    async def scenario() -> None:
        async with linked(never, window=255) as (link, line):
            await ask_all(link, [BATTERY] * 255, timeout=0.5)
            assert sorted(line.seqs) == list(range(255))
            line.robot = after(0.125)
            exchange = await link.ask(BATTERY)
            assert isinstance(exchange, Answered)
            assert line.requests[-1][0] == pytest.approx(0.5 + REUSE_AFTER_SILENCE, abs=1e-4)
            assert exchange.rtt == 0.125

    run(scenario())


def test_another_command_need_not_wait_for_a_sequence_number() -> None:
    async def scenario() -> None:
        async with linked(never, window=255) as (link, line):
            await ask_all(link, [BATTERY] * 255, timeout=0.5)
            line.robot = after(0.125)
            resting = asyncio.create_task(link.ask(BATTERY))
            await asyncio.sleep(0.25)
            resting.cancel()
            assert isinstance(await link.ask(VOLTAGE), Answered)
            assert clock() == pytest.approx(0.5 + 0.25 + 0.125, abs=1e-4)
            assert line.commands.count(VOLTAGE) == 1

    run(scenario())


def test_each_command_that_waits_for_a_number_gets_one() -> None:
    async def scenario() -> None:
        async with linked(never, window=255) as (link, line):
            await ask_all(link, [BATTERY] * 255, timeout=0.5)
            line.robot = after(0.125)
            exchanges = await ask_all(link, [BATTERY] * 300)
            assert all(isinstance(exchange, Answered) for exchange in exchanges)
            assert len(line.requests) == 555
            assert all(when >= 0.5 + REUSE_AFTER_SILENCE - 1e-4 for when, _ in line.requests[255:])

    run(scenario())


def test_more_commands_than_sequence_numbers() -> None:
    async def scenario() -> None:
        async with linked(after(0.125), window=1000) as (link, line):
            exchanges = await ask_all(link, [BATTERY] * 600)
            assert all(isinstance(exchange, Answered) for exchange in exchanges)
            assert line.most_unanswered == 255

    run(scenario())


def test_losing_the_link_while_waiting_for_a_number() -> None:
    async def scenario() -> None:
        async with linked(never, window=255) as (link, line):
            await ask_all(link, [BATTERY] * 255, timeout=0.5)
            asking = asyncio.create_task(link.ask(BATTERY))
            await asyncio.sleep(0.25)
            line.say(b"")
            with pytest.raises(LinkLostError):
                await asking
            assert clock() == pytest.approx(0.75, abs=1e-4)
            assert len(line.requests) == 255

    run(scenario())


async def cancel(task: asyncio.Task[Any]) -> None:
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task
    assert task.cancelled()


def test_giving_up_waiting_for_an_answer() -> None:
    async def scenario() -> None:
        heard: list[Unsolicited] = []
        async with linked(after(0.5), window=2, on_unsolicited=heard.append, timeout=5.0) as (link, line):
            hasty = asyncio.create_task(link.ask(BATTERY))
            await asyncio.sleep(0.25)
            await cancel(hasty)
            exchanges = await ask_all(link, [BATTERY] * 4)
            assert [exchange.rtt for exchange in every(Answered, exchanges)] == [0.5] * 4
            assert line.seqs == [0, 1, 2, 3, 4]
            assert clock() == 0.25 + 2 * 0.5

    run(scenario())


def test_giving_up_waiting_for_a_place() -> None:
    async def scenario() -> None:
        async with linked(after(0.5), window=1, timeout=5.0) as (link, line):
            first = asyncio.create_task(link.ask(BATTERY))
            others = [asyncio.create_task(link.ask(VOLTAGE)) for _ in range(3)]
            alone = asyncio.create_task(link.ask(VOLTAGE, alone=True))
            await asyncio.sleep(0.25)
            for task in (*others, alone):
                await cancel(task)
            assert isinstance(await first, Answered)
            assert isinstance(await link.ask(BATTERY), Answered)
            assert line.commands == [BATTERY, BATTERY]
            assert clock() == 1.0

    run(scenario())


def test_giving_up_being_the_next_alone_lets_the_others_go() -> None:
    async def scenario() -> None:
        async with linked(after(1.0), window=3, timeout=5.0) as (link, line):
            first = asyncio.create_task(link.ask(BATTERY))
            alone = asyncio.create_task(link.ask(VOLTAGE, alone=True))
            await asyncio.sleep(0)
            behind = [asyncio.create_task(link.ask(BATTERY)) for _ in range(3)]
            await asyncio.sleep(0.25)
            await cancel(alone)
            await asyncio.gather(first, *behind)
            assert line.commands == [BATTERY] * 4
            assert [when for when, _ in line.requests] == [0.0, 0.25, 0.25, 1.0]

    run(scenario())


def test_giving_up_being_alone() -> None:
    async def scenario() -> None:
        async with linked(after(0.5), window=3, timeout=5.0) as (link, line):
            alone = asyncio.create_task(link.ask(SLEEP))
            await asyncio.sleep(0.25)
            await cancel(alone)
            await asyncio.sleep(1.0)
            line.most_unanswered = 0
            await ask_all(link, [BATTERY] * 6)
            assert line.most_unanswered == 3

    run(scenario())


def test_giving_up_waiting_for_a_number() -> None:
    async def scenario() -> None:
        async with linked(never, window=255) as (link, line):
            await ask_all(link, [BATTERY] * 255, timeout=0.5)
            hasty = asyncio.create_task(link.ask(BATTERY))
            await asyncio.sleep(0.25)
            await cancel(hasty)
            await asyncio.sleep(REUSE_AFTER_SILENCE)
            line.robot = after(0.125)
            assert isinstance(await link.ask(BATTERY, alone=True), Answered)
            assert len(line.requests) == 256

    run(scenario())


def test_giving_up_at_any_moment_leaks_no_place() -> None:
    async def scenario() -> None:
        line = Line(after(0.25))
        async with linked(never, line=line, window=2) as (link, _):
            for moment in range(12):
                asking = [asyncio.create_task(link.ask(BATTERY, alone=place == 2)) for place in range(4)]
                await asyncio.sleep(0.0625 * moment)
                for task in asking:
                    task.cancel()
                await asyncio.gather(*asking, return_exceptions=True)
                await asyncio.sleep(1.0)
            line.most_unanswered = 0
            began = clock()
            exchanges = await ask_all(link, [BATTERY] * 10)
            assert all(isinstance(exchange, Answered) for exchange in exchanges)
            assert (line.most_unanswered, clock() - began) == (2, 5 * 0.25)

    run(scenario())


def test_giving_up_at_any_moment_leaks_no_place_of_a_window_that_grows() -> None:
    async def scenario() -> None:
        line = Line(only_battery)
        async with linked(never, line=line) as (link, _):
            await warm_up(link)
            for moment in range(24):
                asking = [
                    asyncio.create_task(link.ask(command, alone=command == SLEEP))
                    for command in (BATTERY, VOLTAGE, BATTERY, SLEEP, BATTERY, VOLTAGE)
                ]
                await asyncio.sleep(QUICK * moment / 8)
                for task in asking:
                    task.cancel()
                await asyncio.gather(*asking, return_exceptions=True)
                pace = link.pace(None)
                assert pace.in_flight == 0
                assert link.room(None) == pace.window
            await asyncio.sleep(2 * LONGEST_BACKOFF)
            room = link.room(None)
            line.unanswered = line.most_unanswered = 0
            assert all(isinstance(exchange, Answered) for exchange in await ask_all(link, [BATTERY] * room))
            assert line.most_unanswered == room > 1

    run(scenario())


@pytest.mark.parametrize("steps", range(10))
@pytest.mark.parametrize("number", [0, 1, 2])
def test_giving_up_just_as_the_answer_comes(steps: int, number: int) -> None:
    async def scenario() -> None:
        async with linked(after(0.5), window=1, timeout=5.0) as (link, line):
            asking = [asyncio.create_task(link.ask(BATTERY)) for _ in range(3)]
            await asyncio.sleep(0.5)
            for _ in range(steps):
                await asyncio.sleep(0)
            asking[number].cancel()
            await asyncio.gather(*asking, return_exceptions=True)
            left = [task for task in asking if not task.cancelled()]
            assert all(isinstance(task.result(), Answered) for task in left)
            assert len(left) >= 2
            await asyncio.sleep(1.0)
            line.most_unanswered = 0
            began = clock()
            await ask_all(link, [BATTERY] * 3)
            assert (line.most_unanswered, clock() - began) == (1, 1.5)

    run(scenario())


def test_the_number_of_a_cancelled_command_is_not_reused_while_its_answer_may_arrive() -> None:
    async def scenario() -> None:
        heard: list[Unsolicited] = []
        async with linked(after(0.5), on_unsolicited=heard.append, window=4, timeout=5.0) as (link, line):
            hasty = asyncio.create_task(link.ask(BATTERY))
            await asyncio.sleep(0.25)
            await cancel(hasty)
            line.robot = after(0.0)
            exchanges = await ask_all(link, [BATTERY] * 300)
            assert all(isinstance(exchange, Answered) for exchange in exchanges)
            early = [request.seq for when, request in line.requests[1:] if when < 0.5]
            assert len(early) == 300
            assert 0 not in early
            await asyncio.sleep(1.0)
            assert heard == []

    run(scenario())


@pytest.mark.parametrize(
    "command",
    [
        pytest.param(Command(0x13, 0x10, bytes(5000)), id="payload"),
        pytest.param(Command(0x13, 0x10, b"", 0x100), id="target"),
    ],
)
def test_a_command_that_cannot_be_written_takes_no_place(command: Command) -> None:
    async def scenario() -> None:
        async with linked(after(0.25), window=1) as (link, line):
            for alone in (False, True):
                with pytest.raises(ValueError, match=r"at most|range\(0, 256\)"):
                    await link.ask(command, alone=alone)
            assert (line.requests, link.frames_sent) == ([], 0)
            assert isinstance(await link.ask(BATTERY), Answered)

    run(scenario())


def test_the_clock_notices_what_waits_for_ever() -> None:
    async def scenario() -> None:
        await asyncio.get_running_loop().create_future()

    with pytest.raises(RuntimeError, match="every task waits"):
        run(scenario())


def test_the_clock_notices_tasks_left_behind() -> None:
    kept: list[asyncio.Task[None]] = []

    async def scenario() -> None:
        kept.append(asyncio.create_task(asyncio.sleep(1.0)))

    with pytest.raises(AssertionError, match="left behind"):
        run(scenario())
