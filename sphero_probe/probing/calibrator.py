"""Decide which nodes and devices must be calibrated before the probes of a stage, and calibrate them."""

from collections.abc import Callable, Collection, Container, Coroutine, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

from sphero_probe.link.wrong_lengths import IMPOSSIBLE_CIDS, is_wrong_length
from sphero_probe.probing.executions import Executions
from sphero_probe.probing.finding import Note
from sphero_probe.probing.health import HealthCheck
from sphero_probe.probing.notes import calibration_note, evidence_note, node_name
from sphero_probe.probing.plan import Probe
from sphero_probe.probing.prober import FilledProbe, Prober
from sphero_probe.protocol.packets import Command


class Wanted(NamedTuple):
    """The nodes and devices to calibrate.

    Attributes:
        nodes: address byte -> devices of that node that will be probed.
        devices: node and device id of each device.
    """

    nodes: Mapping[int | None, Collection[int]]
    devices: Sequence[tuple[int | None, int]]


class Calibrator:
    """Calibrates the nodes and devices of one run, each once.

    Attributes:
        filled: number -> probes that ``find_wanted`` filled in.
    """

    def __init__(
        self, prober: Prober, executions: Executions, health: HealthCheck | None = None, *, verify: bool
    ) -> None:
        self.filled: dict[int, FilledProbe] = {}
        self._prober = prober
        self._executions = executions
        self._health = health
        self._verify = verify
        self._noted: set[int | None] = set()

    def find_wanted(
        self,
        probes: Sequence[Probe],
        first: int,
        settled: Container[int],
        dead: Container[int | None] = (),
    ) -> Wanted:
        """Return which nodes and devices must be measured before these probes.

        Documented commands at their own length need no measurement, except on the usual node of a run that
        verifies its findings. For each node, probes are filled in until one depends on its length checks.

        Args:
            probes: of one stage.
            first: number of the first.
            settled: numbers of probes that will not be sent.
            dead: nodes that were given up.
        """
        nodes: dict[int | None, set[int]] = {}
        dids: dict[int | None, set[int]] = {}
        for number, probe in enumerate(probes, first):
            command = probe.command
            if number in settled:
                continue
            target = self._prober.target if command.target is None else command.target
            if target in dead:
                continue
            among = dids.setdefault(target, set())
            if command.cid not in IMPOSSIBLE_CIDS:
                among.add(command.did)
            if target not in nodes:
                filled = self.filled[number] = self._prober.fill(number, probe)
                verified = self._verify and target == self._prober.target
                if verified or is_wrong_length(filled.command, filled.knowledge):
                    nodes[target] = among
        keys = [(target, did) for target, among in nodes.items() for did in sorted(among)]
        return Wanted(nodes, [key for key in keys if key not in self._prober.devices])

    async def measure(self, wanted: Wanted) -> set[int | None]:
        """Measure nodes and devices; return the nodes that answer nothing.

        Raises:
            LinkLostError: the link was lost.
        """
        for target, dids in wanted.nodes.items():
            if target not in self._prober.profiles:
                devices = [key for key in wanted.devices if key[0] == target]
                await self._prober.calibrations.measure(target, dids, devices)
            self._take(self._prober.profiles[target].executed)
        mute = {target for target, profile in self._prober.profiles.items() if profile.is_mute}
        devices = [key for key in wanted.devices if key[0] not in mute]
        nodes = [target for target in wanted.nodes if target not in mute]
        asking: list[Callable[[], Coroutine[Any, Any, object]]] = []
        asking += [partial(self._learn_health, target) for target in nodes]
        asking += [partial(self._prober.calibrations.ask_codes, target) for target in nodes]
        await self._prober.calibrations.finish(devices, asking)
        for key in devices:
            self._take(self._prober.devices[key].executed)
        await self._executions.report()
        return mute & wanted.nodes.keys()

    def _take(self, executed: Command | None) -> None:
        """Report a command that accepted a wrong length, once."""
        if executed and executed not in self._executions.commands:
            self._executions.take(executed)

    @property
    def strictness(self) -> dict[str, str]:
        """Node name -> how strictly it checks lengths, for the nodes that were measured."""
        robot = self._prober.link.policy.robot
        return {
            node_name(target, robot): profile.strictness.value
            for target, profile in self._prober.profiles.items()
        }

    async def _learn_health(self, target: int | None) -> None:
        if self._health and not self._health.knows(target):
            await self._health.passes(target)

    def notes(self, wanted: Wanted) -> list[Note]:
        """Return the notes on nodes and devices that were just measured."""
        robot = self._prober.link.policy.robot
        notes: list[Note] = []
        for target in wanted.nodes:
            profile = self._prober.profiles.get(target)
            if profile and target not in self._noted:
                self._noted.add(target)
                notes.append(calibration_note(profile, robot))
        for target in dict.fromkeys(target for target, _ in wanted.devices):
            devices = [found for key, found in self._prober.devices.items() if key[0] == target]
            if any(device.asked for device in devices):
                notes.append(evidence_note(target, devices, robot))
        return notes
