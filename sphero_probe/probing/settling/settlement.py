"""What evidence says about one question, as a value, and what several questions need to say it."""

from collections.abc import Mapping
from typing import NamedTuple

from sphero_probe.probing.evidence import Asked, Evidence
from sphero_probe.probing.notes import node_name
from sphero_probe.protocol.codec import Codec


class Settlement(NamedTuple):
    """What evidence says about one question.

    Attributes:
        settled: whether it answers the question for this robot and firmware.
        text: the answer, or what is missing.
    """

    settled: bool
    text: str


def unsettled(text: str) -> Settlement:
    """Return that evidence does not answer a question, and what is missing."""
    return Settlement(settled=False, text=text)


def settled(text: str) -> Settlement:
    """Return the answer to a question."""
    return Settlement(settled=True, text=text)


def told(evidence: Evidence, said: Mapping[str, str], missing: str) -> Settlement:
    """Return what is said of each node, once if the same is said of all.

    Args:
        evidence: of the robot; if it has one node, that one is not named.
        said: node -> what is said of it.
        missing: what is missing if nothing is said.
    """
    if not said:
        return unsettled(missing)
    if len(set(said.values())) == 1:
        (text,) = set(said.values())
        is_plain = len(said) == len(evidence.nodes) == 1
        return settled(text if is_plain else f"{text} ({', '.join(said)})")
    return settled("; ".join(f"{node}: {text}" for node, text in said.items()))


def node_of(evidence: Evidence, asked: Asked) -> str:
    """Return the name of the node that a command was sent to."""
    robot = evidence.model
    if asked.command.target is None:
        return "no address" if robot is None or robot.addressed else "robot"
    return node_name(asked.command.target, robot)


def code_text(codec: Codec, code: int | None) -> str:
    """Return a code with its name: ``0x02 bad command id``."""
    return "nothing" if code is None else f"0x{code:02x} {codec.code_name(code)}"


def bytes_text(count: int) -> str:
    """Return a number of bytes in words."""
    return f"{count} byte" if count == 1 else f"{count} bytes"
