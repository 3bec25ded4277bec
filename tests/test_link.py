"""The conversation on a virtual clock: the window, going alone, silence, loss, and changes of mind."""

import asyncio
from contextlib import asynccontextmanager, suppress

import pytest
from virtual_clock import run

from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import LinkLostError
from sphero_probe.link.exchange import Answered, Late, Refused, Silent
from sphero_probe.link.guard import Consent, Guard
from sphero_probe.link.link import TIMEOUT, WINDOW, Link
from sphero_probe.link.tracker import QUIET, REST
from sphero_probe.protocol.packets import Command, Generation, Malformed, Notification, Response, Role
from sphero_probe.protocol.v2 import V2

BATTERY, VOLTAGE = Command(0x13, 0x10), Command(0x13, 0x03)
SLEEP = Command(0x13, 0x01)
AWAKE = Notification(0x13, 0x11, b"", 1, None, 0xFF, 0x28)
EVERYTHING = Consent(frozenset(Risk), "BP-1234")


def answer_to(request, payload=b""):
    """The frame of a plain "success"."""
    command = request.command
    return V2.encode_response(Response(request.seq, 0x00, payload, command.did, command.cid, flags=0x09))


def after(delay):
    """A robot that answers everything after this many seconds."""
    return lambda request: [(delay, answer_to(request))]


def never(_):
    """A robot that hears and says nothing."""
    return []


def clock():
    return asyncio.get_running_loop().time()


class Line:
    """A transport with a robot at its end: a request in, what it says and after how many seconds out.

    Attributes:
        requests: what was heard, each with its time.
        unanswered: requests that the robot has not said anything to yet.
        most_unanswered: the most there ever were.
    """

    def __init__(self, robot):
        self.robot = robot
        self.requests = []
        self.unanswered = 0
        self.most_unanswered = 0
        self._coming = asyncio.Queue()
        self._decoder = V2.decoder(Role.ROBOT)

    async def write(self, data):
        (request,) = self._decoder.feed(data)
        self.requests.append((clock(), request))
        self.unanswered += 1
        self.most_unanswered = max(self.most_unanswered, self.unanswered)
        for delay, said in self.robot(request):
            asyncio.get_running_loop().call_later(delay, self.say, said)

    async def read(self):
        said = await self._coming.get()
        if isinstance(said, Exception):
            raise said
        return said

    def say(self, said):
        """Let the link read this: bytes, ``b""`` for "the robot is gone", or an exception."""
        self.unanswered -= 1
        self._coming.put_nowait(said)

    @property
    def commands(self):
        return [request.command for _, request in self.requests]

    @property
    def seqs(self):
        return [request.seq for _, request in self.requests]


@asynccontextmanager
async def linked(robot, consent=EVERYTHING, line=None, **options):
    """A link to a robot, and its line."""
    line = line or Line(robot)
    guard = Guard(Generation.V2, None, consent, ("BP-1234",))
    async with Link(line, V2, guard, **options) as link:
        yield link, line


async def ask_all(link, commands, **options):
    return await asyncio.gather(*[link.ask(command, **options) for command in commands])


def test_an_answer():
    async def scenario():
        async with linked(after(0.25)) as (link, line):
            exchange = await link.ask(BATTERY)
            ((_, request),) = line.requests
            response = Response(0, 0x00, b"", 0x13, 0x10, flags=0x09)
            sent, received = V2.encode_command(BATTERY, 0), answer_to(request)
            assert exchange == Answered(BATTERY, 0, sent, response, received, 0.25)
            assert link.frames_sent == 1

    run(scenario())


def test_an_answer_in_single_bytes():
    def robot(request):
        return [(0.01 * place, bytes([byte])) for place, byte in enumerate(answer_to(request), 1)]

    async def scenario():
        async with linked(robot) as (link, _):
            exchanges = await ask_all(link, [BATTERY])
            assert [exchange.command for exchange in exchanges] == [BATTERY]
            assert exchanges[0].rtt == pytest.approx(0.08)

    run(scenario())


def test_an_answer_that_comes_before_writing_is_over():
    class Hasty(Line):
        async def write(self, data):
            await super().write(data)
            await asyncio.sleep(0.5)

    async def scenario():
        async with linked(None, line=Hasty(after(0.125))) as (link, _):
            exchange = await link.ask(BATTERY)
            assert exchange.rtt == 0.125
            assert clock() == 0.5

    run(scenario())


@pytest.mark.parametrize("window", [1, 2, 4, 8, 100])
def test_the_window_is_used_and_respected(window):
    async def scenario():
        async with linked(after(0.25), window=window) as (link, line):
            exchanges = await ask_all(link, [BATTERY, VOLTAGE] * 20)
            assert [exchange.command for exchange in exchanges] == [BATTERY, VOLTAGE] * 20
            assert line.commands == [BATTERY, VOLTAGE] * 20
            assert line.most_unanswered == min(window, 40)
            assert clock() == 0.25 * -(-40 // window)
            assert link.frames_sent == 40

    run(scenario())


def test_the_window_without_a_word_about_it():
    async def scenario():
        async with linked(after(0.25)) as (link, line):
            await ask_all(link, [BATTERY] * 20)
            assert line.most_unanswered == link.window == WINDOW

    run(scenario())


def test_the_window_may_change_on_the_way():
    async def scenario():
        async with linked(after(0.25), window=4) as (link, line):
            asking = asyncio.gather(*[link.ask(BATTERY) for _ in range(12)])
            await asyncio.sleep(0.125)
            link.window = 1
            await asyncio.sleep(0.25)
            line.most_unanswered = 0
            await asking
            assert line.most_unanswered == 1
            link.window = 3
            await ask_all(link, [BATTERY] * 9)
            assert line.most_unanswered == 3

    run(scenario())


def test_silent_commands_free_their_place():
    async def scenario():
        async with linked(never, window=2) as (link, line):
            exchanges = await ask_all(link, [BATTERY] * 6, timeout=0.5)
            assert all(isinstance(exchange, Silent) for exchange in exchanges)
            assert [when for when, _ in line.requests] == pytest.approx(
                [0.0, 0.0, 0.5, 0.5, 1.0, 1.0], abs=1e-5
            )

    run(scenario())


def overlaps(line, command, delay):
    """How many other requests were under way with one of this command, all answered after ``delay``."""
    return sum(
        abs(when - other_time) < delay
        for when, request in line.requests
        for other_time, other in line.requests
        if request.command == command and other is not request
    )


def test_asking_alone():
    async def scenario():
        async with linked(after(0.25)) as (link, line):
            commands = [BATTERY, BATTERY, VOLTAGE, BATTERY, BATTERY, BATTERY, VOLTAGE, VOLTAGE]
            await asyncio.gather(*[link.ask(command, alone=command == VOLTAGE) for command in commands])
            assert line.commands.count(VOLTAGE) == 3
            assert overlaps(line, VOLTAGE, 0.25) == 0
            assert overlaps(line, BATTERY, 0.25) > 0

    run(scenario())


def test_asking_alone_in_vain_lets_the_next_one_in():
    async def scenario():
        async with linked(never) as (link, line):
            first = asyncio.create_task(link.ask(VOLTAGE, alone=True, timeout=0.5))
            second = asyncio.create_task(link.ask(BATTERY, timeout=0.5))
            assert isinstance(await first, Silent)
            assert isinstance(await second, Silent)
            assert [when for when, _ in line.requests] == pytest.approx([0.0, 0.5], abs=1e-5)

    run(scenario())


def test_who_wants_to_be_alone_is_not_overtaken_for_ever():
    delays = iter([0.25, 0.5, 0.75, 1.0] * 20)

    async def scenario():
        async with linked(lambda request: [(next(delays), answer_to(request))], timeout=5.0) as (link, line):
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
def test_what_is_above_a_probe_goes_alone(command, risk):
    async def scenario():
        async with linked(after(0.25)) as (link, line):
            assert link.guard.assess(command).risk is risk
            await ask_all(link, [BATTERY, BATTERY, command, BATTERY, BATTERY, command, command])
            assert line.commands.count(command) == 3
            assert overlaps(line, command, 0.25) == 0
            assert overlaps(line, BATTERY, 0.25) > 0

    run(scenario())


def test_reads_and_probes_share_the_window():
    probe = Command(0x50, 0x01, bytes(11), 0x11)

    async def scenario():
        async with linked(after(0.25)) as (link, line):
            link.guard.trust_length_check(0x11)
            assert link.guard.assess(probe).risk is Risk.PROBE
            await ask_all(link, [BATTERY, probe] * 4)
            assert line.most_unanswered == WINDOW

    run(scenario())


def test_what_is_refused_sends_nothing():
    async def scenario():
        async with linked(after(0.25), consent=Consent()) as (link, line):
            for command, risk in ((SLEEP, Risk.MOTION), (Command(0x1D, 0x05), Risk.BRICK)):
                refused = await link.ask(command)
                assert refused == Refused(command, risk, link.guard.why_not(command))
                assert f"--allow {risk.word}" in refused.reason
            assert (line.requests, link.frames_sent, clock()) == ([], 0, 0.0)
            assert isinstance(await link.ask(BATTERY), Answered)

    run(scenario())


def test_what_is_refused_does_not_wait_for_a_place():
    async def scenario():
        async with linked(after(0.5), consent=Consent(), window=1) as (link, _):
            busy = asyncio.create_task(link.ask(BATTERY))
            await asyncio.sleep(0.25)
            assert isinstance(await link.ask(SLEEP), Refused)
            assert clock() == 0.25
            await busy

    run(scenario())


@pytest.mark.parametrize(
    ("of_link", "of_ask", "waited"),
    [
        pytest.param({}, {}, TIMEOUT, id="default"),
        pytest.param({"timeout": 0.25}, {}, 0.25, id="the link's"),
        pytest.param({}, {"timeout": 3.0}, 3.0, id="the command's"),
        pytest.param({"timeout": 9.0}, {"timeout": 0.125}, 0.125, id="the command's before the link's"),
    ],
)
def test_silence(of_link, of_ask, waited):
    async def scenario():
        async with linked(never, **of_link) as (link, _):
            await asyncio.sleep(100.0)
            silent = await link.ask(BATTERY, **of_ask)
            assert silent == Silent(
                BATTERY, 0, V2.encode_command(BATTERY, 0), pytest.approx(waited, abs=1e-5)
            )
            assert clock() == pytest.approx(100.0 + waited, abs=1e-5)

    run(scenario())


def test_each_command_has_its_own_deadline():
    async def scenario():
        async with linked(never) as (link, _):
            timeouts = [0.75, 0.25, 1.0, 0.5]
            exchanges = await asyncio.gather(*[link.ask(BATTERY, timeout=timeout) for timeout in timeouts])
            assert [exchange.waited for exchange in exchanges] == pytest.approx(timeouts, abs=1e-5)
            assert clock() == pytest.approx(1.0, abs=1e-5)

    run(scenario())


def test_one_is_silent_while_others_are_answered():
    def robot(request):
        return [] if request.command == VOLTAGE else after(0.125)(request)

    async def scenario():
        async with linked(robot) as (link, _):
            exchanges = await ask_all(link, [BATTERY, VOLTAGE, BATTERY, VOLTAGE, BATTERY])
            kinds = [type(exchange) for exchange in exchanges]
            assert kinds == [Answered, Silent, Answered, Silent, Answered]

    run(scenario())


def say_nothing_more(line):
    line.say(b"")


def break_the_line(line):
    line.say(LinkLostError("torn off"))


@pytest.mark.parametrize(
    ("happens", "reason"),
    [
        pytest.param(say_nothing_more, "closed the connection", id="the robot closes"),
        pytest.param(break_the_line, "torn off", id="reading fails"),
    ],
)
def test_a_lost_link_reaches_everybody(happens, reason):
    async def scenario():
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

    async def write(self, data):
        if self.requests:
            raise LinkLostError("cannot write")
        await super().write(data)


def test_a_link_lost_in_writing_reaches_everybody():
    async def scenario():
        async with linked(None, line=Broken(never)) as (link, _):
            asking = [asyncio.create_task(link.ask(BATTERY)) for _ in range(6)]
            ends = await asyncio.gather(*asking, return_exceptions=True)
            assert [type(end) for end in ends] == [LinkLostError] * 6
            assert {str(end) for end in ends} == {"cannot write"}
            assert clock() == 0.0

    run(scenario())


class Stuck(Line):
    """A line that takes no bytes until the robot is gone."""

    async def write(self, data):
        await asyncio.sleep(0.5)
        raise LinkLostError("cannot write")


def test_a_link_lost_while_writing_is_stuck():
    async def scenario():
        async with linked(None, line=Stuck(never)) as (link, line):
            asking = [asyncio.create_task(link.ask(BATTERY)) for _ in range(3)]
            await asyncio.sleep(0.25)
            line.say(b"")
            ends = await asyncio.gather(*asking, return_exceptions=True)
            assert [type(end) for end in ends] == [LinkLostError] * 3

    run(scenario())


def test_leaving_ends_what_still_waits():
    async def scenario():
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


def test_leaving_in_the_middle_of_trouble():
    asking = []

    async def trouble():
        async with linked(never) as (link, _):
            asking.append(asyncio.create_task(link.ask(BATTERY)))
            await asyncio.sleep(0.25)
            raise ZeroDivisionError

    async def scenario():
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
def test_waiting_for_the_end(happens, reason):
    async def scenario():
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


def test_waiting_for_the_end_of_a_link_that_is_left():
    async def scenario():
        async with linked(after(0.25)) as (link, _):
            patient = asyncio.create_task(link.closed())
            await asyncio.sleep(0.25)
        with pytest.raises(LinkLostError):
            await patient
        with pytest.raises(LinkLostError, match="closed"):
            await link.closed()

    run(scenario())


def test_a_link_that_never_stood_has_ended():
    async def scenario():
        link = Link(Line(never), V2, Guard(Generation.V2, None, Consent()))
        with pytest.raises(LinkLostError):
            await link.closed()

    run(scenario())


def test_a_link_that_was_lost_is_left_quietly():
    async def scenario():
        async with linked(never) as (_, line):
            line.say(b"")
            await asyncio.sleep(0.25)

    run(scenario())


def test_what_is_said_besides_reaches_whoever_listens():
    spoilt = Malformed(bytes.fromhex("8d09130d0000d7d8"), "checksum 0xd7, expected 0xd6")

    def robot(request):
        said = answer_to(request)
        return [(0.125, V2.frame_of(AWAKE) + spoilt.raw + said), (0.25, said)]

    async def scenario():
        heard = []
        async with linked(robot, on_aside=heard.append) as (link, _):
            answered = await link.ask(BATTERY)
            assert heard == [AWAKE, spoilt]
            await asyncio.sleep(0.25)
            assert heard[2:] == [Late(answered.response, answered.received, answered)]

    run(scenario())


def test_a_late_answer_is_an_aside():
    async def scenario():
        heard = []
        async with linked(after(0.75), timeout=0.5, on_aside=heard.append) as (link, _):
            silent = await link.ask(BATTERY)
            assert isinstance(silent, Silent)
            again = await link.ask(BATTERY, timeout=2.0)
            assert isinstance(again, Answered)
            assert again.rtt == pytest.approx(0.75, abs=1e-5)
            (late,) = heard
            assert isinstance(late, Late)
            assert late.earlier == silent

    run(scenario())


def test_the_listener_may_change_on_the_way():
    async def scenario():
        heard = []
        async with linked(never) as (link, line):
            line.say(V2.frame_of(AWAKE))
            await asyncio.sleep(0.25)
            link.on_aside = heard.append
            line.say(V2.frame_of(AWAKE))
            await asyncio.sleep(0.25)
            assert heard == [AWAKE]

    run(scenario())


def test_half_a_frame_is_given_up_with_the_command_it_blocks():
    def robot(request):
        return [(0.5 - 2 * QUIET / 3, answer_to(request)[:-1])] if request.seq == 0 else after(0.125)(request)

    async def scenario():
        heard = []
        async with linked(robot, timeout=0.5 + QUIET, on_aside=heard.append) as (link, _):
            assert isinstance(await link.ask(BATTERY), Silent)
            (half,) = heard
            assert isinstance(half, Malformed)
            assert isinstance(await link.ask(BATTERY), Answered)

    run(scenario())


def test_when_all_sequence_numbers_rest_the_next_command_waits():
    async def scenario():
        async with linked(never, window=255) as (link, line):
            await ask_all(link, [BATTERY] * 255, timeout=0.5)
            assert sorted(line.seqs) == list(range(255))
            line.robot = after(0.125)
            exchange = await link.ask(BATTERY)
            assert isinstance(exchange, Answered)
            assert line.requests[-1][0] == pytest.approx(0.5 + REST, abs=1e-4)
            assert exchange.rtt == 0.125

    run(scenario())


def test_who_waits_for_a_number_gets_one_each():
    async def scenario():
        async with linked(never, window=255) as (link, line):
            await ask_all(link, [BATTERY] * 255, timeout=0.5)
            line.robot = after(0.125)
            exchanges = await ask_all(link, [BATTERY] * 300)
            assert all(isinstance(exchange, Answered) for exchange in exchanges)
            assert len(line.requests) == 555
            assert all(when >= 0.5 + REST - 1e-4 for when, _ in line.requests[255:])

    run(scenario())


def test_more_commands_than_sequence_numbers():
    async def scenario():
        async with linked(after(0.125), window=1000) as (link, line):
            exchanges = await ask_all(link, [BATTERY] * 600)
            assert all(isinstance(exchange, Answered) for exchange in exchanges)
            assert line.most_unanswered == 255

    run(scenario())


def test_losing_the_link_while_waiting_for_a_number():
    async def scenario():
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


async def cancel(task):
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task
    assert task.cancelled()


def test_giving_up_waiting_for_an_answer():
    async def scenario():
        heard = []
        async with linked(after(0.5), window=2, on_aside=heard.append) as (link, line):
            hasty = asyncio.create_task(link.ask(BATTERY))
            await asyncio.sleep(0.25)
            await cancel(hasty)
            exchanges = await ask_all(link, [BATTERY] * 4)
            assert [exchange.rtt for exchange in exchanges] == [0.5] * 4
            assert line.seqs == [0, 1, 2, 3, 4]
            assert clock() == 0.25 + 2 * 0.5

    run(scenario())


def test_giving_up_waiting_for_a_place():
    async def scenario():
        async with linked(after(0.5), window=1) as (link, line):
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


def test_giving_up_being_the_next_alone_lets_the_others_go():
    async def scenario():
        async with linked(after(1.0), window=3) as (link, line):
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


def test_giving_up_being_alone():
    async def scenario():
        async with linked(after(0.5), window=3) as (link, line):
            alone = asyncio.create_task(link.ask(SLEEP))
            await asyncio.sleep(0.25)
            await cancel(alone)
            await asyncio.sleep(1.0)
            line.most_unanswered = 0
            await ask_all(link, [BATTERY] * 6)
            assert line.most_unanswered == 3

    run(scenario())


def test_giving_up_waiting_for_a_number():
    async def scenario():
        async with linked(never, window=255) as (link, line):
            await ask_all(link, [BATTERY] * 255, timeout=0.5)
            hasty = asyncio.create_task(link.ask(BATTERY))
            await asyncio.sleep(0.25)
            await cancel(hasty)
            await asyncio.sleep(REST)
            line.robot = after(0.125)
            assert isinstance(await link.ask(BATTERY, alone=True), Answered)
            assert len(line.requests) == 256

    run(scenario())


def test_giving_up_at_any_moment_leaks_no_place():
    async def scenario():
        line = Line(after(0.25))
        async with linked(None, line=line, window=2) as (link, _):
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


@pytest.mark.parametrize("steps", range(10))
@pytest.mark.parametrize("number", [0, 1, 2])
def test_giving_up_just_as_the_answer_comes(steps, number):
    async def scenario():
        async with linked(after(0.5), window=1) as (link, line):
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


def test_the_number_of_who_gave_up_is_not_used_while_its_answer_may_come():
    async def scenario():
        heard = []
        async with linked(after(0.5), on_aside=heard.append) as (link, line):
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
def test_a_command_that_cannot_be_written_takes_no_place(command):
    async def scenario():
        async with linked(after(0.25), window=1) as (link, line):
            for alone in (False, True):
                with pytest.raises(ValueError, match=r"at most|range\(0, 256\)"):
                    await link.ask(command, alone=alone)
            assert (line.requests, link.frames_sent) == ([], 0)
            assert isinstance(await link.ask(BATTERY), Answered)

    run(scenario())


def test_the_clock_notices_what_waits_for_ever():
    async def scenario():
        await asyncio.get_running_loop().create_future()

    with pytest.raises(RuntimeError, match="everything waits"):
        run(scenario())


def test_the_clock_notices_tasks_left_behind():
    async def scenario():
        asyncio.get_running_loop().keep = asyncio.create_task(asyncio.sleep(1.0))

    with pytest.raises(AssertionError, match="left behind"):
        run(scenario())
