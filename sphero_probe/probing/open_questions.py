"""The open questions about robots' firmware, as data, and what the answers of an evidence run settle.

They come from public notes on real robots. For each question there is a pure function from evidence to a
``Settlement``.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Final, NamedTuple

from sphero_probe.catalogue.model import Robot
from sphero_probe.catalogue.provenance import SIGHTINGS
from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.probing.evidence import Evidence
from sphero_probe.probing.settling import answers, checks, limits
from sphero_probe.probing.settling.settlement import Settlement
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Generation

_ATRIZ: Final = "Bura-hub/Atriz_migracion_ros2"
_R2: Final = "zaremy/r2-z2"
_PYTHON_SDK: Final = "sphero-sdk-raspberrypi-python"
_NODE_SDK: Final = "sphero-sdk-raspberrypi-nodejs"


def _any(_: Codec) -> bool:
    return True


def _has_addresses(codec: Codec) -> bool:
    return codec.has_addresses


def _has_lists(codec: Codec) -> bool:
    return row_for(codec.generation, WellKnown.CLAIMED_COMMANDS) is not None


def _has_codes(codec: Codec) -> bool:
    return row_for(codec.generation, WellKnown.ERROR_ON_DEMAND) is not None


def _has_data_in_echoes(codec: Codec) -> bool:
    echo = row_for(codec.generation, WellKnown.ECHO)
    return echo is not None and echo.request is not None and bool(echo.request.text)


class OpenQuestion(NamedTuple):
    """Something about robots that no public source answers, or that sources contradict each other on.

    Attributes:
        key: one word.
        text: the question.
        settle: evidence -> what it says about the question.
        background: what public sources say so far, and which; empty where they say nothing.
        robots: keys of the models it is about, empty for all.
        applies: whether robots of a protocol can be asked.
    """

    key: str
    text: str
    settle: Callable[[Evidence], Settlement]
    background: str = ""
    robots: tuple[str, ...] = ()
    applies: Callable[[Codec], bool] = _any


OPEN_QUESTIONS: Final = (
    OpenQuestion(
        "command-before-length",
        "Does the robot look a command up before it checks the length?",
        checks.command_before_length,
        f"a missing command is answered with 0x02 ({_R2}, {_ATRIZ}); no source gives the order of the checks",
    ),
    OpenQuestion(
        "device-before-length",
        "Does the robot look a device up before it checks the length?",
        checks.device_before_length,
    ),
    OpenQuestion(
        "exact-length",
        "Does a documented read reject surplus and missing bytes?",
        checks.exact_length,
    ),
    OpenQuestion(
        "bad-value",
        "How is a value out of range answered, and is the length checked first?",
        checks.bad_value,
        f"ids that do not exist get success with plausible numbers on an RVR ({_ATRIZ}, evidence 43)",
        applies=_has_lists,
    ),
    OpenQuestion(
        "rare-codes",
        "When does the robot answer 0x04 restricted, 0x05 bad data length or 0x08 busy?",
        answers.rare_codes,
        "no source gives an example",
        applies=_has_addresses,
    ),
    OpenQuestion(
        "queue-depth",
        "How many commands can wait while the robot serves one?",
        limits.queue_depth,
    ),
    OpenQuestion(
        "answer-order",
        "Does the robot answer commands in the order in which they were sent?",
        limits.answer_order,
        "881 commands of the maker's app to a Mini, two at most in flight, were answered in order",
    ),
    OpenQuestion(
        "own-lists",
        "What do the robot's own lists (0x10:0x05, 0x10:0x06) hold?",
        answers.own_lists,
        applies=_has_lists,
    ),
    OpenQuestion(
        "codes-on-demand",
        "Which nodes answer 0x10:0x09, and with which flags?",
        answers.codes_on_demand,
        f"with flags 0x1e the Nordic node of an RVR was silent ({_PYTHON_SDK}, cad872c and 3efde61)",
        applies=_has_codes,
    ),
    OpenQuestion(
        "addresses",
        "Are target and source swapped in the robot's answers over Bluetooth LE?",
        answers.addresses,
        applies=_has_addresses,
    ),
    OpenQuestion(
        "second-node",
        "Does a second node answer over Bluetooth LE?",
        answers.second_node,
        f"the wrong node answers as if the command did not exist ({_NODE_SDK}, issue 1)",
        applies=_has_addresses,
    ),
    OpenQuestion(
        "echo-size",
        "What is the largest payload that an echo returns?",
        limits.echo_size,
        "the maker's document names 16 bytes",
        applies=_has_data_in_echoes,
    ),
    OpenQuestion(
        "chunk-size",
        "How many bytes does the robot send at once over Bluetooth LE, and how many does it take?",
        limits.chunk_size,
        "a Mini sends almost byte by byte in a public capture",
    ),
    OpenQuestion(
        "missing-commands",
        "Does this firmware have the commands that others found missing (0x13:0x27, 0x18:0x52)?",
        answers.missing_commands,
        f"18/52 exists in 8.x and not in 9.x ({_ATRIZ}, evidence 41 and 42; {_NODE_SDK}, issue 6)",
        robots=("rvr",),
    ),
    OpenQuestion(
        "bolt-plus",
        "Which firmware and which nodes does a BOLT+ have, and how does it check lengths?",
        answers.measured_nodes,
        "one description and one untested class are all that is public",
        robots=("bolt-plus",),
    ),
    OpenQuestion(
        "sleep",
        "After which time without commands does the robot sleep, and what does it send before?",
        limits.sleep,
        f"an RVR sleeps after 300.6 s ({_ATRIZ}, evidence 12)",
    ),
)
"""Every open question, the most wanted first."""


def questions_for(robot: Robot | None, generation: Generation) -> tuple[OpenQuestion, ...]:
    """Return the questions that a robot can help to settle.

    Args:
        robot: the model, None if it is not known.
        generation: its protocol.
    """
    codec = CODECS[generation]
    return tuple(
        question
        for question in OPEN_QUESTIONS
        if question.applies(codec) and (not question.robots or (robot and robot.key in question.robots))
    )


def settlements(evidence: Evidence) -> Iterator[tuple[OpenQuestion, Settlement]]:
    """Yield each question that the robot of some evidence can help to settle, with what the evidence says."""
    for question in questions_for(evidence.model, evidence.generation):
        yield question, question.settle(evidence)


def is_known_firmware(robot: Robot | None, firmware: Mapping[str, str]) -> bool:
    """Whether public reports name this model with each of these versions.

    Args:
        robot: the model, None if it is not known.
        firmware: node name -> version.
    """
    known = {sighting.firmware for sighting in SIGHTINGS if robot and sighting.robot == robot.key}
    return bool(firmware) and known.issuperset(firmware.values())
