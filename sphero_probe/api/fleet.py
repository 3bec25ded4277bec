"""Many robots at once: ``Fleet``, and its runs."""

import asyncio
from collections.abc import AsyncGenerator, AsyncIterator, Awaitable, Callable, Iterable
from contextlib import aclosing
from pathlib import Path
from typing import TypeVar

from sphero_probe.api.arguments import Ids, ids_of, ids_text, node_text
from sphero_probe.api.connecting import consent_of, tolerances_of
from sphero_probe.fleet.action import Action
from sphero_probe.fleet.adapters import PER_ADAPTER, Adapters, adapter_names
from sphero_probe.fleet.fleet import Fleet as Runner
from sphero_probe.fleet.health import HealthAction
from sphero_probe.fleet.on_robot import FleetConsent, RobotOptions
from sphero_probe.fleet.plans import PlanAction, Subject
from sphero_probe.fleet.records import FleetRecord
from sphero_probe.fleet.results import RobotResult
from sphero_probe.fleet.robots import FleetRobot, fleet_of
from sphero_probe.fleet.robots_file import read_robots
from sphero_probe.link.policy import Consent
from sphero_probe.probing.finding import Finding
from sphero_probe.probing.packed_probes import PackedProbes
from sphero_probe.probing.plan import Plan
from sphero_probe.probing.plan import sweep as probes_of_sweep
from sphero_probe.probing.plans.discovery import discovery
from sphero_probe.runs.resume import RunJournal
from sphero_probe.session.addressing import address_of

_Item = TypeVar("_Item")


class Fleet:
    """Many robots, on which one action runs at once; nothing is connected before a run is iterated over.

    Attributes:
        robots: in the order in which they were given.
    """

    def __init__(
        self,
        robots: Iterable[str] | Path,
        *,
        consent: Consent | Iterable[str] = (),
        confirmed: Iterable[str] = (),
        timeout: float | None = None,
        connect_timeout: float = 10.0,
        adapters: Iterable[str] = (),
        per_adapter: int = PER_ADAPTER,
        tolerate: Iterable[str] = (),
    ) -> None:
        """Name the robots.

        Args:
            robots: addresses, each as ``connect`` takes it; or the path of a fleet file.
            consent: what may be sent to every robot, as ``connect`` takes it.
            confirmed: the names of the robots for which the class ``brick`` is confirmed.
            timeout: seconds until a command counts as silent; None measures it.
            connect_timeout: seconds for scanning, and again for each step of connecting.
            adapters: the Bluetooth adapters to use in turn; empty for all.
            per_adapter: robots connected through one adapter at a time.
            tolerate: in what an answer may differ and still count, as ``connect`` takes it.

        Raises:
            UsageError: an address, a risk class or a tolerance makes no sense, or a robot is named twice.
            BadInputFileError: the fleet file is not valid.
        """
        self.robots = read_robots(robots) if isinstance(robots, Path) else fleet_of(robots)
        allowed = consent_of(consent)
        names = frozenset(confirmed) | ({allowed.confirmed} if allowed.confirmed else frozenset())
        self._options = RobotOptions(
            FleetConsent(allowed.allowed, names), connect_timeout, timeout, tolerances_of(tolerate)
        )
        self._adapters = tuple(adapters)
        self._per_adapter = per_adapter

    def sweep(
        self,
        did: Ids,
        cid: Ids = range(256),
        *,
        target: str | int | None = None,
        payload: bytes | None = None,
        journal: bool = False,
    ) -> "FleetRun":
        """Return a sweep of each robot; it runs while you iterate over it.

        Args:
            did: device ids, as ``ConnectedRobot.sweep`` takes them.
            cid: command ids, likewise.
            target: the node, None for each robot's usual one.
            payload: send exactly these bytes with every command.
            journal: keep a journal of each robot in the folder of runs.
        """

        def plan_for(subject: Subject) -> tuple[Plan, dict[str, str]]:
            dids = ids_of(did, subject.generation, devices=True)
            cids = ids_of(cid, subject.generation, devices=False)
            options = {"did": ids_text(dids), "cid": ids_text(cids)}
            if payload is not None:
                options["payload"] = payload.hex()
            probes = PackedProbes(probes_of_sweep(dids, cids, payload=payload))
            return Plan("sweep", f"DID {options['did']}", [probes]), options

        return self._running(PlanAction("sweep", plan_for, node_text(target)), journal=journal)

    def discover(
        self, did: Ids = range(256), *, lengths: bool = False, values: bool = False, journal: bool = False
    ) -> "FleetRun":
        """Return the plan that maps each robot whole; it runs while you iterate over it.

        Args:
            did: the device ids to look at.
            lengths: also find out which lengths a command accepts, if consent covers executing it.
            values: also try other values, if one was rejected.
            journal: keep a journal of each robot in the folder of runs.
        """

        def plan_for(subject: Subject) -> tuple[Plan, dict[str, str]]:
            generation = subject.generation
            dids = ids_of(did, generation, devices=True)
            plan = discovery(generation, subject.target, dids=dids, lengths=lengths, values=values)
            flags = {"lengths": str(int(lengths)), "values": str(int(values))}
            return plan, {"did": ids_text(dids)} | flags

        return self._running(PlanAction("discover", plan_for), journal=journal)

    def health(self) -> "FleetRun":
        """Return a check of each robot, which has no findings: its ``results`` have firmware and battery."""
        return self._running(HealthAction(), journal=False)

    def _running(self, action: Action, *, journal: bool) -> "FleetRun":
        async def runner(stop: asyncio.Event) -> Runner:
            names = self._adapters
            if not names and any(address_of(robot.device).scheme == "ble" for robot in self.robots):
                names = await adapter_names()
            return Runner(
                self.robots,
                action,
                lambda _: RunJournal(action.command, off=not (journal and action.command)),
                options=self._options,
                adapters=Adapters(names or ("",), self._per_adapter),
                stop=stop,
            )

        return FleetRun(self.robots, runner)


class FleetRun:
    """A run on each robot of a fleet, which runs while you iterate over it, once.

    ``async for robot, finding in run`` yields each finding as soon as it is certain. A robot that fails does
    not stop the others: ``results`` says how each ended. Leaving the loop ends every run a moment later.

    Attributes:
        results: robot name -> firmware, battery, counts, and how its run ended, or None while it runs.
    """

    def __init__(
        self, robots: Iterable[FleetRobot], runner: Callable[[asyncio.Event], Awaitable[Runner]]
    ) -> None:
        self.results = {robot.name: RobotResult(robot) for robot in robots}
        self._runner = runner
        self._stop = asyncio.Event()
        self._started = False

    def stop(self) -> None:
        """Stop sending; the loop ends after the probes in flight, and the results are incomplete."""
        self._stop.set()

    def __aiter__(self) -> AsyncIterator[tuple[FleetRobot, Finding]]:
        """Run the action and yield each robot with its findings.

        Raises:
            RuntimeError: the run was started before.
        """
        return self._iterate(lambda record: record if isinstance(record, Finding) else None)

    def records(self) -> AsyncIterator[tuple[FleetRobot, FleetRecord]]:
        """Run the action and yield everything: steps, findings, notes, batteries, and how each robot ended.

        Raises:
            RuntimeError: the run was started before.
        """
        return self._iterate(lambda record: record)

    async def collect(self) -> dict[str, RobotResult]:
        """Run the action to its end and return ``results``."""
        async for _ in self.records():
            pass
        return self.results

    async def _iterate(
        self, wanted: Callable[[FleetRecord], _Item | None]
    ) -> AsyncGenerator[tuple[FleetRobot, _Item], None]:
        if self._started:
            raise RuntimeError("this run has been started: make a new one with fleet.sweep()")
        self._started = True
        runner = await self._runner(self._stop)
        async with aclosing(runner.records()) as records:
            async for robot, record in records:
                self.results[robot.name].add(record)
                item = wanted(record)
                if item is not None:
                    yield robot, item
