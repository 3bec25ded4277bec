"""``fleet worker``: offer the robots that this host reaches to a Dask scheduler."""

import asyncio
from collections.abc import Collection
from ipaddress import ip_address
from typing import Final

from sphero_probe.cli.messages import say
from sphero_probe.cli.signals import Interrupts, run_interruptible
from sphero_probe.errors import UsageError
from sphero_probe.fleet.adapters import adapter_names
from sphero_probe.fleet.dask.installed import check_dask
from sphero_probe.fleet.robots import fleet_of

_LOOPBACK: Final = "127.0.0.1"


def serve_fleet(
    scheduler: str,
    devices: tuple[str, ...],
    adapters: tuple[str, ...],
    per_adapter: int,
    scan: float,
    listen: str | None,
) -> None:
    """Offer robots, and work on them, until a signal arrives or the scheduler is gone.

    Args:
        scheduler: its address.
        devices: the robots, as ``--device`` takes them; empty for those that scans find.
        adapters: the Bluetooth adapters to use, empty for all.
        per_adapter: robots on each at a time.
        scan: seconds of each scan.
        listen: the address to listen at, None for the loopback interface.

    Raises:
        UsageError: an address is not valid.
        UnavailableError: Dask is not installed, or there is no Bluetooth here.
        ConnectionFailedError: the scheduler cannot be reached, or is gone.
        InterruptedRunError: a signal ended it.
    """
    if devices:
        fleet_of(devices)
    address = _address(listen) if listen else _LOOPBACK
    check_dask()
    from sphero_probe.fleet.dask.worker import WorkerOptions, run_worker  # noqa: PLC0415 - an extra

    interrupts, stop = Interrupts(), asyncio.Event()

    async def work() -> None:
        interrupts.stop_politely(stop)
        names = adapters or (() if devices else await adapter_names())
        options = WorkerOptions(scheduler, address, devices, names, per_adapter, scan)
        await run_worker(options, _say_offer, stop)

    run_interruptible(interrupts, work())


def _address(text: str) -> str:
    """Return an address as Dask takes it.

    Raises:
        UsageError: it is none.
    """
    try:
        address = ip_address(text)
    except ValueError as error:
        raise UsageError(
            f"--listen {text}: not an IP address", "write that of one interface, like 192.168.1.20"
        ) from error
    return f"[{address}]" if address.version == 6 else str(address)


def _say_offer(devices: Collection[str]) -> None:
    if devices:
        say(f"offering {', '.join(devices)}; to end: Ctrl-C")
    else:
        say("no robot is near; looking again every 30 s")
