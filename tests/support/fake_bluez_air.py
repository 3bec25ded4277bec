"""The robots around the fake BlueZ: their GATT tables, faults, writes and notifications."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

PHRASE = b"usetheforce...band"
V2_SERVICE = "00010001-574f-4f20-5370-6865726f2121"
V2_API = "00010002-574f-4f20-5370-6865726f2121"
V2_GATE_SERVICE = "00020001-574f-4f20-5370-6865726f2121"
V2_GATE = "00020005-574f-4f20-5370-6865726f2121"

DEFAULT_MTU = 23
ATT_HEADER = 3
"""Bytes of the MTU that are not payload of a write or a notification."""


def _v1(short: str) -> str:
    return f"22bb746f-{short}-7554-2d6f-726568705327"


V1_SERVICE = _v1("2ba0")
V1_COMMANDS = _v1("2ba1")
V1_ANSWERS = _v1("2ba6")
V1_RADIO_SERVICE = _v1("2bb0")
V1_TX_POWER = _v1("2bb2")
V1_GATE = _v1("2bbd")
V1_WAKE = _v1("2bbf")


class Robot(Protocol):
    """Anything behind the radio; times are seconds of one monotonic clock."""

    def hear(self, data: bytes, *, now: float) -> None:
        """Receive the bytes of one write."""
        ...

    def speak(self, *, now: float) -> list[bytes]:
        """Return the notifications that are due by now, in order."""
        ...

    def next_time(self) -> float | None:
        """Return when the next notification is due, None if never."""
        ...


class Characteristic(NamedTuple):
    """One characteristic.

    Attributes:
        uuid: lower case, 128 bits.
        flags: as BlueZ spells them: ``read``, ``write``, ``write-without-response``, ``notify``.
        value: the value that a read returns.
    """

    uuid: str
    flags: tuple[str, ...]
    value: bytes = b""


class Service(NamedTuple):
    """One primary service.

    Attributes:
        uuid: lower case, 128 bits.
        characteristics: in the order of their handles.
    """

    uuid: str
    characteristics: tuple[Characteristic, ...]


class Profile(NamedTuple):
    """A GATT table and the roles of its characteristics.

    Attributes:
        services: in the order of their handles.
        hears: the characteristic whose writes reach the robot.
        speaks: the characteristic that the robot notifies on.
        phrases: what must be written where, in each connection, before the robot accepts commands.
        hidden: services that appear once the phrases have been written.
        service_changed: the robot announces at once that services appeared; otherwise they are found only in
            a new connection.
    """

    services: tuple[Service, ...]
    hears: str
    speaks: str
    phrases: dict[str, bytes]
    hidden: frozenset[str] = frozenset()
    service_changed: bool = True


def sphero_v2(
    *, gate: bool = True, reveals_api_after_handshake: bool = False, service_changed: bool = True
) -> Profile:
    """Return the table of a V2 robot.

    Args:
        gate: it has the anti-DoS service and needs the phrase (BOLT does; BOLT+ and RVR do not).
        reveals_api_after_handshake: the API service appears after the phrase (R2-D2 may do this).
        service_changed: see ``Profile``.
    """
    api = Service(V2_SERVICE, (Characteristic(V2_API, ("write-without-response", "write", "notify")),))
    gate_service = Service(V2_GATE_SERVICE, (Characteristic(V2_GATE, ("write-without-response", "write")),))
    return Profile(
        services=(gate_service, api) if gate else (api,),
        hears=V2_API,
        speaks=V2_API,
        phrases={V2_GATE: PHRASE} if gate else {},
        hidden=frozenset({V2_SERVICE}) if reveals_api_after_handshake else frozenset(),
        service_changed=service_changed,
    )


def sphero_v1() -> Profile:
    """Return the table of a V1 robot with BLE: Ollie, BB-8, SPRK+."""
    control = Service(
        V1_SERVICE,
        (
            Characteristic(V1_COMMANDS, ("write-without-response", "write")),
            Characteristic(V1_ANSWERS, ("read", "notify")),
        ),
    )
    knobs = tuple(Characteristic(uuid, ("write",)) for uuid in (V1_TX_POWER, V1_GATE, V1_WAKE))
    return Profile(
        services=(control, Service(V1_RADIO_SERVICE, knobs)),
        hears=V1_COMMANDS,
        speaks=V1_ANSWERS,
        phrases={V1_GATE: b"011i3", V1_TX_POWER: b"\x07", V1_WAKE: b"\x01"},
    )


@dataclass
class Faults:
    """Faults of one robot or of its radio link; each can be changed while the bus runs.

    Attributes:
        lose_every: every n-th notification is lost; 1 loses all, 0 none.
        double_every: every n-th notification arrives twice.
        split: bytes per notification, 0 for as many as the robot sends.
        connect_errors: the errors of the first attempts to connect, ``le-connection-abort-by-local``…
        connect_hangs: an attempt to connect never ends.
        most_connections: the maximum number of connections; 0 for any number.
        gone_after_drop: the robot is permanently out of range after its link dropped or a connection failed.
        gone_after_scan: the device is forgotten as soon as a scan stops.
        gone_at_connect: the device is forgotten when a client connects to it.
        drops_in_discovery: how many connections drop before the services are known.
        never_resolves: the services are never known.
        drop_at_write: the link drops during this write of each connection, counted from 1; 0 never.
        drop_when_idle: seconds that an idle link lasts after the services are known; None: it never drops.
        write_error: ATT error code of every write with response, None for success.
        missing: services and characteristics that the table lacks.
        asleep: it does not advertise; BlueZ remembers it, and reports it during scans.
    """

    lose_every: int = 0
    double_every: int = 0
    split: int = 0
    connect_errors: tuple[str, ...] = ()
    connect_hangs: bool = False
    most_connections: int = 0
    gone_after_drop: bool = False
    gone_after_scan: bool = False
    gone_at_connect: bool = False
    drops_in_discovery: int = 0
    never_resolves: bool = False
    drop_at_write: int = 0
    drop_when_idle: float | None = None
    write_error: int | None = None
    missing: frozenset[str] = frozenset()
    asleep: bool = False


ACCESS_DENIED = (
    "org.freedesktop.DBus.Error.AccessDenied",
    'Rejected send message, 2 matched rules; type="method_call", destination="org.bluez"',
)
CHILD_EXITED = (
    "org.freedesktop.DBus.Error.Spawn.ChildExited",
    "Launch helper exited with unknown return code 1",
)


@dataclass
class BusFaults:
    """Faults of the machine; each can be changed while the bus runs.

    Attributes:
        absent: no process owns ``org.bluez``.
        rejects_authentication: the bus rejects every client.
        mute: the bus accepts connections and never sends anything.
        errors: calls to BlueZ that fail, by method name, ``*`` for all: (error name, text).
        unanswered: calls to BlueZ that get no reply, by method name, ``*`` for all.
        hangs_up_at: the call to BlueZ, by method name, at which the bus closes every connection, once.
    """

    absent: bool = False
    rejects_authentication: bool = False
    mute: bool = False
    errors: dict[str, tuple[str, str]] = field(default_factory=dict)
    unanswered: frozenset[str] = frozenset()
    hangs_up_at: str = ""


@dataclass
class Counts:
    """Counters of a peripheral, which faults refer to."""

    connects: int = 0
    connected: int = 0
    notifications: int = 0
    writes: int = 0


@dataclass(eq=False)
class Peripheral:
    """One robot with a radio.

    Attributes:
        name: as advertised; bytes may be invalid UTF-8; None advertises no name.
        address: ``AA:BB:CC:DD:EE:FF``.
        robot: the robot behind the radio, or None.
        services: its table.
        rssi: in dBm.
        uuids: the services that it advertises.
        mtu: of its connections, in bytes; 247 is what BOLT and RVR agree to.
        faults: its faults.
        written: everything that reached it, in order: (characteristic, bytes).
        counts: see ``Counts``; ``writes`` restarts with each connection.
        unlocked: the phrases written in this connection.
        revealed: the phrases were all written once.
    """

    name: str | bytes | None
    address: str
    robot: Robot | None = None
    services: Profile = field(default_factory=sphero_v2)
    rssi: int = -50
    uuids: tuple[str, ...] = ()
    mtu: int = DEFAULT_MTU
    faults: Faults = field(default_factory=Faults)
    written: list[tuple[str, bytes]] = field(default_factory=list)
    counts: Counts = field(default_factory=Counts)
    unlocked: set[str] = field(default_factory=set)
    revealed: bool = False

    def alias(self) -> str | None:
        """Return the name as BlueZ passes it on: up to the first NUL or bad UTF-8, trimmed; None if empty."""
        raw = self.name.encode() if isinstance(self.name, str) else self.name or b""
        raw = raw.partition(b"\0")[0]
        try:
            text = raw.decode()
        except UnicodeDecodeError as error:
            text = raw[: error.start].decode()
        return text.strip(" \t\n\v\f\r") or None

    def shows(self, uuid: str) -> bool:
        """Whether a service or characteristic can be found now."""
        hidden = uuid in self.services.hidden and not self.revealed
        return not hidden and uuid not in self.faults.missing

    def start_connection(self) -> None:
        """Reset the state of the last connection."""
        self.unlocked.clear()
        self.counts.writes = 0
        self.counts.connected += 1

    def receive(self, uuid: str, data: bytes, *, now: float) -> bool:
        """Receive a write; return whether it makes hidden services appear."""
        self.written.append((uuid, data))
        phrases = self.services.phrases
        if phrases.get(uuid) == data:
            self.unlocked.add(uuid)
        if uuid == self.services.hears and self.robot is not None and self.unlocked >= phrases.keys():
            self.robot.hear(data, now=now)
        came_to_light = not self.revealed and bool(self.services.hidden) and self.unlocked >= phrases.keys()
        self.revealed = self.revealed or came_to_light
        return came_to_light

    def notifications(self, *, now: float) -> Iterator[bytes]:
        """Return the values that have arrived at the host by now, with faults applied."""
        if self.robot is None:
            return
        faults, size = self.faults, self.mtu - ATT_HEADER
        size = min(size, self.faults.split) if self.faults.split else size
        for said in self.robot.speak(now=now):
            for at in range(0, len(said), size):
                self.counts.notifications += 1
                number = self.counts.notifications
                if faults.lose_every and number % faults.lose_every == 0:
                    continue
                yield said[at : at + size]
                if faults.double_every and number % faults.double_every == 0:
                    yield said[at : at + size]
