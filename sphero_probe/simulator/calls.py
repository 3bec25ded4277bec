"""The calls and replies of a fake robot's commands, and the behaviours of a generation."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from sphero_probe.catalogue.risk import Risk
from sphero_probe.protocol.packets import Verdict
from sphero_probe.simulator.firmware import FirmwareCommand
from sphero_probe.simulator.state import State

Pair = tuple[int, int]
"""Device id and command id."""
NewsPair = tuple[int | None, int]
"""The same for a notification; the device id is None where the generation sends none."""


class News(NamedTuple):
    """A notification that follows a response.

    Attributes:
        node: the processor that sends it.
        pair: its (did, cid).
        payload: its data.
    """

    node: int
    pair: NewsPair
    payload: bytes = b""


class Reply(NamedTuple):
    """How a command ended.

    Attributes:
        verdict: in words; anything but OK means that nothing was executed.
        payload: the data of the response.
        news: notifications that follow it.
        code: the error code, where it is not the first that means the verdict.
        prompt: bytes outside any packet that follow the response.
    """

    verdict: Verdict = Verdict.OK
    payload: bytes = b""
    news: tuple[News, ...] = ()
    code: int | None = None
    prompt: bytes = b""


class Call(NamedTuple):
    """One execution of a command.

    Attributes:
        state: of the robot; changed when the verdict is OK.
        command: what is run.
        payload: as long as the command wants it.
        now: seconds of the caller's clock.
    """

    state: State
    command: FirmwareCommand
    payload: bytes
    now: float


Behaviour = Callable[[Call], Reply]


class Follow(NamedTuple):
    """A notification that a command causes.

    Attributes:
        pair: its (did, cid).
        enabled_by: the (did, cid) of the switch that must be on; None where it always comes.
    """

    pair: NewsPair
    enabled_by: Pair | None = None


class Idleness(NamedTuple):
    """How a robot falls asleep when it gets no commands.

    Attributes:
        timeout: seconds without a command until it sleeps; None for never.
        notice: seconds before that in which it warns.
        warning: (did, cid) of the notification that warns.
        asleep: (did, cid) of the notification that it sleeps now.
    """

    timeout: float | None
    notice: float
    warning: NewsPair
    asleep: NewsPair


class Behaviours(NamedTuple):
    """What the commands of a generation do beyond what their catalogue rows say.

    Attributes:
        special: pair -> what it does.
        follows: pair -> the notification that carries its result, in place of the response or as well.
        refused: pair -> what it gets; these exist and never run.
        wake: the only command that a sleeping robot takes; None where no command wakes it.
        name_setter: the command that sets the Bluetooth name.
        idleness: how it falls asleep by itself.
        awake: (did, cid) of the notification that it has started, None where there is none.
        prompt: what it sends outside any packet when it has started.
        bootloader: the device that alone is left after a jump into the bootloader; None where there is no
            such jump.
    """

    special: Mapping[Pair, Behaviour]
    follows: Mapping[Pair, Follow]
    refused: Mapping[Pair, Reply]
    wake: Pair | None
    name_setter: Pair
    idleness: Idleness
    awake: NewsPair | None = None
    prompt: bytes = b""
    bootloader: int | None = None


def answer(call: Call) -> Reply:
    """Do what most commands do: answer what was set, or a reading."""
    state, command, _, _ = call
    setter = state.setters.get((command.node, command.did, command.cid))
    if setter in state.memory:
        return Reply(payload=state.memory[setter])
    if command.row is None:
        return Reply(payload=state.readings.secret(command.did, command.cid, command.node))
    if command.row.response is None and command.risk is not Risk.READ:
        return Reply()
    return Reply(payload=state.readings.payload(command.row, command.node))
