"""Times several functions in interleaved rounds, so that all run under the same conditions."""

import gc
from collections.abc import Callable, Mapping
from statistics import median, quantiles
from time import perf_counter

from benchmarks.section import Ratio


def race(runners: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, list[float]]:
    """Time functions in interleaved rounds, each round in another order, without garbage collection.

    Args:
        runners: name -> function.
        rounds: how often each is timed, after one run that is not timed.

    Returns:
        Name -> the seconds of each round.
    """
    names = list(runners)
    for name in names:
        runners[name]()
    seconds: dict[str, list[float]] = {name: [] for name in names}
    for turn in range(rounds):
        at = turn % len(names)
        for name in names[at:] + names[:at]:
            seconds[name].append(timed(runners[name]))
    return seconds


def timed(run: Callable[[], object]) -> float:
    """Return how many seconds a run takes, as ``timeit`` would measure it."""
    gc.collect()
    gc.disable()
    try:
        start = perf_counter()
        run()
        return perf_counter() - start
    finally:
        gc.enable()


def ratio(theirs: list[float], ours: list[float]) -> Ratio:
    """Return how many times as long they took: the median and the quartiles of the quotients."""
    quotients = sorted(one / other for one, other in zip(theirs, ours, strict=True))
    if len(quotients) == 1:
        return Ratio(quotients[0], quotients[0], quotients[0])
    low, _, high = quantiles(quotients, n=4, method="inclusive")
    return Ratio(median(quotients), low, high)
