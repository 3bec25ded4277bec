"""Plans and probes, as values: a plan says what to send, in stages.

A plan file is ordinary Python that defines ``PLAN``; ``probing.plans.loader`` runs it::

    from sphero_probe import Command, Plan, Probe

    PLAN = Plan(
        name="power",
        summary="What the battery says",
        stages=[[Probe(Command(0x13, 0x10)), Probe(Command(0x13, 0x03))]],
    )
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from sphero_probe.probing.finding import Finding
from sphero_probe.protocol.packets import Command


class Probe(NamedTuple):
    """One command to send.

    Attributes:
        command: DID and CID, the node (None: the robot's usual one) and, if given, the argument bytes.
        exact: send the payload unchanged, even if it is empty. Otherwise an empty payload is filled in:
            documented reads get proper arguments, all other commands a length that no command takes.
    """

    command: Command
    exact: bool = False


Stage = Iterable[Probe] | Callable[[Sequence[Finding]], Iterable[Probe]]


@dataclass(frozen=True, slots=True)
class Plan:
    """What to send, in stages.

    Attributes:
        name: one word.
        summary: one line.
        stages: each is probes, or a function that makes them from the findings so far.
        robots: keys of the robots it is meant for, empty for any.
        file: where it was loaded from, None for one built in memory.
        survey: first ask which nodes the robot has, as ``nodes`` does, and keep that as a note.
        verify: at the end, send what exists or was silent, and a part of the rest, once more, one at a time.
        claimed_by: the source that says that the robot has every command of this plan, empty for none; the
            run then reports which of them are absent.
        stage_names: a word or two for each stage, for the progress of a run; may be shorter than ``stages``.
    """

    name: str
    summary: str
    stages: Sequence[Stage]
    robots: tuple[str, ...] = ()
    file: Path | None = None
    verify: bool = False
    survey: bool = False
    claimed_by: str = ""
    stage_names: Sequence[str] = ()

    def stage_name(self, index: int) -> str:
        """Return the name of a stage: as given, else that of its function, else that of the plan.

        Args:
            index: of the stage, from 0.
        """
        if index < len(self.stage_names):
            return self.stage_names[index]
        made = getattr(self.stages[index], "__name__", "")
        return made.strip("_").replace("_", " ") if made.isidentifier() else self.name

    @property
    def open_stages(self) -> tuple[str, ...]:
        """The names of the stages that are made from findings, each once."""
        names = (self.stage_name(index) for index, stage in enumerate(self.stages) if callable(stage))
        return tuple(dict.fromkeys(names))


def sweep(
    dids: Iterable[int], cids: Iterable[int], target: int | None = None, payload: bytes | None = None
) -> Iterator[Probe]:
    """Yield a probe for every DID with every CID.

    Args:
        dids: device ids.
        cids: command ids.
        target: address byte of the node, None for the robot's usual one.
        payload: send exactly these bytes; None leaves the choice to the engine.
    """
    cids = tuple(cids)
    for did in dids:
        for cid in cids:
            yield Probe(Command(did, cid, payload or b"", target), exact=payload is not None)
