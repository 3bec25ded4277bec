"""A reading that comes as a notification has its own word."""

from collections.abc import Sequence

import pytest

from sphero_probe.probing.readings import EXPECTED
from tests.support.strangers.commands import R2
from tests.support.strangers.firmware import Firmware, Moment, Voice
from tests.support.strangers.frames import Answer, notification_v2
from tests.support.strangers.habits import Stranger
from tests.support.strangers.runs import run

VOLTAGE = (0x13, 0x03)


def empty(answer: Answer, moment: Moment) -> Answer:
    return answer._replace(data=b"") if moment.pair == VOLTAGE else answer


@pytest.mark.parametrize(
    ("before", "after", "note"),
    [
        pytest.param(None, (0x13, 0x3D), "answered by notification 0x13:0x3d", id="same device"),
        pytest.param(None, None, EXPECTED, id="nothing"),
        pytest.param(None, (0x18, 0x3D), EXPECTED, id="another device"),
        pytest.param((0x13, 0x3D), (0x13, 0x3D), EXPECTED, id="what it notified of anyway"),
        pytest.param((0x13, 0x3E), (0x13, 0x3D), "answered by notification 0x13:0x3d", id="another before"),
    ],
)
def test_a_reading_without_data_that_a_notification_follows(
    before: tuple[int, int] | None, after: tuple[int, int] | None, note: str
) -> None:
    def pieces(frame: bytes, moment: Moment) -> Sequence[bytes]:
        first = [notification_v2(*before, b"\x01\x02")] * 3 if before and moment.number == 1 else []
        then = [notification_v2(*after, b"\x01\x02")] if after and moment.pair == VOLTAGE else []
        return [*first, frame, *then]

    voice = Voice(alter=empty, pieces=pieces)
    ran = run(
        Stranger(name="", habit="", firmware=Firmware(rows=R2), model="r2d2", voice=voice, few=False), "sweep"
    )
    assert ran.error is None
    (finding,) = [finding for finding in ran.findings if finding.command[:2] == VOLTAGE]
    assert finding.note == note
