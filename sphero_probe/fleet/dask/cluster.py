"""What a client needs to know of a scheduler and its workers."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any, Final

from distributed import Client

from sphero_probe.errors import ConnectionFailedError, RobotNotFoundError
from sphero_probe.fleet.dask.messages import device_of
from sphero_probe.transports.base import HARDWARE_ADDRESS

UNREACHED: Final = (OSError, TimeoutError, ValueError, TypeError, RuntimeError)
"""What Dask raises where a scheduler cannot be reached; a TLS configuration gives the last three."""
_START: Final = 10.0
"""Seconds to reach the scheduler."""


def unreached(scheduler: str, error: Exception) -> ConnectionFailedError:
    """Return what to raise where a scheduler cannot be reached.

    Args:
        scheduler: its address.
        error: what Dask raised, one of ``UNREACHED``.
    """
    if isinstance(error.__cause__, UNREACHED):
        return unreached(scheduler, error.__cause__)
    if isinstance(error, OSError | TimeoutError):
        return ConnectionFailedError(
            f"cannot reach the scheduler {scheduler}",
            "is it running, with TLS if its address begins with tls://? To start one: dask scheduler",
        )
    return ConnectionFailedError(
        f"cannot use the scheduler {scheduler}: {error}", "check the TLS settings of Dask"
    )


@asynccontextmanager
async def open_client(scheduler: str) -> AsyncIterator[Client]:
    """Connect to a scheduler.

    Args:
        scheduler: ``tcp://HOST:PORT`` or ``tls://HOST:PORT``.

    Raises:
        ConnectionFailedError: it cannot be reached.
    """
    client = Client(scheduler, asynchronous=True, set_as_default=False, timeout=_START, name="sphero-probe")
    try:
        await client
    except UNREACHED as error:
        await client.close(timeout=0)
        raise unreached(scheduler, error) from error
    async with client:
        yield client


async def offered_by(client: Client) -> set[str]:
    """Return the resources that the workers of a scheduler have to offer now.

    Raises:
        ConnectionFailedError: the scheduler is gone.
    """
    scheduler: Any = client.scheduler
    try:
        told = await scheduler.identity(n_workers=-1)
    except (OSError, TimeoutError) as error:
        raise ConnectionFailedError(f"the scheduler is gone: {error}") from error
    workers = told["workers"].values()
    return {name for worker in workers for name, number in worker["resources"].items() if number >= 1}


async def offered_robots(scheduler: str) -> list[str]:
    """Return the robots that workers offer by name, in order; one without a name of its own is left out.

    Args:
        scheduler: its address.

    Raises:
        ConnectionFailedError: it cannot be reached.
    """
    async with open_client(scheduler) as client:
        devices = map(device_of, await offered_by(client))
        return sorted(device for device in devices if device and not HARDWARE_ADDRESS.fullmatch(device))


class Patience:
    """How long to wait for a worker that reaches a robot."""

    def __init__(self, resource: str, seconds: float) -> None:
        self._resource, self._seconds = resource, seconds
        self.begin()

    def begin(self) -> None:
        """Wait from now on."""
        self._since = asyncio.get_running_loop().time()

    def check(self, offered: set[str]) -> None:
        """Go on waiting if a worker reaches the robot, or the time is not up.

        Raises:
            RobotNotFoundError: the time is up.
        """
        if self._resource in offered:  # the task waits for a place on its adapter
            self.begin()
        elif asyncio.get_running_loop().time() - self._since > self._seconds:
            raise RobotNotFoundError(
                f"no worker reaches {device_of(self._resource)}; waited {self._seconds:g} s",
                "near the robot, run: sphero-probe fleet worker --scheduler …",
            )
