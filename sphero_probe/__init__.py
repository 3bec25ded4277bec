"""Map what a Sphero robot can do, from the terminal or from Python.

Everything that a script needs is here; five lines sweep the built-in robot::

    import asyncio
    import sphero_probe

    async def main():
        async with sphero_probe.connect("fake:bolt-plus") as robot:
            async for finding in robot.sweep(did=0x13):
                print(finding.name, finding.outcome)

    asyncio.run(main())

``sphero_probe.sync`` has the same without ``async``, for notebooks and lessons. ``sphero_probe.errors`` has
the exceptions. The names in ``__all__`` follow semantic versioning; every other module may change at any
time.

Importing this package imports nothing else: each name is loaded when it is used for the first time.
"""

__version__ = "0.1.0"

TYPE_CHECKING = False  # what typing has; importing it would double the time of importing this package
if TYPE_CHECKING:
    from sphero_probe import errors, sync
    from sphero_probe.api.answer import Answer
    from sphero_probe.api.connecting import connect, discover, scan
    from sphero_probe.api.decoding import DecodedPacket, decode
    from sphero_probe.api.notifications import Notifications
    from sphero_probe.api.result import Run, load_run
    from sphero_probe.api.robot import ConnectedRobot
    from sphero_probe.api.running import RunningPlan
    from sphero_probe.catalogue.risk import Risk
    from sphero_probe.link.exchange import Answered, Blocked, LateResponse, Silent
    from sphero_probe.link.policy import Consent
    from sphero_probe.probing.finding import Confidence, Finding, Heading, Note, Outcome, Summary
    from sphero_probe.probing.plan import Plan, Probe, sweep
    from sphero_probe.protocol.packets import (
        Command,
        Generation,
        Malformed,
        Notification,
        Request,
        Response,
    )
    from sphero_probe.transports.base import Seen

_HOMES = {
    "Answer": "api.answer",
    "Answered": "link.exchange",
    "Blocked": "link.exchange",
    "Command": "protocol.packets",
    "Confidence": "probing.finding",
    "ConnectedRobot": "api.robot",
    "Consent": "link.policy",
    "DecodedPacket": "api.decoding",
    "Finding": "probing.finding",
    "Generation": "protocol.packets",
    "Heading": "probing.finding",
    "LateResponse": "link.exchange",
    "Malformed": "protocol.packets",
    "Note": "probing.finding",
    "Notification": "protocol.packets",
    "Notifications": "api.notifications",
    "Outcome": "probing.finding",
    "Plan": "probing.plan",
    "Probe": "probing.plan",
    "Request": "protocol.packets",
    "Response": "protocol.packets",
    "Risk": "catalogue.risk",
    "Run": "api.result",
    "RunningPlan": "api.running",
    "Seen": "transports.base",
    "Silent": "link.exchange",
    "Summary": "probing.finding",
    "connect": "api.connecting",
    "decode": "api.decoding",
    "discover": "api.connecting",
    "errors": "",
    "load_run": "api.result",
    "scan": "api.connecting",
    "sweep": "probing.plan",
    "sync": "",
}
"""Public name -> its module below this package; empty for the names that are modules themselves."""

__all__ = [
    "Answer",
    "Answered",
    "Blocked",
    "Command",
    "Confidence",
    "ConnectedRobot",
    "Consent",
    "DecodedPacket",
    "Finding",
    "Generation",
    "Heading",
    "LateResponse",
    "Malformed",
    "Note",
    "Notification",
    "Notifications",
    "Outcome",
    "Plan",
    "Probe",
    "Request",
    "Response",
    "Risk",
    "Run",
    "RunningPlan",
    "Seen",
    "Silent",
    "Summary",
    "__version__",
    "connect",
    "decode",
    "discover",
    "errors",
    "load_run",
    "scan",
    "sweep",
    "sync",
]


def __getattr__(name: str) -> object:
    """Load a public name when it is used for the first time."""
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module  # noqa: PLC0415 - importing this package must import nothing

    if not home:
        return import_module(f"{__name__}.{name}")
    value: object = getattr(import_module(f"{__name__}.{home}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
