"""Compares the time of a sweep with the least time that its link needs, on modelled links.

Everything runs on a virtual clock, so the times are those of the modelled link, the same on every machine.
"""

from collections.abc import Iterator, Sequence
from itertools import product
from statistics import median
from time import process_time
from typing import Final

from benchmarks.modelled import ONE_DEVICE, Cell, Swept, strategy_of_spherov2, sweep_of
from benchmarks.section import Line, Options, Ratio, Remark, Section
from sphero_probe.simulator.measured_timing import IN_FLIGHT, ROUND_TRIPS

LINKS: Final = ((0.015, 6), (0.030, 4), (0.050, 4))
"""Seconds between connection events, packets per event in each direction."""
SILENT: Final = (0.0, 0.05, 0.2)
QUEUES: Final = (8, 2)
LOSSES: Final = (0.0, 0.02)
USUAL: Final = (0.05, 8)
"""Fraction of silent commands and length of the robot's queue that the targets are for."""
_SEEDS: Final = 20
_QUICK_SEEDS: Final = 3
MOST_ALL, _BAR_PEER, _BAR_CORE = 1.12, 30.0, 20.0
_MOST: Final = {
    (0.015, 6, 0.05, 8, 0.0): 1.45,
    (0.030, 4, 0.05, 8, 0.0): 1.25,
    (0.050, 4, 0.05, 8, 0.0): 1.25,
    (0.015, 6, 0.2, 8, 0.0): 1.8,
    (0.015, 6, 0.2, 2, 0.0): 3.0,
}
"""Interval, packets per event, silent, queue, loss -> how many times the limit 256 commands may take."""
_SILENT_MUCH, _SLOW_SERVICE = 0.2, 0.020
_BAUDS: Final = (115_200, 9_600)


def measure(options: Options) -> Iterator[Line | Remark]:
    """Sweep modelled robots, also with the strategy of spherov2."""
    seeds = _QUICK_SEEDS if options.quick else _SEEDS
    yield Remark("links, robots and the clock are simulated; the brackets show the extremes over all seeds")
    yield Remark("the limit: the least time in which link and robot's queue carry every probe once;")
    yield Remark(
        "our time runs from the first probe to the last finding, in the notes from the connection on;"
    )
    yield Remark("a run then waits for late answers, until 5 s after the first attempt of each silent probe")
    for key in product(LINKS, SILENT, QUEUES, LOSSES):
        (interval, per_event), silent, queue, loss = key
        most = _MOST.get((interval, per_event, silent, queue, loss))
        if most or not options.quick or (interval, per_event) == LINKS[0]:
            cell = Cell(interval, per_event, silent, queue, loss)
            yield _line("256 CIDs", cell, _swept(cell, seeds), most)
    for queue in QUEUES:
        cell = Cell(*LINKS[0], _SILENT_MUCH, queue, 0.0, _SLOW_SERVICE)
        yield _line("256 CIDs", cell, _swept(cell, seeds), None)
    for baud in _BAUDS:
        cell = Cell(0.0, 1, *USUAL, 0.0, baud=baud)
        yield _line("256 CIDs", cell, _swept(cell, seeds), None)
    yield _measured(seeds)
    dids = range(0x40, 0x50) if options.quick else range(256)
    for interval, per_event in LINKS:
        cell = Cell(interval, per_event, *USUAL, 0.0)
        began = process_time()
        swept = sweep_of(cell, dids, 0)
        spent = process_time() - began
        yield _line(f"{len(dids)} x 256", cell, [swept], None if options.quick else MOST_ALL)
        if (interval, per_event) == LINKS[0]:
            yield _per_core(cell, swept, spent)
    for interval, per_event in LINKS:
        for silent in (0.0, USUAL[0]):
            yield _beside_spherov2(Cell(interval, per_event, silent, USUAL[1], 0.0), seeds)


def _swept(cell: Cell, seeds: int) -> list[Swept]:
    return [sweep_of(cell, ONE_DEVICE, seed) for seed in range(seeds)]


def _measured(seeds: int) -> Line:
    """Compare with two commands in flight, as the maker's app had on the robot that was measured."""
    cell = Cell(0.0, 1, *USUAL, 0.0, is_measured=True)
    swept = _swept(cell, seeds)
    usual = 256 * median(seconds for _, seconds in ROUND_TRIPS) / IN_FLIGHT
    quotients = sorted(usual / one.seconds for one in swept)
    note = (
        f"{median(one.seconds for one in swept):.1f} s; whether a robot takes more than {IN_FLIGHT} at once "
        f"was not measured; {sum(one.false for one in swept)} false silences"
    )
    ratio = Ratio(median(quotients), quotients[0], quotients[-1])
    return Line(f"256 CIDs: {cell}", f"{IN_FLIGHT} in flight", ratio, note=note)


def _per_core(cell: Cell, swept: Swept, spent: float) -> Line:
    """Return how many robots one core serves at the speed of their links."""
    robots = (swept.calling + swept.seconds) / (spent - swept.simulating)
    note = f"{(swept.calling + swept.seconds) / spent:.0f} with the simulated robots on the same core"
    return Line(f"robots per core: {cell}", "one robot", Ratio(robots, robots, robots), _BAR_CORE, note=note)


def _beside_spherov2(cell: Cell, seeds: int) -> Line:
    theirs = [strategy_of_spherov2(cell, seed) for seed in range(seeds)]
    ours = _swept(cell, seeds)
    quotients = sorted(their / one.seconds for their, one in zip(theirs, ours, strict=True))
    ratio = Ratio(median(quotients), quotients[0], quotients[-1])
    whole = median(their / (one.calling + one.seconds) for their, one in zip(theirs, ours, strict=True))
    note = f"{median(theirs):.0f} s; {whole:.0f}x with our identification and calibration"
    bar = _BAR_PEER if cell.silent else None
    return Line(f"256 CIDs: {cell}", "spherov2's strategy", ratio, bar, note=note)


def _line(what: str, cell: Cell, swept: Sequence[Swept], ceiling: float | None) -> Line:
    over = sorted(one.seconds / one.limit for one in swept)
    ratio = Ratio(median(over), over[0], over[-1])
    false = sum(one.false for one in swept)
    calling = median(one.calling for one in swept)
    whole = median((one.calling + one.seconds) / one.limit for one in swept)
    trips = f" ({calling / (2 * cell.interval):.1f} round trips)" if cell.interval else ""
    note = (
        f"{calling:.2f} s{trips} of identification and calibration, {whole:.2f}x with them; "
        f"{false} false silences"
    )
    is_link = cell.baud or cell.per_command * cell.per_event <= cell.interval
    limit = "the link's limit" if is_link else "the queue's limit"
    return Line(f"{what}: {cell}", limit, ratio, note=note, ceiling=ceiling)


SECTION = Section("sweep", "the time of a sweep compared with its link's limit, on a virtual clock", measure)
