"""What calibration sends to a device: reads first, what may run alone, what should not exist with care."""

from itertools import chain

import pytest

from sphero_probe.catalogue import lookup
from sphero_probe.link.events import ExchangeEnded, FrameSent
from sphero_probe.link.exchange import Answered, Silent
from sphero_probe.link.link import Link
from sphero_probe.link.policy import Consent, Policy
from sphero_probe.link.wrong_lengths import IMPOSSIBLE_CIDS, WRONG_LENGTH, is_impossible, is_wrong_length
from sphero_probe.probing.calibration_rows import calibration_rows
from sphero_probe.probing.calibrator import Calibrator, Wanted
from sphero_probe.probing.executions import Executions
from sphero_probe.probing.finding import Note
from sphero_probe.probing.health import HealthCheck
from sphero_probe.probing.notes import EXECUTED
from sphero_probe.probing.prober import Prober
from sphero_probe.protocol.address import PRIMARY
from sphero_probe.protocol.packets import Command, Request, Role
from sphero_probe.protocol.v2 import V2
from sphero_probe.session.reconnect import Reconnector
from sphero_probe.simulator import FakeRobot, parse_settings
from sphero_probe.transports.fake import FakeTransport
from tests.support.strangers.commands import BOLT, Effect, Row
from tests.support.strangers.firmware import Firmware, Voice
from tests.support.strangers.habits import Stranger
from tests.support.strangers.runs import run
from tests.support.virtual_clock import run as run_on_virtual_clock

DEVICES = (0x13, 0x18)
_FIRST = IMPOSSIBLE_CIDS[0]
_WITHOUT_ARGUMENTS = Row(1, 0x13, _FIRST, "", Effect.MOTION)


def payloads(stranger: Stranger) -> list[int]:
    """Return the lengths of what was sent to the first CID that should not exist; nothing may have run."""
    robot = run(stranger, "sweep").robot
    assert not [done for done in robot.ledger if done.row.cid == _FIRST]
    return [len(heard.data) for heard in robot.heard if (heard.did, heard.cid) == (0x13, _FIRST)]


@pytest.mark.parametrize(
    ("rows", "lengths"), [((*BOLT, _WITHOUT_ARGUMENTS), {11}), (BOLT, {11, 0})], ids=["exists", "absent"]
)
def test_an_empty_payload_is_sent_only_after_the_command_was_called_absent(
    rows: tuple[Row, ...], lengths: set[int]
) -> None:
    sent = payloads(Stranger(name="one more", habit="", firmware=Firmware(rows=rows)))
    assert sent[0] == 11
    assert set(sent) == lengths


def test_a_drop_after_a_surprise_does_not_hide_it() -> None:
    """A command that should not exist runs, and the link drops before it is known what else runs."""
    rows = (*BOLT, Row(1, 0x13, _FIRST, "", Effect.MOTION, 0, 64))
    voice = Voice(drops=lambda moment: moment.pair == (0x13, IMPOSSIBLE_CIDS[2]) and moment.attempt == 1)
    ran = run(Stranger(name="one more", habit="", firmware=Firmware(rows=rows), voice=voice), "sweep")
    assert [done for done in ran.robot.ledger if done.row.cid == _FIRST]
    asked = {heard.cid for heard in ran.robot.heard if heard.did == 0x13 and len(heard.data) == 11}
    assert not asked - {*IMPOSSIBLE_CIDS, *(row.cid for row in BOLT if row.did == 0x13 and row.name)}
    assert any(isinstance(record, Note) and record.kind == EXECUTED for record in ran.records)


def calibrated(settings: str) -> list[tuple[str, Command]]:
    """Return what calibrating two devices with setters sent, and how each command ended, in order."""
    robot = FakeRobot(parse_settings(settings))
    decoder = V2.decoder(Role.ROBOT)
    log: list[tuple[str, Command]] = []

    def sent(event: FrameSent) -> None:
        requests = (packet for packet in decoder.feed(event.frame) if isinstance(packet, Request))
        log.extend(("sent", Command(*request.command[:3])) for request in requests)

    def ended(event: ExchangeEnded) -> None:
        if isinstance(event.exchange, Answered | Silent):
            log.append(("ended", Command(*event.exchange.command[:3])))

    async def work() -> None:
        policy = Policy(V2.generation, robot.model, Consent(), ())
        async with Link(FakeTransport(robot), V2, policy) as link:
            prober = Prober(Reconnector(link, PRIMARY), PRIMARY)
            executions = Executions(prober, lambda _: None)
            wanted = Wanted({PRIMARY: DEVICES}, [(PRIMARY, did) for did in DEVICES])
            with link.events.subscribe(sent, FrameSent), link.events.subscribe(ended, ExchangeEnded):
                await Calibrator(prober, executions, HealthCheck(prober), verify=False).measure(wanted)

    run_on_virtual_clock(work())
    return log


@pytest.mark.parametrize("faults", ["", "&loss=0.05&seed=4", "&queue=2", "&silent=0x13:0x1b"])
def test_what_may_be_executed_flies_alone_and_after_the_reads(faults: str) -> None:
    model = parse_settings("bolt-plus").model
    reads, setters = zip(*(calibration_rows(V2.generation, model, did) for did in DEVICES), strict=True)
    missing = {(row.did, row.cid) for row in chain(*reads)}
    wanted = {(row.did, row.cid) for row in chain(*setters)}
    asked: set[tuple[int, int]] = set()
    flying: list[Command] = []
    for what, command in calibrated(f"bolt-plus?interval=15ms{faults}"):
        row = lookup(V2.generation, command.did, command.cid, model)
        if what == "ended" and command.payload == bytes(WRONG_LENGTH):
            missing.discard(command[:2])
        if is_impossible(command) or not is_wrong_length(command, row):
            continue
        if what == "ended":
            flying.remove(command)
            continue
        assert not flying
        flying.append(command)
        if command[:2] in wanted:
            assert not missing
            asked.add(command[:2])
    assert asked == wanted
