"""What a robot remembers; it changes with every executed command."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Final, NamedTuple

from sphero_probe.catalogue.model import LedTable
from sphero_probe.catalogue.payload.layout import Layout
from sphero_probe.catalogue.risk import Risk
from sphero_probe.simulator.firmware import Firmware
from sphero_probe.simulator.readings import Readings
from sphero_probe.simulator.services import steady_readings
from sphero_probe.simulator.settings import Settings
from sphero_probe.simulator.sleep_timer import SleepTimer

if TYPE_CHECKING:
    from sphero_probe.catalogue.streaming_services import Slot
    from sphero_probe.simulator.streaming import Streaming

Key = tuple[int, int, int]
"""Node, device id, command id."""

_COLOURS: Final = ("red", "green", "blue")
_SETTER_NAMES: Final = (("get_", "", "set_"), ("get_", "", "enable_"), ("get_", "_enabled", "enable_"))
"""Prefix and suffix of a getter's name, and the prefix of its setter."""


class Sample(NamedTuple):
    """One streamed packet.

    Attributes:
        sent: when, in seconds of the caller's clock.
        node: the processor it comes from.
        pair: (did, cid) of the notification.
        payload: its data.
    """

    sent: float
    node: int
    pair: tuple[int | None, int]
    payload: bytes


class State:
    """The memory of one robot.

    Attributes:
        model: what it is.
        seed: of its settings.
        strict: how it checks lengths, also where they depend on the payload.
        firmware: its commands.
        readings: its answers to reads.
        leds: channel -> brightness 0-255; ``front_red`` for an LED of three channels, ``head`` for one.
        channels: number of a channel, in the LED mask where there is one -> its name.
        memory: (node, did, cid) -> the last payload of every executed command but reads.
        setters: key of a getter -> key of the setter whose payload it answers.
        frames: numbers of the saved animation frames.
        colour: the three bytes of the main LED that it keeps without power, empty before any were given.
        streams: node and token (0 for the stream of a mask) -> the running sensor stream.
        services: node and token -> the streaming services that were configured.
        sensors: name -> the value that the streaming services deliver.
        rest: when it sleeps and wakes by itself.
        asleep: takes no command but wake.
        off: in deep sleep, takes no command at all.
        in_bootloader: has nothing but its bootloader.
        booting: restarts, and takes no command yet.
    """

    def __init__(self, settings: Settings, rest: SleepTimer, nodes: tuple[int, ...] | None = None) -> None:
        self.model = settings.model
        self.seed = settings.seed
        self.strict = settings.strict
        self.firmware = Firmware(settings, nodes)
        self.readings = Readings(settings.model, settings.seed)
        self.channels = _channels(settings.model.leds)
        self.leds = dict.fromkeys(self.channels.values(), 0)
        self.memory: dict[Key, bytes] = {}
        self.setters = _setters(self.firmware)
        self.frames: set[int] = set()
        self.colour = b""
        self.streams: dict[tuple[int, int], Streaming] = {}
        self.services: dict[tuple[int, int], tuple[Slot, ...]] = {}
        self.sensors = steady_readings(settings.seed)
        self.rest = rest
        self.asleep = False
        self.off = False
        self.in_bootloader = False
        self.booting = False

    @property
    def stream_due(self) -> float | None:
        """When the next streamed packet is sent, None while nothing is streamed."""
        if not self.streams:  # most of the time
            return None
        return min((stream.due for stream in self.streams.values() if stream.due is not None), default=None)

    def next_sample(self, *, now: float) -> Sample | None:
        """Return the next streamed packet that is due by ``now``, None while there is none."""
        if not self.streams:
            return None
        due = self.stream_due
        for stream in self.streams.values():
            if due is not None and stream.due == due and (sample := stream.sample(now=now)):
                return Sample(sample[0], stream.node, stream.pair, sample[1])
        return None

    def light(self, channels: Iterable[int], values: Iterable[int]) -> None:
        """Give channels a brightness each, as long as there are values."""
        self.leds.update(
            (self.channels[channel], value) for channel, value in zip(channels, values, strict=False)
        )

    def fall_asleep(self, *, wakes: float | None = None) -> None:
        """Sleep until a command wakes it, or until a time in seconds of the caller's clock."""
        self.asleep = True
        self.streams.clear()
        self.rest.sleep(wakes)

    def restart(self) -> None:
        """Forget everything but what is stored without power."""
        self.streams.clear()
        self.services.clear()
        self.leds.update(dict.fromkeys(self.leds, 0))
        commands = self.firmware.commands
        self.memory = {
            key: payload for key, payload in self.memory.items() if commands[key].risk >= Risk.PERSIST
        }


def _channels(table: LedTable | None) -> dict[int, str]:
    if table is None:
        return {}
    return {
        bit: f"{group.name}_{colour}" if len(group.bits) == len(_COLOURS) else group.name
        for group in table.groups
        for bit, colour in zip(group.bits, _COLOURS, strict=False)
    }


def _setters(firmware: Firmware) -> dict[Key, Key]:
    """Find the setter of every getter: matching names on one node, and layouts of the same shape."""
    rows = {key: command.row for key, command in firmware.commands.items() if command.row}
    by_name = {(key[0], row.name): key for key, row in rows.items()}
    found: dict[Key, Key] = {}
    for key, row in rows.items():
        device, _, name = row.name.rpartition(".")
        for before, behind, setter_before in _SETTER_NAMES:
            if name.startswith(before) and name.endswith(behind):
                subject = name.removeprefix(before).removesuffix(behind)
                setter = by_name.get((key[0], f"{device}.{setter_before}{subject}"))
                if setter and row.response and _shape(rows[setter].request) == _shape(row.response):
                    found.setdefault(key, setter)
    return found


def _shape(layout: Layout | None) -> list[tuple[str, int | None]] | None:
    return None if layout is None else [(field.type, field.count) for field in layout.fields]
