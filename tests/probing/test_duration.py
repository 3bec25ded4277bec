"""How long runs take on the virtual clock: bounded, also where answers are lost or a queue is small."""

from statistics import median

import pytest

from benchmarks.modelled import ONE_DEVICE, Cell, sweep_of
from sphero_probe.probing.finding import Outcome, Summary
from tests.support.strangers.habits import STRANGERS
from tests.support.strangers.runs import run

BY_NAME = {stranger.name: stranger for stranger in STRANGERS}


@pytest.mark.unmeasured
@pytest.mark.parametrize(("name", "most"), [("bb-8 loses calibration", 45.0), ("plain bb-8", 8.0)])
def test_a_sweep_of_256_commands_ends_in_time(name: str, most: float) -> None:
    ran = run(BY_NAME[name], "sweep")
    summary = ran.records[-1]
    assert isinstance(summary, Summary)
    assert summary.complete
    assert summary.counts.get(Outcome.SILENT, 0) == 0
    assert summary.counts.get(Outcome.INCONCLUSIVE, 0) == 0
    assert ran.seconds <= most


@pytest.mark.parametrize(("interval", "per_event"), [(0.015, 6), (0.030, 4), (0.050, 4)])
def test_the_first_probe_is_sent_after_six_round_trips_where_all_is_answered(
    interval: float, per_event: int
) -> None:
    """Wake, reads, the same with surplus bytes, the device's other reads, and two setters in turn."""
    swept = sweep_of(Cell(interval, per_event, silent=0.0, queue=8, loss=0.0), ONE_DEVICE, 0)
    assert round(swept.calling / (2 * interval), 6) <= 6


def test_a_small_queue_makes_calibration_wait_but_not_for_long() -> None:
    swept = sweep_of(Cell(0.015, 6, silent=0.0, queue=2, loss=0.0), ONE_DEVICE, 0)
    assert round(swept.calling / (2 * 0.015), 6) <= 11


def test_silent_devices_do_not_slow_the_calibration_of_the_others() -> None:
    """Five of these devices are silent; an echo after each makes the timeout short again."""
    swept = sweep_of(Cell(0.015, 6, silent=0.05, queue=8, loss=0.0), range(64), 0)
    assert round(swept.calling / (2 * 0.015), 6) <= 75


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    ("queue", "service", "most"),
    [
        pytest.param(8, 0.001, 1.8, id="a long queue"),
        pytest.param(2, 0.001, 3.0, id="a short queue"),
        pytest.param(2, 0.020, 2.3, id="a short queue, served slowly"),
    ],
)
def test_many_silent_commands_cost_little_whatever_the_queue(queue: int, service: float, most: float) -> None:
    cell = Cell(0.015, 6, silent=0.2, queue=queue, loss=0.0, service=service)
    swept = [sweep_of(cell, ONE_DEVICE, seed) for seed in range(5)]
    assert not sum(one.false for one in swept)
    assert median(one.seconds / one.limit for one in swept) <= most


@pytest.mark.unmeasured
def test_one_probe_in_flight_costs_its_round_trip_and_no_timeout() -> None:
    """With this seed both harmless setters of the device are silent, so that nothing proves it strict."""
    cell = Cell(0.015, 6, silent=0.2, queue=8, loss=0.0)
    swept = sweep_of(cell, ONE_DEVICE, 8)
    assert 12 < swept.seconds / swept.limit <= 17
