"""Points to ``evidence`` where a robot can settle open questions."""

import shlex
from typing import Final

from sphero_probe.catalogue.model import Robot
from sphero_probe.cli.messages import say
from sphero_probe.probing.open_questions import questions_for
from sphero_probe.session.addressing import address_of, generation_behind

_NOT_REAL: Final = ("fake", "replay")


def suggest_evidence(device: str, robot: Robot | None) -> None:
    """Print one line that points to ``evidence``; none for a robot that is not real.

    Args:
        device: as it was typed, empty for the only robot nearby.
        robot: the model, None if it is not known.
    """
    place = address_of(device)
    if place.scheme in _NOT_REAL:
        return
    generation = robot.generation if robot else generation_behind(place)
    count = len(questions_for(robot, generation))
    which = f" --device {shlex.quote(device)}" if device else ""
    say(f"this robot can settle up to {count} open questions: sphero-probe evidence{which} -o NAME")
