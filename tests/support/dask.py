"""A Dask scheduler in this process, and workers: in this process, or as processes that can be killed."""

import asyncio
import logging
import os
import signal
import subprocess
import sys
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from contextlib import asynccontextmanager, contextmanager
from typing import Any

from sphero_probe.link.exchange import Answered
from sphero_probe.probing.finding import Finding

HERE = "127.0.0.1"


@asynccontextmanager
async def scheduler() -> AsyncIterator[str]:
    """Run a scheduler in this process; the value is its address."""
    async with serving() as served:
        yield served.address


@asynccontextmanager
async def serving() -> AsyncIterator[Any]:
    """Run a scheduler in this process; the value is Dask's ``Scheduler``."""
    from distributed import Scheduler

    logging.getLogger("distributed").setLevel(logging.CRITICAL + 1)
    async with Scheduler(
        host="127.0.0.1", port=0, dashboard=False, dashboard_address="127.0.0.1:0"
    ) as served:
        yield served


@asynccontextmanager
async def workers_here(address: str, *offers: Sequence[str]) -> AsyncIterator[list[asyncio.Event]]:
    """Run workers in this process, each with the robots that it offers, or scanning; the values stop them."""
    from sphero_probe.fleet.dask.worker import WorkerOptions, run_worker

    stops = [asyncio.Event() for _ in offers]
    ready = asyncio.Semaphore(0)

    def offered(_: object) -> None:
        ready.release()

    tasks = [
        asyncio.create_task(
            run_worker(
                WorkerOptions(address, HERE, tuple(offer), (), 4, 0.5), lambda _: ready.release(), stop
            )
        )
        for offer, stop in zip(offers, stops, strict=True)
    ]
    for _ in tasks:
        await ready.acquire()
    try:
        yield stops
    finally:
        for stop in stops:
            stop.set()
        await asyncio.gather(*tasks)


_SERVER = """
import asyncio, logging, os, sys
from sphero_probe.fleet.dask.worker import WorkerOptions, run_worker
from sphero_probe.transports import fake
class Appended(fake._Lines):
    def __init__(self, path):
        super().__init__(path)
        self._mode = "ab"  # the ledger of a robot grows on, whichever worker connects to it
fake._Lines = Appended
scheduler, *devices = sys.argv[1:]
logging.getLogger("distributed").setLevel(logging.CRITICAL + 1)
options = WorkerOptions(scheduler, "127.0.0.1", tuple(devices), (), 16, 1.0)
for line in sys.stdin:
    child = os.fork()
    if not child:
        try:
            asyncio.run(run_worker(options, lambda offered: None, asyncio.Event()))
        finally:
            os._exit(1)
    print(child, flush=True)
"""
"""Has everything imported, and forks a worker for each line that it reads: starting one takes little time."""


class Workers:
    """Starts and kills workers.

    Attributes:
        running: their process ids.
    """

    def __init__(self, server: "subprocess.Popen[str]") -> None:
        self.running: list[int] = []
        self._server = server

    def start(self) -> None:
        assert self._server.stdin
        assert self._server.stdout
        self._server.stdin.write("\n")
        self._server.stdin.flush()
        self.running.append(int(self._server.stdout.readline()))

    def kill(self, worker: int) -> None:
        self.running.remove(worker)
        os.kill(worker, signal.SIGKILL)


@contextmanager
def workers(scheduler: str, devices: Sequence[str], number: int) -> Iterator[Workers]:
    """Start so many workers that offer these robots; all are killed at the end."""
    server = subprocess.Popen(
        [sys.executable, "-c", _SERVER, scheduler, *devices],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    with server:
        started = Workers(server)
        try:
            for _ in range(number):
                started.start()
            yield started
        finally:
            for worker in list(started.running):
                started.kill(worker)
            server.kill()


def said(findings: Sequence[Finding]) -> list[tuple[object, ...]]:
    """What findings say, without what depends on when each command was sent."""
    return [
        (
            *(finding.number, finding.command, finding.outcome, finding.confidence, finding.risk),
            *(finding.note, type(finding.exchange)),
            finding.exchange.response._replace(seq=0) if isinstance(finding.exchange, Answered) else None,
        )
        for finding in findings
    ]


async def until(reached: Callable[[], bool]) -> None:
    """Wait until other processes have come so far.

    Raises:
        TimeoutError: they do not.
    """
    async with asyncio.timeout(20):
        while not reached():  # noqa: ASYNC110 - files tell only those who ask
            await asyncio.sleep(0.05)
