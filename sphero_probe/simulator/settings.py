"""What follows ``fake:`` in an address comes in as text, a fake robot's settings go out."""

from collections.abc import Callable
from enum import StrEnum
from typing import Any, Final, NamedTuple

from sphero_probe.catalogue import ROBOTS, robot_by_word
from sphero_probe.catalogue.model import Robot
from sphero_probe.errors import UsageError
from sphero_probe.simulator.query import parse_query, unknown
from sphero_probe.simulator.response_style import RESPONSE_STYLES
from sphero_probe.simulator.setting_values import (
    at_least,
    devices,
    node,
    nodes,
    one_of,
    pair,
    pairs,
    path,
    probability,
    seconds,
    switch,
    whole,
)

MOST_HIDDEN: Final = 500
"""Hidden commands that any robot has room for."""


class Strict(StrEnum):
    """How a firmware checks the length of a payload."""

    EXACT = "exact"
    MINIMUM = "minimum"
    NONE = "none"


class Claims(StrEnum):
    """How far 10/05 and 10/06 tell the truth about the firmware."""

    TRUE = "true"
    PARTIAL = "partial"
    LYING = "lying"
    NONE = "none"


class Overflow(StrEnum):
    """What becomes of a command that finds no place to wait."""

    LOST = "lost"
    BUSY = "busy"


class Line(StrEnum):
    """How a client reaches a robot."""

    BLE = "ble"
    UART = "uart"


class Timing(StrEnum):
    """Where the time that an answer takes comes from."""

    FIXED = "fixed"
    MEASURED = "measured"


class Hang(NamedTuple):
    """A node that stops working.

    Attributes:
        node: its number.
        after: seconds from the robot's start.
    """

    node: int
    after: float


class Settings(NamedTuple):
    """Everything that makes one fake robot differ from another; equal settings behave alike, byte for byte.

    Attributes:
        model: the robot that is played.
        seed: picks names, readings, hidden commands and faults.
        hidden: number of commands that no catalogue knows.
        strict: how the length of a payload is checked.
        mask: devices in which a payload answers "bad length" even where no such command exists.
        claims: what 10/05 and 10/06 are worth.
        latency: seconds between hearing a command and its answer leaving.
        timing: ``measured`` adds the round trips of a real robot to ``latency``; its bytes come one by one.
        loss: probability that a packet is lost, either way.
        corrupt: probability that one byte of a packet is changed, either way.
        duplicate: probability that a packet of the robot arrives twice.
        reorder: probability that an answer is overtaken by the next one.
        interval: seconds between BLE connection events; None for no events, or the usual ones if
            ``per_event`` is set.
        per_event: packets per event and direction at most; None for the usual number if ``interval`` is set.
        queue: commands that can wait while one is served; None where service takes no time.
        overflow: what becomes of the surplus: it is lost, or answered "busy" at once.
        service: seconds that serving one command takes; None for the usual time if ``queue`` is set.
        busy: probability that a command is answered "busy" and not executed.
        sleep_after: seconds without activity until the robot sleeps; None for what its generation does.
        matrix: a BOLT+ has the 8x8 matrix of the BOLT on its one node; other robots are as they are.
        disconnect_after: commands received on one connection until it drops; None for no end.
        reboot_on: (did, cid) that makes the robot restart, whatever the payload.
        split: bytes per notification, None for as many as one BLE notification holds.
        silent: (did, cid) pairs that are never answered.
        line: how the client reaches the robot.
        baud: bits per second of a UART, either way; None for a UART that takes no time.
        unavailable: nodes for which another node answers "target unavailable".
        bad_target_from: the node that answers for nodes that do not exist; None for the one that found out.
        die: the node that hangs from some time on; None for none.
        topology: file with the network of nodes that the robot is; the transport reads it.
        truth: file for the list of commands that exist; the transport writes it.
        ledger: file for the list of commands executed, likewise.
    """

    model: Robot
    seed: int = 0
    hidden: int = 0
    strict: Strict = Strict.EXACT
    mask: frozenset[int] = frozenset()
    claims: Claims = Claims.TRUE
    latency: float = 0.0
    timing: Timing = Timing.FIXED
    loss: float = 0.0
    corrupt: float = 0.0
    duplicate: float = 0.0
    reorder: float = 0.0
    interval: float | None = None
    per_event: int | None = None
    queue: int | None = None
    overflow: Overflow = Overflow.LOST
    service: float | None = None
    busy: float = 0.0
    sleep_after: float | None = None
    matrix: bool = False
    disconnect_after: int | None = None
    reboot_on: tuple[int, int] | None = None
    split: int | None = None
    silent: frozenset[tuple[int, int]] = frozenset()
    line: Line = Line.BLE
    baud: int | None = None
    unavailable: frozenset[int] = frozenset()
    bad_target_from: int | None = None
    die: Hang | None = None
    topology: str | None = None
    truth: str | None = None
    ledger: str | None = None


def parse_settings(text: str) -> Settings:
    """Read ``MODEL?key=value&…``; values may be percent-encoded.

    Raises:
        UsageError: an unknown model or key, a key given twice, a value that does not fit its key.
    """
    word, _, query = text.partition("?")
    values: dict[str, Any] = parse_query(query, KEYS, "fake")
    settings = Settings(_model(word), **values)
    if settings.baud and settings.line is not Line.UART:
        raise UsageError("fake robot setting baud: only a UART has a baud rate", "add line=uart")
    return settings


def _model(word: str) -> Robot:
    robot = robot_by_word(word)
    playable = [model.key for model in ROBOTS.values() if model.generation in RESPONSE_STYLES]
    if robot is None:
        raise UsageError(unknown("fake robot", word, playable))
    if robot.generation not in RESPONSE_STYLES:
        raise UsageError(f"there is no fake {robot.key} yet; there are {', '.join(playable)}")
    return robot


def _hang(text: str) -> Hang:
    """Read a node and a time."""
    number, at, after = text.partition("@")
    if not at:
        raise ValueError("a node and a time are wanted, such as 2@30s")
    return Hang(node(number), seconds(after))


KEYS: Final[dict[str, Callable[[str], object]]] = {
    "seed": whole(0),
    "hidden": whole(0, MOST_HIDDEN),
    "strict": one_of(Strict),
    "mask": devices,
    "claims": one_of(Claims),
    "latency": seconds,
    "timing": one_of(Timing),
    "loss": probability,
    "corrupt": probability,
    "duplicate": probability,
    "reorder": probability,
    "interval": at_least("1ms"),
    "per_event": whole(1),
    "queue": whole(1),
    "overflow": one_of(Overflow),
    "service": seconds,
    "busy": probability,
    "sleep_after": at_least("1ms"),
    "matrix": switch,
    "disconnect_after": whole(1),
    "reboot_on": pair,
    "split": whole(1, 512),
    "silent": pairs,
    "line": one_of(Line),
    "baud": whole(300),
    "unavailable": nodes,
    "bad_target_from": node,
    "die": _hang,
    "topology": path,
    "truth": path,
    "ledger": path,
}
"""Every setting by its name in the address, which is its name in ``Settings``, and how its value is read."""
