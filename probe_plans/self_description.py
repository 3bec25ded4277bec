"""The devices and commands that the robot claims to have: 10/05 lists devices, 10/06 the commands of each."""

from collections.abc import Iterator, Sequence

from sphero_probe import Answered, Command, Finding, Plan, Probe

SUPPORTED_DIDS = Command(0x10, 0x05)
SUPPORTED_CIDS = 0x06


def ask_each_device(findings: Sequence[Finding]) -> Iterator[Probe]:
    """Ask for the commands of every device that the robot listed."""
    for finding in findings:
        exchange = finding.exchange
        if finding.command[:2] == SUPPORTED_DIDS[:2] and isinstance(exchange, Answered):
            for did in exchange.response.payload:
                yield Probe(Command(0x10, SUPPORTED_CIDS, bytes([did]), finding.command.target))


PLAN = Plan(
    name="self_description",
    summary="the devices and commands that the robot itself claims to have",
    stages=[[Probe(SUPPORTED_DIDS)], ask_each_device],
)
