"""The public names of ``sphero_probe``: where each one lives, and how it is loaded.

They are here and not in the package itself, because compiling this table would make
``python -c "import sphero_probe"`` 10 % slower.
"""

from importlib import import_module

HOMES = {
    "Answer": "api.answer",
    "Answered": "link.exchange",
    "Blocked": "link.exchange",
    "Command": "protocol.packets",
    "Confidence": "probing.finding",
    "ConnectedRobot": "api.robot",
    "Consent": "link.policy",
    "DecodedPacket": "api.decoding",
    "Finding": "probing.finding",
    "Fleet": "api.fleet",
    "FleetRobot": "fleet.robots",
    "FleetRun": "api.fleet",
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
    "RobotResult": "fleet.results",
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


def load(name: str) -> object:
    """Return a public name of ``sphero_probe``.

    Raises:
        AttributeError: there is no such name.
    """
    if name == "__all__":
        return sorted([*HOMES, "__version__"])
    home = HOMES.get(name)
    if home is None:
        raise AttributeError(f"module 'sphero_probe' has no attribute {name!r}")
    if not home:
        return import_module(f"sphero_probe.{name}")
    value: object = getattr(import_module(f"sphero_probe.{home}"), name)
    return value
