"""Commands that only a header names, or whose meaning is unknown, are not sent unless they are allowed."""

from typing import Final

import pytest

from sphero_probe.link.link import Link
from sphero_probe.link.policy import Consent, Policy
from sphero_probe.probing.dry_run import planned_probes
from sphero_probe.probing.engine import Engine
from sphero_probe.probing.finding import Finding, Outcome
from sphero_probe.probing.plan import Plan, sweep
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Request, Role
from sphero_probe.simulator import FakeRobot, parse_settings
from sphero_probe.transports.fake import FakeTransport
from tests.support.virtual_clock import run as run_on_virtual_clock

MAKERS_NAMES: Final = {
    *((0x01, cid) for cid in (0x05, 0x06)),
    *((0x02, cid) for cid in (0x45, 0x71, 0x72, 0x73, 0x75, 0x90, 0xF0, 0xF1)),
}
"""RKCommandList.h of the maker's iOS SDK: IsPageBlank, EraseUserConfig, SetFactoryDeviceMode, …"""
UNKNOWN_ON_MINI: Final = {(0x13, 0x1E)}


class RecordingRobot(FakeRobot):
    """A fake robot that keeps what reaches it."""

    heard = b""

    def hear(self, data: bytes, *, now: float) -> None:
        self.heard += data
        super().hear(data, now=now)


def swept(settings: str, dids: tuple[int, ...]) -> tuple[set[tuple[int, int]], list[Finding]]:
    """Sweep devices with the usual consent; return the pairs that reached the robot, and the findings."""
    robot = RecordingRobot(parse_settings(settings))
    codec = CODECS[robot.model.generation]
    policy = Policy(codec.generation, robot.model, Consent(), (robot.name,))
    target = 0x11 if robot.model.addressed else None
    findings: list[Finding] = []

    async def work() -> None:
        async with Link(FakeTransport(robot), codec, policy) as link:
            plan = Plan("sweep", "", [list(sweep(dids, range(0x100)))])
            records = [record async for record in Engine(plan, link, robot.name, target).records()]
        findings.extend(record for record in records if isinstance(record, Finding))

    run_on_virtual_clock(work())
    packets = codec.decoder(Role.ROBOT).feed(robot.heard)
    return {packet.command[:2] for packet in packets if isinstance(packet, Request)}, findings


@pytest.mark.parametrize(
    ("settings", "dids", "never", "control"),
    [
        pytest.param("sphero", (0x01, 0x02), MAKERS_NAMES, (0x02, 0x07), id="Sphero"),
        pytest.param("ollie", (0x01, 0x02), MAKERS_NAMES, (0x02, 0x07), id="Ollie"),
        pytest.param("mini", (0x13,), UNKNOWN_ON_MINI, (0x13, 0x10), id="Mini"),
    ],
)
def test_a_default_sweep_of_their_devices_does_not_send_them(
    settings: str, dids: tuple[int, ...], never: set[tuple[int, int]], control: tuple[int, int]
) -> None:
    pairs, findings = swept(settings, dids)
    assert control in pairs
    assert not never & pairs
    skipped = {finding.command[:2]: finding for finding in findings if finding.outcome is Outcome.SKIPPED}
    assert never <= skipped.keys()
    assert all(skipped[pair].knowledge for pair in never)
    if settings != "mini":
        between = {(0x02, cid) for cid in (0x6F, 0x70, 0x74, 0x76, 0x77, 0x8E, 0x91, 0x92, 0xEE, 0xEF, 0xF3)}
        assert not between & pairs  # an unknown neighbour of an erasing command gets its class


@pytest.mark.parametrize(
    ("settings", "dids", "never"),
    [
        pytest.param("sphero", (0x01, 0x02), MAKERS_NAMES, id="Sphero"),
        pytest.param("mini", (0x13,), UNKNOWN_ON_MINI, id="Mini"),
    ],
)
def test_a_dry_run_blocks_them_too(settings: str, dids: tuple[int, ...], never: set[tuple[int, int]]) -> None:
    model = parse_settings(settings).model
    plan = Plan("sweep", "", [list(sweep(dids, range(0x100)))])
    planned = {
        probe.command[:2]: probe for probe in planned_probes(plan, model.generation, model, Consent(), None)
    }
    assert all(planned[pair].blocked for pair in never)
    assert not all(probe.blocked for probe in planned.values())
