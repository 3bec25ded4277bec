"""Run an action on the robots that the workers of a Dask scheduler reach. ``DaskFleet`` is the main class."""

import asyncio
from collections.abc import AsyncGenerator, Callable, Mapping, Sequence
from contextlib import aclosing, suppress
from pathlib import Path
from typing import Any, Final, NamedTuple
from uuid import uuid4

from distributed import Client, Future
from distributed.protocol.pickle import dumps
from distributed.scheduler import KilledWorker

from sphero_probe import __version__
from sphero_probe.errors import (
    ConnectionFailedError,
    IncompleteError,
    SpheroProbeError,
)
from sphero_probe.fleet.action import Action
from sphero_probe.fleet.dask.cluster import Patience, offered_by, open_client
from sphero_probe.fleet.dask.kept import KeptRun
from sphero_probe.fleet.dask.messages import (
    PLACES,
    Assignment,
    Begin,
    Downward,
    Grown,
    Hello,
    Leave,
    Stop,
    Upward,
    Written,
    pack,
    resource_of,
    unpack,
)
from sphero_probe.fleet.dask.station import task_function
from sphero_probe.fleet.fleet import Fleet, JournalFor
from sphero_probe.fleet.on_robot import RobotOptions, status_of
from sphero_probe.fleet.plans import PlanAction
from sphero_probe.fleet.records import Ended, FleetRecord, Step
from sphero_probe.fleet.robots import FleetRobot

WAIT: Final = 60.0
"""Seconds to wait for a worker that reaches a robot, unless told otherwise."""
_LOOK: Final = 1.0
"""Seconds between two looks at what the workers offer."""
_WAITING: Final = "wait for a host that reaches it"


class _WorkerLost(NamedTuple):
    """The scheduler has lost a worker.

    Attributes:
        worker: its address in Dask.
    """

    worker: str


class _Stopped(NamedTuple):
    """The user wants the fleet to stop."""


_News = Hello | Grown | _WorkerLost | _Stopped


class DaskFleet(Fleet):
    """Runs one action on many robots, each on a worker that reaches it; otherwise like ``Fleet``."""

    def __init__(
        self,
        robots: Sequence[FleetRobot],
        action: Action,
        journal_for: JournalFor,
        *,
        scheduler: str,
        wait: float = WAIT,
        options: RobotOptions | None = None,
        stop: asyncio.Event | None = None,
        finished: Mapping[str, Path] | None = None,
    ) -> None:
        """Prepare a run; nothing is connected yet.

        Args:
            robots: which.
            action: what to do on each.
            journal_for: returns the journal of one robot.
            scheduler: the address of the Dask scheduler.
            wait: seconds to wait for a worker that reaches a robot.
            options: how to connect, and what may be sent.
            stop: as the attribute.
            finished: robot name -> journal of a complete run; its records are yielded, and nothing is sent.
        """
        super().__init__(robots, action, journal_for, options=options, stop=stop, finished=finished)
        self._scheduler, self._wait = scheduler, wait
        self._topic = f"sphero-probe-{uuid4().hex}"
        self._inboxes: dict[str, asyncio.Queue[_News]] = {}
        self._offered: set[str] = set()
        self._client: Client | None = None

    async def records(self) -> AsyncGenerator[tuple[FleetRobot, FleetRecord], None]:
        """Yield what happens on each robot, as ``Fleet.records`` does.

        Raises:
            ConnectionFailedError: the scheduler cannot be reached.
        """
        async with open_client(self._scheduler) as client:
            self._client = client
            client.subscribe_topic(self._topic, self._hear)
            client.subscribe_topic("all", self._hear_cluster)
            self._offered = await offered_by(client)
            watchers = [
                asyncio.create_task(self._watch_offers(client), name="offers watcher"),
                asyncio.create_task(self._watch_stop(), name="stop watcher"),
            ]
            try:
                async with aclosing(super().records()) as records:
                    async for robot, record in records:
                        yield robot, record
            finally:
                for watcher in watchers:
                    watcher.cancel()
                await asyncio.gather(*watchers, return_exceptions=True)
                client.unsubscribe_topic("all")
                client.unsubscribe_topic(self._topic)

    async def _on_robot(
        self, robot: FleetRobot, on_step: Callable[[str], None]
    ) -> AsyncGenerator[FleetRecord, None]:
        del on_step
        journal = self._journal_for(robot)
        try:
            with journal:
                kept = KeptRun(journal)
                async with aclosing(self._follow(robot, kept)) as records:
                    async for record in records:
                        if isinstance(record, Ended):
                            yield record._replace(journal=journal.place)
                        elif kept.is_news(record):
                            yield record
        except SpheroProbeError as error:
            yield Ended(status_of(error, reached=False), str(error), error.hint, journal.place)

    async def _follow(self, robot: FleetRobot, kept: KeptRun) -> AsyncGenerator[FleetRecord, None]:
        """Have the robot's task executed, as often as its worker dies; yield what the workers tell.

        Raises:
            RobotNotFoundError: no worker reaches the robot.
            IncompleteError: the fleet was stopped, or the scheduler is gone.
            SpheroProbeError: a worker cannot execute it.
        """
        inbox = self._inboxes[robot.device] = asyncio.Queue()
        running: Hello | None = None
        patience = Patience(resource_of(robot.device), self._wait)
        yield Step(_WAITING)
        future = self._submit(robot)
        try:
            while True:
                if running is None and self.stop.is_set():
                    raise IncompleteError("stopped while it waited for a host")
                news = await _next(inbox)
                match news:
                    case Hello():
                        if running is None or news.execution != running.execution:
                            self._check_repeatable(kept)
                            yield Step(f"on {news.host}")
                        running = news
                        await self._tell(running, Begin(running.execution, kept.place, kept.lines))
                    case Grown() if running and news.execution == running.execution:
                        kept.append(news.lines)
                        if news.awaited:
                            await self._tell(running, Written(running.execution, news.number))
                        for record in news.records:
                            if isinstance(record, Ended):
                                running = None
                                yield record
                                return
                            yield record
                    case _WorkerLost() if running and news.worker == running.worker:
                        yield Step(f"the worker on {running.host} is gone; {_WAITING}")
                        running = None
                        patience.begin()
                    case _Stopped() if running:
                        await self._tell(running, Stop(running.execution))
                    case None:
                        future = await self._still_pending(future, robot)
                        if running is None:
                            patience.check(self._offered)
        finally:
            del self._inboxes[robot.device]
            with suppress(OSError, IncompleteError):
                if running:
                    await self._tell(running, Leave(running.execution))
                await future.cancel()

    def _check_repeatable(self, kept: KeptRun) -> None:
        """Check that another worker may go on; a plan goes on where it was, other actions begin again.

        Raises:
            IncompleteError: it would send again what may have been executed.
        """
        if not isinstance(self._action, PlanAction) and kept.may_have_executed:
            raise IncompleteError("its worker died after commands were sent, which are not sent again")

    def _submit(self, robot: FleetRobot) -> "Future[None]":
        assert self._client is not None
        client: Any = self._client  # its types know no functions that Dask awaits
        assignment = Assignment(self._topic, client.id, robot, self._action, self._options)
        future: Future[None] = client.submit(
            task_function(),
            __version__,
            dumps(assignment),
            key=f"sphero-probe-{uuid4().hex}",
            resources={resource_of(robot.device): 1, PLACES: 1},
            pure=False,
        )
        return future

    async def _still_pending(self, future: "Future[None]", robot: FleetRobot) -> "Future[None]":
        """Return the task that is to be executed: a new one if too many workers died on this one.

        Raises:
            SpheroProbeError: it has failed.
        """
        if future.status == "pending":
            return future
        if future.status == "error":
            error = await future.exception()
            if isinstance(error, KilledWorker):
                return self._submit(robot)
            raise error
        if future.status == "finished":
            raise IncompleteError("the worker has given up")
        raise IncompleteError("the scheduler is gone")

    async def _tell(self, running: Hello, message: Downward) -> None:
        """Send a message to a worker.

        Raises:
            IncompleteError: the scheduler is gone.
        """
        assert self._client is not None
        try:
            await self._client.log_event(running.inbox, pack(message))
        except OSError as error:
            raise IncompleteError(f"the scheduler is gone: {error}") from error

    def _hear(self, event: tuple[float, bytes]) -> None:
        """Take what a worker tells to the run of its robot."""
        with suppress(TypeError):
            message = unpack(event[1])
            if isinstance(message, Upward) and message.device in self._inboxes:
                self._inboxes[message.device].put_nowait(message)

    def _hear_cluster(self, event: tuple[float, Any]) -> None:
        news = event[1]
        if isinstance(news, dict) and news.get("action") == "remove-worker":
            self._tell_all(_WorkerLost(str(news.get("worker"))))

    def _tell_all(self, news: _News) -> None:
        for inbox in self._inboxes.values():
            inbox.put_nowait(news)

    async def _watch_stop(self) -> None:
        await self.stop.wait()
        self._tell_all(_Stopped())

    async def _watch_offers(self, client: Client) -> None:
        while True:
            await asyncio.sleep(_LOOK)
            with suppress(ConnectionFailedError):
                self._offered = await offered_by(client)


async def _next(inbox: asyncio.Queue[_News]) -> _News | None:
    """Return what comes next, None if nothing does for a while."""
    with suppress(TimeoutError):
        async with asyncio.timeout(_LOOK):
            return await inbox.get()
    return None
