"""The health of robots: what works is told as it is, and what does not is trouble."""

import pytest

from sphero_probe.fleet.health import HealthAction
from sphero_probe.fleet.records import Battery, FleetRecord, Health, Status
from tests.support.fleet import ended, on_fleet
from tests.support.virtual_clock import run


def health_of(device: str) -> tuple[Health, list[FleetRecord]]:
    (records,) = run(on_fleet([device], HealthAction())).values()
    (health,) = (record for record in records if isinstance(record, Health))
    return health, records


@pytest.mark.parametrize(
    ("device", "nodes"),
    [
        ("fake:bolt-plus?interval=15ms", ["primary"]),
        ("fake:rvr?interval=15ms", ["primary", "secondary"]),
        ("fake:ollie?interval=15ms", ["robot"]),
    ],
)
def test_a_healthy_robot(device: str, nodes: list[str]) -> None:
    health, records = health_of(device)
    assert list(health.firmware) == nodes
    assert (health.awake, health.dead, health.trips.lost) == (True, (), 0)
    assert 0.015 <= health.trips.median <= 0.045
    assert any(isinstance(record, Battery) and record.facts for record in records)
    assert ended(records).status is Status.DONE


def test_a_dead_node_is_trouble() -> None:
    health, records = health_of("fake:rvr?die=2@1ms&interval=15ms")
    assert list(health.firmware) == ["primary"]
    assert health.dead == ("secondary",)
    assert ended(records)[:2] == (Status.INCOMPLETE, "no answer from the node secondary")


def test_lost_echoes_are_counted() -> None:
    health, _ = health_of("fake:bolt-plus?interval=15ms&loss=0.1&seed=3")
    assert 0 < health.trips.lost < health.trips.sent == 10


def test_a_robot_that_sleeps_at_once_is_told_apart() -> None:
    health, records = health_of("fake:bolt-plus?interval=15ms&sleep_after=1ms")
    assert health.awake is False
    assert ended(records).status is Status.INCOMPLETE
