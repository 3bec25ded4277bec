"""The types of the catalogue: command rows, robots, LED tables. The rows themselves are in ``tables``."""

from enum import Enum
from typing import Final, NamedTuple

from sphero_probe.catalogue.payload.layout import Layout
from sphero_probe.catalogue.risk import Risk
from sphero_probe.protocol.packets import Generation

NO_DEVICE: Final = -1
"""Stands for the device id in the rows of V1's asynchronous messages, which belong to no device."""


class Kind(Enum):
    """What a DID/CID pair carries."""

    COMMAND = "command"
    NOTIFICATION = "notification"


class CommandRow(NamedTuple):
    """One DID/CID pair, as one family of robots implements it.

    Attributes:
        generation: the protocol it belongs to.
        did: device id; ``NO_DEVICE`` for an asynchronous message of V1.
        cid: command id, or the id of the asynchronous message.
        name: dotted name, ``power.get_battery_percentage``.
        kind: command or notification.
        risk: the risk class of executing it.
        request: the layout of its argument bytes, None where unknown; with variants where lengths differ.
        response: the layout of its response, or of the notification's payload; likewise.
        nodes: robot key -> node numbers that serve it there; an empty tuple where the node is not known.
        sources: who documents it, keys of ``provenance.SOURCES``; ``provenance.sources_for`` says which of
            them name a robot.
        aliases: the names that other sources use, without the device name.
        sample: argument bytes that a sweep sends with a read; None: zeros of the request's length.
        note: one remark for ``explain``, or empty.
        enabled_by: name of the command that makes a robot send this notification, empty where none is known.
        since: the first firmware version that has it, empty where no source says.
    """

    generation: Generation
    did: int
    cid: int
    name: str
    kind: Kind
    risk: Risk
    request: Layout | None
    response: Layout | None
    nodes: dict[str, tuple[int, ...]]
    sources: tuple[str, ...]
    aliases: tuple[str, ...] = ()
    sample: bytes | None = None
    note: str = ""
    enabled_by: str = ""
    since: str = ""


class LedGroup(NamedTuple):
    """One LED as a person sees it.

    Attributes:
        name: ``front``, ``back``, ``left_headlight``…
        bits: its channel numbers, in the mask where there is one: three for red, green, blue; one for a
            single brightness.
        aliases: other names of this LED; several LEDs may share one (``front``: both headlights).
        cid: id of the command that sets only this LED; None where the table's command sets it by a mask.
        tail: the bytes that follow the values in the arguments of that command.
    """

    name: str
    bits: tuple[int, ...]
    aliases: tuple[str, ...] = ()
    cid: int | None = None
    tail: bytes = b""


class LedTable(NamedTuple):
    """How a robot's LEDs are set.

    Either one command has a mask that selects channels, with their values in rising bit order, or each LED
    has its own command.

    Attributes:
        did: device id of the command or commands.
        cid: id of the command with the mask; where there is none, of the first LED's command.
        mask_bytes: width of the mask in bytes (1, 2, 4 or 8), big-endian; 0 where each LED has its command.
        node: the node that serves it, None to leave addresses out.
        groups: the LEDs.
    """

    did: int
    cid: int
    mask_bytes: int
    node: int | None
    groups: tuple[LedGroup, ...]


class AnswerStyle(Enum):
    """Which addresses a robot puts into its responses [real captures; robots drop either]."""

    SWAPPED = "swapped"
    """Both, from the robot's point of view: target = the client with its port, source = the node."""
    SOURCE_ONLY = "source only"
    NONE = "none"


class Robot(NamedTuple):
    """One model.

    Attributes:
        key: the name that people type: ``bolt-plus``.
        name: the product name: ``Sphero BOLT+``.
        generation: its protocol.
        prefix: of the advertised name, ``BP-``; empty where it has none.
        nodes: node number -> name, ``{1: "primary"}``; ``{1: "robot"}`` where the protocol has no nodes.
        addressed: whether commands have target and source by default.
        answer_style: the addresses of its responses.
        handshake: an anti-DoS phrase must be written before anything else works.
        leds: its LEDs, None where they are not known.
        sku: as ``get_sku`` and similar commands return it; for the simulator.
        aliases: further names of this robot in an address.
    """

    key: str
    name: str
    generation: Generation
    prefix: str
    nodes: dict[int, str]
    addressed: bool
    answer_style: AnswerStyle
    handshake: bool
    leds: LedTable | None
    sku: str = ""
    aliases: tuple[str, ...] = ()
