"""What calibration sends to a device, on a robot that has a command where none should be."""

import pytest

from sphero_probe.link.wrong_lengths import IMPOSSIBLE_CIDS
from tests.support.strangers.commands import BOLT, Effect, Row
from tests.support.strangers.firmware import Firmware
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
