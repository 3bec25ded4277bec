"""What calibration sends to a device, on a robot that has a command where none should be."""

import pytest

from sphero_probe.link.wrong_lengths import IMPOSSIBLE_CIDS
from sphero_probe.probing.finding import Note
from sphero_probe.probing.notes import EXECUTED
from tests.support.strangers.commands import BOLT, Effect, Row
from tests.support.strangers.firmware import Firmware, Voice
from tests.support.strangers.habits import Stranger
from tests.support.strangers.runs import run

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
