"""A firmware as a table: the commands of each node, from the catalogue and a seed."""

from random import Random
from typing import Final, NamedTuple

from sphero_probe.catalogue import BRICK_DEVICES, all_rows, commands_of
from sphero_probe.catalogue.model import CommandRow, Kind, Robot
from sphero_probe.catalogue.payload.layout import Layout
from sphero_probe.catalogue.risk import Risk
from sphero_probe.simulator.settings import Claims, Settings

LONGEST_PAYLOAD: Final = 200
"""Bytes that a command of variable length takes at most; a robot's buffers end about there."""

LISTS: Final = {(0x10, 0x05), (0x10, 0x06)}
"""The commands with which a firmware lists what it has."""

_WITHOUT_MATRIX: Final = "bolt-plus"
"""It has no 8x8 matrix [reference]; only a class that its package marks as untested has one."""
_MATRIX: Final = "compressed_frame_player"
"""Part of the name of every command of the matrix."""

SHARED_DEVICES: Final = (0x10, 0x11)
"""The devices whose commands any node may have: echo and versions are the document's examples [vendor]."""

_LENGTHS: Final[dict[tuple[int, int], tuple[int, int]]] = {(0x10, 0x00): (0, 16)}
"""Bounds that a layout cannot express: echo takes 16 bytes at most [vendor]."""

_SECRET_DEVICES: Final = (0x14, 0x15, 0x1C, 0x21, 0x22)
_SECRET_CIDS: Final = 0x80
_SECRET_SIZES: Final = {0: 50, 1: 18, 2: 8, 4: 8, 7: 3, 16: 3, None: 10}
"""Payload sizes of hidden commands and their weights, as in the documented ones; None for a variable one."""
_SECRET_RISKS: Final = {Risk.READ: 45, Risk.WRITE: 27, Risk.MOTION: 12, Risk.PERSIST: 14, Risk.BRICK: 2}
_GHOST_DEVICE: Final = 0x2F
"""A device that a lying firmware claims to have."""
_NEAR: Final = 2
"""CIDs within which commands are taken for relatives."""
_LONG: Final = 16
"""Fewest bytes of a hidden, harmful command of variable length that has no relatives."""


class Lengths(NamedTuple):
    """The payload lengths that a command takes.

    Attributes:
        minimum: in bytes.
        maximum: in bytes, None for ``LONGEST_PAYLOAD``.
        step: beyond the minimum, only multiples of this many bytes.
    """

    minimum: int
    maximum: int | None
    step: int = 1

    @classmethod
    def of(cls, layout: Layout) -> "Lengths":
        """Read them off a layout; of several variants, a robot has the first."""
        layout = layout.variants[0]
        if layout.fixed_length is not None:
            return cls(layout.fixed_length, layout.fixed_length)
        last = layout.fields[-1]
        if last.optional:
            return cls(layout.minimum_length, layout.minimum_length + last.size, last.size)
        if last.type == "uint":
            return cls(layout.minimum_length, layout.minimum_length + 7)
        return cls(layout.minimum_length, None, last.width)

    def accepts(self, length: int) -> bool:
        """Return whether a payload of ``length`` bytes is right."""
        longest = LONGEST_PAYLOAD if self.maximum is None else self.maximum
        return self.minimum <= length <= longest and (length - self.minimum) % self.step == 0

    def fit(self, payload: bytes) -> bytes:
        """Cut off what a command ignores, and fill up with zeros what it reads beyond the end."""
        longest = LONGEST_PAYLOAD if self.maximum is None else self.maximum
        return payload[:longest].ljust(self.minimum, b"\0")

    def as_json(self) -> list[int | str]:
        """The lengths as a list: of numbers, or with one range such as ``"0-200"`` where there is no gap."""
        longest = LONGEST_PAYLOAD if self.maximum is None else self.maximum
        if self.step == 1 and longest > self.minimum:
            return [f"{self.minimum}-{longest}"]
        return list(range(self.minimum, longest + 1, self.step))


class FirmwareCommand(NamedTuple):
    """One command that exists on one node.

    Attributes:
        node: number of the processor.
        did: device id.
        cid: command id.
        lengths: of its payload.
        risk: what executing it does, whatever a catalogue thinks.
        hidden: it stands in no catalogue.
        row: what the catalogue knows, None for a hidden one.
    """

    node: int
    did: int
    cid: int
    lengths: Lengths
    risk: Risk
    hidden: bool = False
    row: CommandRow | None = None


class Fact(NamedTuple):
    """One line of the truth about a firmware.

    Attributes:
        node: number of the processor.
        did: device id.
        cid: command id.
        lengths: of its payload.
        risk: what executing it does.
        hidden: it stands in no catalogue.
    """

    node: int
    did: int
    cid: int
    lengths: Lengths
    risk: Risk
    hidden: bool

    def as_json(self) -> dict[str, object]:
        """The fact as a JSON object; ``lengths`` as in ``Lengths.as_json``, the risk as a word."""
        return {**self._asdict(), "lengths": self.lengths.as_json(), "risk": self.risk.word}


class Firmware:
    """Every command of a robot by (node, did, cid), and which of them the robot lists itself.

    Attributes:
        commands: (node, did, cid) -> command, in rising order.
    """

    def __init__(self, settings: Settings, nodes: tuple[int, ...] | None = None) -> None:
        """Make the table.

        Args:
            settings: the model, and what differs from it.
            nodes: numbers of the nodes, None for those of the model. A node that the model does not have
                gets the commands that all nodes of the model have in ``SHARED_DEVICES``.
        """
        robot = settings.model
        known = [
            command
            for row in commands_of(robot)
            if row.kind is Kind.COMMAND
            and not (_MATRIX in row.name and robot.key == _WITHOUT_MATRIX and not settings.matrix)
            and ((row.did, row.cid) not in LISTS or settings.claims is not Claims.NONE)
            for command in _from_row(row, robot)
        ]
        table = {(command.node, command.did, command.cid): command for command in known}
        for command in _secrets(settings, known):
            table[command.node, command.did, command.cid] = command
        if nodes is not None:
            table = _on_nodes(table, tuple(robot.nodes), nodes)
            known = [command for command in table.values() if not command.hidden]
        self.commands = dict(sorted(table.items()))
        self._devices = {(node, did) for node, did, _ in self.commands}
        self._claims = _claims(settings, known, set(self.commands))

    def find(self, node: int, did: int, cid: int) -> FirmwareCommand | None:
        """Return a node's command, None when it has none."""
        return self.commands.get((node, did, cid))

    def has_device(self, node: int, did: int) -> bool:
        """Return whether a node has any command under a device id."""
        return (node, did) in self._devices

    def claimed_devices(self, node: int) -> bytes:
        """Return the device ids that a node lists."""
        return bytes(sorted({did for where, did, _ in self._claims if where == node}))

    def claimed_commands(self, node: int, did: int) -> bytes:
        """Return the command ids that a node lists under a device id."""
        return bytes(sorted({cid for where, device, cid in self._claims if (where, device) == (node, did)}))

    def truth(self) -> list[Fact]:
        """Return every command that exists, in rising order."""
        return [
            Fact(command.node, command.did, command.cid, command.lengths, command.risk, command.hidden)
            for command in self.commands.values()
        ]


def _on_nodes(
    table: dict[tuple[int, int, int], FirmwareCommand], usual: tuple[int, ...], nodes: tuple[int, ...]
) -> dict[tuple[int, int, int], FirmwareCommand]:
    """Keep the commands of the nodes that there are, and give shared ones to the others."""
    kept = {key: command for key, command in table.items() if key[0] in nodes}
    for (_, did, cid), command in table.items():
        if did in SHARED_DEVICES and not command.hidden and all((node, did, cid) in table for node in usual):
            for node in set(nodes) - set(usual):
                kept[node, did, cid] = command._replace(node=node)
    return kept


def _from_row(row: CommandRow, robot: Robot) -> list[FirmwareCommand]:
    nodes = row.nodes[robot.key] or tuple(robot.nodes)[:1]
    bounds = _LENGTHS.get((row.did, row.cid))
    lengths = Lengths(*bounds) if bounds else _lengths(row)
    return [FirmwareCommand(node, row.did, row.cid, lengths, row.risk, row=row) for node in nodes]


def _lengths(row: CommandRow) -> Lengths:
    """Read the lengths off a layout; where none is known, a read takes nothing, the rest a stable guess."""
    if row.request is None:
        guess = 0 if row.risk is Risk.READ else Random(row.name).choice((0, 1, 1, 2, 4))
        return Lengths(guess, guess)
    return Lengths.of(row.request)


def _secrets(settings: Settings, known: list[FirmwareCommand]) -> list[FirmwareCommand]:
    """Draw the hidden commands: free CIDs of the robot's devices, now and then a device of their own."""
    chance = Random(f"{settings.seed} {settings.model.key} hidden")
    taken = {(row.did, row.cid) for row in all_rows(settings.model.generation)}
    sealed = BRICK_DEVICES[settings.model.generation]
    places = sorted({(command.node, command.did) for command in known})
    free = [did for did in _SECRET_DEVICES if did not in {known_did for known_did, _ in taken}]
    home = chance.choice(sorted({node for node, _ in places}))
    places.append((home, chance.choice(free)))
    while sum(_room(did, taken) for _, did in places) < settings.hidden:
        places.append((home, next(did for did in free if (home, did) not in places)))
    weights = [1 if did in sealed else 4 for _, did in places]
    drawn: dict[tuple[int, int, int], FirmwareCommand] = {}
    while len(drawn) < settings.hidden:
        ((node, did),) = chance.choices(places, weights)
        cid = chance.randrange(_SECRET_CIDS)
        if (did, cid) in taken or (node, did, cid) in drawn:
            continue
        relatives = [command for command in known if command.did == did and abs(command.cid - cid) <= _NEAR]
        lengths, risk = _secret_nature(chance, relatives, sealed=did in sealed)
        drawn[node, did, cid] = FirmwareCommand(node, did, cid, lengths, risk, hidden=True)
    return list(drawn.values())


def _room(did: int, taken: set[tuple[int, int]]) -> int:
    """Count the CIDs of a device that a hidden command may have."""
    return sum((did, cid) not in taken for cid in range(_SECRET_CIDS))


def _secret_nature(chance: Random, relatives: list[FirmwareCommand], *, sealed: bool) -> tuple[Lengths, Risk]:
    """Draw what a hidden command takes and does.

    One of variable length that does harm lies next to known ones that do, or takes whole frames.
    """
    (size,) = chance.choices(list(_SECRET_SIZES), list(_SECRET_SIZES.values()))
    (risk,) = chance.choices(list(_SECRET_RISKS), list(_SECRET_RISKS.values()))
    if sealed:
        risk = Risk.BRICK
    if size is not None:
        return Lengths(size, size), risk
    kin = [one.risk for one in relatives if one.lengths.maximum is None and one.risk >= Risk.PERSIST]
    if kin:
        return Lengths(chance.choice((0, 1, 2)), None), max(kin)
    return Lengths(0 if risk is Risk.READ else _LONG, None), risk


def _claims(
    settings: Settings, known: list[FirmwareCommand], existing: set[tuple[int, int, int]]
) -> set[tuple[int, int, int]]:
    """Choose the pairs per node that 10/05 and 10/06 list; hidden commands are never among them."""
    claims = {(command.node, command.did, command.cid) for command in known}
    chance = Random(f"{settings.seed} {settings.model.key} claims")
    if settings.claims is Claims.PARTIAL:
        kept = sorted(claims - {(command.node, *pair) for command in known for pair in LISTS})
        claims -= set(chance.sample(kept, len(kept) // 4))
    elif settings.claims is Claims.LYING:
        places = sorted({(command.node, command.did) for command in known})
        for node, did in chance.sample(places, len(places) // 2):
            ghosts = [cid for cid in range(_SECRET_CIDS) if (node, did, cid) not in existing]
            claims.add((node, did, chance.choice(ghosts)))
        claims.add((places[0][0], _GHOST_DEVICE, 0x00))
    return claims
