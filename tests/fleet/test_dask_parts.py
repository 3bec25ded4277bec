"""The parts of a fleet on Dask workers that need no scheduler."""

import asyncio
from pathlib import Path

import pytest

from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import BadInputFileError, IncompleteError, UsageError
from sphero_probe.fleet.dask.execution import GRACE, Execution
from sphero_probe.fleet.dask.journal import SentRunJournal, read_lines
from sphero_probe.fleet.dask.kept import KeptRun
from sphero_probe.fleet.dask.messages import (
    Begin,
    Grown,
    Hello,
    Stop,
    Upward,
    Written,
    device_of,
    pack,
    resource_of,
    unpack,
)
from sphero_probe.fleet.records import Step
from sphero_probe.link.policy import Consent
from sphero_probe.probing.attempt import PreparedProbe
from sphero_probe.probing.finding import Finding, Record
from sphero_probe.probing.plan import Plan, Probe
from sphero_probe.protocol.packets import Command
from sphero_probe.runs.reader import read_journal
from sphero_probe.runs.resume import RunJournal
from sphero_probe.runs.running import engine_for, records_of
from sphero_probe.session.session import open_session
from tests.support.virtual_clock import run

HELLO = Hello("fake:bolt", "an execution", "tcp://127.0.0.1:1", "a host", "inbox")
LEDS = Plan("sweep", "", [[Probe(Command(0x1A, 0x1C, b"\x07\xff\x00\x00"), exact=True)] * 3])


class Told(list[Upward]):
    """Messages to a client."""

    @property
    def grown(self) -> list[Grown]:
        return [message for message in self if isinstance(message, Grown)]


def an_execution() -> tuple[Execution, Told]:
    told = Told()
    return Execution(HELLO, told.append, at_once=False), told


def test_news_are_collected_for_a_moment() -> None:
    async def work() -> list[Grown]:
        execution, told = an_execution()
        for number in range(10):
            execution.add_line(b"%d\n" % number)
        execution.add_record(Step("wake"))
        assert not told
        await asyncio.sleep(0.1)
        execution.add_line(b"more\n")
        execution.flush()
        await asyncio.sleep(0.1)
        return told.grown

    first, second = run(work())
    assert first.lines.decode() == "".join(f"{number}\n" for number in range(10))
    assert first.records == (Step("wake"),)
    assert (second.number, second.lines, second.awaited) == (2, b"more\n", False)


def test_what_must_be_written_is_waited_for() -> None:
    async def work() -> None:
        execution, told = an_execution()
        execution.add_line(b"intent\n")
        waiting = asyncio.create_task(execution.written())
        await asyncio.sleep(5)
        (grown,) = told.grown
        assert (grown.awaited, waiting.done()) == (True, False)
        execution.hear(Written(HELLO.execution, grown.number - 1))
        await asyncio.sleep(5)
        assert not waiting.done()
        execution.hear(Written(HELLO.execution, grown.number))
        await waiting

    run(work())


def test_a_client_that_is_far_behind_is_waited_for() -> None:
    async def work() -> None:
        execution, told = an_execution()
        execution.add_line(bytes(1 << 20))
        execution.flush()
        await execution.room()
        execution.add_line(b"\n")
        execution.flush()
        waiting = asyncio.create_task(execution.room())
        await asyncio.sleep(5)
        assert not waiting.done()
        execution.hear(Written(HELLO.execution, told.grown[-1].number))
        await waiting
        await execution.room()

    run(work())


def test_a_client_that_is_gone_is_not_waited_for() -> None:
    async def work() -> float:
        execution, _ = an_execution()
        loop = asyncio.get_running_loop()

        async def lose_client() -> None:
            async with execution.limit:
                execution.hear(Begin(HELLO.execution, "", b""))
                await execution.permission()
                waiting = asyncio.create_task(execution.written())
                await asyncio.sleep(1)
                execution.end()
                with pytest.raises(IncompleteError, match="is gone"):
                    await waiting
                assert execution.stop.is_set()
                await asyncio.sleep(1000)

        with pytest.raises(TimeoutError):
            await lose_client()
        return loop.time()

    assert run(work()) == pytest.approx(1 + GRACE, abs=0.1)


def test_permission_is_asked_for_until_it_is_given_or_the_time_is_up() -> None:
    async def in_time(execution: Execution) -> None:
        async with execution.limit:
            await execution.permission()

    async def work() -> tuple[int, int]:
        execution, told = an_execution()
        with pytest.raises(TimeoutError):
            await in_time(execution)
        asked = len(told)
        execution, told = an_execution()
        async with execution.limit:
            waiting = asyncio.create_task(execution.permission())
            await asyncio.sleep(2.5)
            execution.hear(Begin(HELLO.execution, "place", b"lines"))
            assert await waiting == Begin(HELLO.execution, "place", b"lines")
            execution.hear(Stop(HELLO.execution))
            assert execution.stop.is_set()
            await asyncio.sleep(1000)  # the limit holds no more
        return asked, len(told)

    asked, again = run(work())
    assert (asked > 10, again) == (True, 3)


def test_a_worker_that_ends_gives_up_waiting_for_permission() -> None:
    async def work() -> Begin | None:
        execution, _ = an_execution()
        async with execution.limit:
            waiting = asyncio.create_task(execution.permission())
            await asyncio.sleep(1)
            execution.leave()
            return await waiting

    assert run(work()) is None


def test_nothing_above_probe_is_sent_before_its_intent_is_in_the_client_s_journal(tmp_path: Path) -> None:
    ledger, file = tmp_path / "ledger", tmp_path / "journal"
    device = f"fake:bolt-plus?ledger={ledger}"
    seen: list[tuple[int, int]] = []

    def executed() -> int:
        return ledger.read_text().count('"risk":"write"')

    async def work() -> None:
        client = RunJournal("sweep", file=str(file))
        pending = bytearray()

        async def written() -> None:
            await asyncio.sleep(1)  # a client that takes its time
            client.append(bytes(pending))
            pending.clear()
            seen.append((len(read_journal(file).intents), executed()))

        with client, SentRunJournal("sweep", str(file), b"", pending.extend, written) as journal:
            async with open_session(device, Consent.of(["write"])) as session:
                journal.begin(session.connection, LEDS, session.link.policy.consent, None)
                engine = engine_for(LEDS, session, session.target, asyncio.Event(), journal)
                records = [record async for record in records_of(engine, session)]
            client.append(bytes(pending))
        assert sum(isinstance(record, Finding) for record in records) == 3

    run(work())
    assert seen == [(1, 0), (2, 1), (3, 2)]  # each time one intent more than what was executed
    assert executed() == 3


async def _sent_after_a_death(device: str, held: bytes) -> list[Record]:
    async def written() -> None:
        pass

    with SentRunJournal("sweep", "a place", held, lambda _: None, written) as journal:
        async with open_session(device, Consent.of(["write"])) as session:
            plan, consent = LEDS, session.link.policy.consent
            journal.check(plan, consent, None)
            journal.begin(session.connection, plan, consent, None)
            engine = engine_for(plan, session, session.target, asyncio.Event(), journal)
            return [record async for record in records_of(engine, session)]


def test_what_was_sent_and_not_answered_is_not_sent_again(tmp_path: Path) -> None:
    ledger = tmp_path / "ledger"
    device = f"fake:bolt-plus?ledger={ledger}"
    lines = bytearray()

    async def first() -> None:
        async def written() -> None:
            pass

        with SentRunJournal("sweep", "a place", b"", lines.extend, written) as journal:
            async with open_session(device, Consent.of(["write"])) as session:
                journal.begin(session.connection, LEDS, session.link.policy.consent, None)
                command = LEDS.stages[0][1].command._replace(target=session.target)  # type: ignore[index]
                journal.intend(PreparedProbe(2, command, Risk.WRITE, None, ""))

    run(first())
    kept = KeptRun(RunJournal("sweep", off=True))
    kept.append(bytes(lines))
    assert kept.may_have_executed
    records = run(_sent_after_a_death(device, bytes(lines)))
    found = {record.number: record for record in records if isinstance(record, Finding)}
    assert "not sent again" in found[2].note
    assert [found[number].attempts for number in (1, 3)] == [1, 1]
    assert ledger.read_text().count('"risk":"write"') == 2


def test_kept_lines_make_the_journal(tmp_path: Path) -> None:
    with RunJournal("sweep", file=str(tmp_path / "a")) as journal:
        lines = bytearray()

        async def written() -> None:
            pass

        async def work() -> None:
            with SentRunJournal("sweep", "", b"", lines.extend, written) as sent:
                async with open_session("fake:bolt-plus", Consent()) as session:
                    sent.begin(session.connection, LEDS, Consent(), None)

        run(work())
        kept = KeptRun(journal)
        kept.append(b"")
        kept.append(bytes(lines))
        assert not kept.may_have_executed
        recorded = read_journal(tmp_path / "a")
    assert recorded.opening
    assert recorded.opening.command == "sweep"
    with RunJournal("sweep") as journal:  # in the folder of runs, once its first line is there
        kept = KeptRun(journal)
        assert kept.place == ""
        kept.append(bytes(lines))
        assert "sweep" in kept.place
        with pytest.raises(BadInputFileError):
            KeptRun(RunJournal("sweep")).append(b"{}\n")


def test_lines_that_are_no_journal() -> None:
    assert read_lines(b"", "a place") is None
    with pytest.raises(BadInputFileError, match="a place"):
        read_lines(b"{}\n{}\n", "a place")


@pytest.mark.parametrize("message", [HELLO, Begin("x", "", b""), Written("x", 3), Stop("x")])
def test_messages_arrive_as_they_were(message: Hello | Begin | Written | Stop) -> None:
    assert unpack(pack(message)) == message


@pytest.mark.parametrize("data", [b"", b"x", pack(HELLO)[:-2], b"\x80\x04N."])
def test_bytes_that_are_no_message(data: bytes) -> None:
    with pytest.raises(TypeError):
        unpack(data)


@pytest.mark.parametrize(
    ("device", "resource"),
    [
        ("BP-1234", "robot:BP-1234"),
        ("ble:bp-1234", "robot:BP-1234"),
        ("aa:bb:cc:dd:ee:ff", "robot:AA:BB:CC:DD:EE:FF"),
        ("fake:bolt?seed=1", "robot:fake:bolt?seed=1"),
        ("serial:/dev/ttyS0", "robot:serial:/dev/ttyS0"),
    ],
)
def test_a_robot_is_a_resource(device: str, resource: str) -> None:
    assert resource_of(device) == resource
    assert resource_of(device_of(resource)) == resource
    assert device_of("adapter") == ""


def test_an_address_that_is_none_is_no_resource() -> None:
    with pytest.raises(UsageError):
        resource_of("nonsense:1")
