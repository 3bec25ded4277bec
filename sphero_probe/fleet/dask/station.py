"""Execute the tasks of fleets in the process of a worker. ``Station`` does; Dask calls ``run_assignment``."""

import asyncio
import platform
import zlib
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import aclosing, asynccontextmanager, suppress
from typing import Any, Final
from uuid import uuid4

from distributed import Reschedule, Worker, WorkerPlugin, get_worker
from distributed.protocol.pickle import loads

from sphero_probe import __version__
from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import UnavailableError
from sphero_probe.fleet.adapters import Adapters
from sphero_probe.fleet.dask.cluster import open_client
from sphero_probe.fleet.dask.execution import GRACE, Execution
from sphero_probe.fleet.dask.journal import SentRunJournal
from sphero_probe.fleet.dask.messages import Assignment, Hello, Upward, pack, unpack
from sphero_probe.fleet.on_robot import run_on_robot
from sphero_probe.fleet.records import Ended, Status, Step

_HARMLESS: Final = frozenset({Risk.READ, Risk.PROBE})


def task_function() -> Callable[[str, bytes], Coroutine[Any, Any, None]]:
    """Return the function that clients submit; it takes the version of this program, and an assignment.

    As a local function, it travels by value: the scheduler, which unpickles it, need not know this program.
    """

    async def execute(version: str, packed: bytes) -> None:
        from sphero_probe.fleet.dask.station import run_assignment  # noqa: PLC0415 - runs in the worker

        await run_assignment(version, packed)

    return execute


async def run_assignment(version: str, packed: bytes) -> None:
    """Execute a task in the process of a worker.

    Args:
        version: of the client's program.
        packed: what to do, an ``Assignment``.

    Raises:
        UnavailableError: ``sphero-probe fleet worker`` has not started this worker, or has another version.
    """
    station = get_worker().plugins.get(Station.name)
    if not isinstance(station, Station):
        raise UnavailableError("this worker reaches no robots", "start it with: sphero-probe fleet worker")
    if version != __version__:
        raise UnavailableError(
            f"the worker on {platform.node()} has sphero-probe {__version__}, not {version}",
            "install the same version on every host",
        )
    await station.execute(loads(packed))


class Station(WorkerPlugin):
    """Executes the tasks of one worker; they share its adapters and its event loop.

    Attributes:
        name: of the plugin in Dask.
        idle: set while no task is being executed.
    """

    name = "sphero-probe"

    def __init__(self, adapters: Adapters) -> None:
        self.idle = asyncio.Event()
        self.idle.set()
        self._adapters = adapters
        self._inbox = f"{self.name}-{uuid4().hex}"
        self._running: dict[str, tuple[str, Execution]] = {}
        self._worker: Worker | None = None

    @asynccontextmanager
    async def listening(self, worker: Worker) -> AsyncIterator[None]:
        """Listen to clients, and to which of them leave, while the block lasts.

        Args:
            worker: has joined its scheduler.

        Raises:
            ConnectionFailedError: the scheduler cannot be reached.
        """
        self._worker = worker
        async with open_client(worker.scheduler.address) as client:
            client.subscribe_topic(self._inbox, self._hear)
            client.subscribe_topic("all", self._hear_cluster)
            yield

    async def teardown(self, worker: Worker) -> None:
        """End every run; Dask calls it when the worker ends, also because its scheduler is gone."""
        del worker
        for _, execution in self._running.values():
            execution.end()

    async def leave(self) -> None:
        """End every run cleanly, so that other workers go on with it."""
        for _, execution in self._running.values():
            execution.leave()
        with suppress(TimeoutError):
            async with asyncio.timeout(GRACE):
                await self.idle.wait()

    async def execute(self, assignment: Assignment) -> None:
        """Do an assignment, and tell its client what happens.

        Raises:
            Reschedule: this worker ends, and Dask is to find another one.
        """
        assert self._worker is not None
        worker, name = self._worker, uuid4().hex

        def tell(message: Upward) -> None:
            worker.log_event(assignment.topic, pack(message))

        hello = Hello(assignment.robot.device, name, worker.address, platform.node(), self._inbox)
        allowed = assignment.options.consent.allowed
        execution = Execution(hello, tell, at_once=not allowed <= _HARMLESS)
        try:
            async with execution.limit:
                self._running[name] = assignment.client, execution
                self.idle.clear()
                await self._run(assignment, execution)
        except TimeoutError:
            if not execution.limit.expired():
                raise
        finally:
            self._running.pop(name, None)
            if not self._running:
                self.idle.set()

    async def _run(self, assignment: Assignment, execution: Execution) -> None:
        begin = await execution.permission()
        if begin is None:
            raise Reschedule
        action = assignment.action
        held = zlib.decompress(begin.journal)
        journal = SentRunJournal(action.command, begin.place, held, execution.add_line, execution.written)

        def on_step(text: str) -> None:
            execution.add_record(Step(text))

        arguments = (action, assignment.options, self._adapters, journal, execution.stop, on_step)
        async with aclosing(run_on_robot(assignment.robot, *arguments)) as records:
            async for record in records:
                if execution.leaving and isinstance(record, Ended) and record.status is not Status.DONE:
                    execution.flush()
                    raise Reschedule
                execution.add_record(record)
                await execution.room()
        execution.flush()

    def _hear(self, event: tuple[float, bytes]) -> None:
        """Take a message to one of the executions."""
        with suppress(TypeError):
            message = unpack(event[1])
            if not isinstance(message, Upward) and message.execution in self._running:
                self._running[message.execution][1].hear(message)

    def _hear_cluster(self, event: tuple[float, Any]) -> None:
        """End the runs of a client that has left the scheduler, whatever the reason."""
        news = event[1]
        if isinstance(news, dict) and news.get("action") == "remove-client":
            for client, execution in list(self._running.values()):
                if client == news.get("client"):
                    execution.end()
