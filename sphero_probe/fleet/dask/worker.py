"""Run a worker: offer the robots that this host reaches to a Dask scheduler, until the scheduler is gone."""

import asyncio
from collections import Counter
from collections.abc import Callable, Collection
from typing import Final, NamedTuple

from distributed import Worker
from distributed.core import Status

from sphero_probe.errors import ConnectionFailedError
from sphero_probe.fleet.adapters import Adapters
from sphero_probe.fleet.dask.cluster import UNREACHED, unreached
from sphero_probe.fleet.dask.messages import PLACES, device_of, resource_of
from sphero_probe.fleet.dask.station import Station
from sphero_probe.transports.base import OpenOptions, Seen
from sphero_probe.transports.registry import scan

_LOOPBACK: Final = "127.0.0.1"
_BETWEEN: Final = 30.0
"""Seconds between two scans; none is made while a robot is in use."""
_START: Final = 10.0
"""Seconds to reach the scheduler."""


class WorkerOptions(NamedTuple):
    """How a worker runs.

    Attributes:
        scheduler: its address: ``tcp://HOST:PORT`` or ``tls://HOST:PORT``.
        listen: the address at which this worker listens for the scheduler and other workers.
        devices: robots to offer, as ``--device`` takes them; none: what a scan finds.
        adapters: the Bluetooth adapters to use; none: the system's choice.
        per_adapter: robots on each at a time.
        scan: seconds of each scan.
    """

    scheduler: str
    listen: str
    devices: tuple[str, ...]
    adapters: tuple[str, ...]
    per_adapter: int
    scan: float


async def run_worker(
    options: WorkerOptions, on_offer: Callable[[Collection[str]], None], stop: asyncio.Event
) -> None:
    """Offer robots, and work on them, until ``stop`` is set.

    Args:
        options: see there.
        on_offer: told the devices each time that they change.
        stop: ends the worker; runs in progress are ended, and can be resumed by another worker.

    Raises:
        ConnectionFailedError: the scheduler cannot be reached, or is gone.
        UnavailableError: there is no Bluetooth here.
    """
    names = options.adapters or ("",)
    places = options.per_adapter * len(names)
    station = Station(Adapters(names, options.per_adapter))
    try:
        worker = await Worker(
            options.scheduler,
            host=options.listen,
            dashboard_address=f"{_LOOPBACK}:0",  # Dask serves its state over HTTP, in any case
            nthreads=places,
            resources={PLACES: places},
            memory_limit=0,
            death_timeout=_START,
            plugins=(station,),
        )
    except UNREACHED as error:
        raise unreached(options.scheduler, error) from error
    async with worker, station.listening(worker):
        offering = asyncio.create_task(_offer(worker, station, options, on_offer), name="offer")
        stopping = asyncio.create_task(stop.wait(), name="stop watcher")
        gone = asyncio.create_task(worker.finished(), name="scheduler watcher")
        waited = {offering, stopping, gone}
        try:
            done, _ = await asyncio.wait(waited, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in waited:
                task.cancel()
            await asyncio.gather(*waited, return_exceptions=True)
        if offering in done:
            offering.result()
        if stopping in done:
            await worker.set_resources(**dict.fromkeys(worker.state.total_resources, 0.0))
            await station.leave()
        elif gone in done:
            raise ConnectionFailedError(f"the scheduler {options.scheduler} is gone")


async def _offer(
    worker: Worker, station: Station, options: WorkerOptions, on_offer: Callable[[Collection[str]], None]
) -> None:
    """Offer the robots that were named, or those that scans find.

    Raises:
        UnavailableError: there is no Bluetooth here.
    """
    offered: dict[str, float] | None = None
    while True:
        near = options.devices or await _scan(options)
        if station.idle.is_set() or not offered:
            found = {resource_of(device): 1.0 for device in near}
            changed = {name: found.get(name, 0.0) for name in {*(offered or ()), *found}}
            if changed != offered:
                offered = changed
                await _announce(worker, changed)
                on_offer([device_of(name) for name, number in sorted(changed.items()) if number])
        if options.devices:
            await asyncio.Event().wait()
        await asyncio.sleep(_BETWEEN)
        await station.idle.wait()


async def _announce(worker: Worker, resources: dict[str, float]) -> None:
    """Tell the scheduler which resources this worker has.

    A scheduler gives waiting tasks another chance only when a worker joins or leaves the state "paused", not
    when a worker gets more resources [distributed 2026.8, scheduler.py, add_resources].
    """
    await worker.set_resources(**resources)
    worker.status = Status.paused
    worker.status = Status.running


async def _scan(options: WorkerOptions) -> list[str]:
    """Return the addresses of the robots nearby, and the names that only one of them has."""
    seen: dict[str, Seen] = {}
    for adapter in options.adapters or ("",):
        seen |= {robot.address: robot for robot in await scan(OpenOptions(options.scan, adapter))}
    names = Counter(robot.name.strip() for robot in seen.values())
    return [*seen, *(name for name, number in names.items() if name and number == 1)]
