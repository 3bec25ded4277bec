"""The known robots: one entry per model, with its LEDs."""

from sphero_probe.catalogue.model import AnswerStyle, LedGroup, LedTable, Robot
from sphero_probe.protocol.packets import Generation

_ONE_NODE = {1: "primary"}
_TWO_NODES = {1: "primary", 2: "secondary"}
_NO_NODES = {1: "robot"}

_BOLT_LEDS = LedTable(
    did=0x1A,
    cid=0x1C,
    mask_bytes=1,
    node=1,
    groups=(LedGroup("front", (0, 1, 2)), LedGroup("back", (3, 4, 5))),
)
_RVR_LEDS = LedTable(
    did=0x1A,
    cid=0x1A,
    mask_bytes=4,
    node=1,
    groups=(
        LedGroup("right_headlight", (0, 1, 2), ("front", "headlights")),
        LedGroup("left_headlight", (3, 4, 5), ("front", "headlights")),
        LedGroup("left_status_indication", (6, 7, 8), ("status_indication",)),
        LedGroup("right_status_indication", (9, 10, 11), ("status_indication",)),
        LedGroup("battery_door_rear", (12, 13, 14), ("battery_door",)),
        LedGroup("battery_door_front", (15, 16, 17), ("battery_door",)),
        LedGroup("power_button_front", (18, 19, 20), ("power_button",)),
        LedGroup("power_button_rear", (21, 22, 23), ("power_button",)),
        LedGroup("left_brakelight", (24, 25, 26), ("back", "brakelights")),
        LedGroup("right_brakelight", (27, 28, 29), ("back", "brakelights")),
        LedGroup("undercarriage", (30,)),
    ),
)
_DROID_LEDS = LedTable(
    did=0x1A,
    cid=0x0E,
    mask_bytes=2,
    node=None,
    groups=(
        LedGroup("front", (0, 1, 2)),
        LedGroup("logic_displays", (3,)),
        LedGroup("back", (4, 5, 6)),
        LedGroup("holo_projector", (7,)),
    ),
)
_MINI_LEDS = LedTable(
    did=0x1A,
    cid=0x0E,
    mask_bytes=2,
    node=None,
    groups=(
        LedGroup("aiming", (0,), ("back",)),
        LedGroup("body", (1, 2, 3), ("front",)),
        LedGroup("user_body", (4, 5, 6)),
    ),
)
_BB9E_LEDS = LedTable(
    did=0x1A,
    cid=0x0E,
    mask_bytes=2,
    node=None,
    groups=(
        LedGroup("body", (0, 1, 2), ("front",)),
        LedGroup("aiming", (3,), ("back",)),
        LedGroup("head", (4,)),
    ),
)
_V1_LEDS = LedTable(
    did=0x02,
    cid=0x20,
    mask_bytes=0,
    node=None,
    groups=(
        LedGroup("main", (0, 1, 2), ("front",), cid=0x20, tail=b"\0"),  # a zero: not to be remembered
        LedGroup("back", (3,), cid=0x21),
    ),
)

_V2_ROBOTS = (
    Robot(
        key="bolt",
        name="Sphero BOLT",
        generation=Generation.V2,
        prefix="SB-",
        nodes=_TWO_NODES,
        addressed=True,
        answer_style=AnswerStyle.SOURCE_ONLY,
        handshake=True,
        leds=_BOLT_LEDS,
    ),
    Robot(
        key="bolt-plus",
        name="Sphero BOLT+",
        generation=Generation.V2,
        prefix="BP-",
        nodes=_ONE_NODE,
        addressed=True,
        answer_style=AnswerStyle.SWAPPED,
        handshake=False,
        leds=_BOLT_LEDS,
        aliases=("bolt+", "boltplus", "bolt_plus"),
    ),
    Robot(
        key="mini",
        name="Sphero Mini",
        generation=Generation.V2,
        prefix="SM-",
        nodes=_ONE_NODE,
        addressed=False,
        answer_style=AnswerStyle.NONE,
        handshake=True,
        leds=_MINI_LEDS,
        aliases=("sphero-mini",),
    ),
    Robot(
        key="rvr",
        name="Sphero RVR",
        generation=Generation.V2,
        prefix="RV-",
        nodes=_TWO_NODES,
        addressed=True,
        answer_style=AnswerStyle.SWAPPED,
        handshake=False,
        leds=_RVR_LEDS,
    ),
    Robot(
        key="rvr-plus",
        name="Sphero RVR+",
        generation=Generation.V2,
        prefix="RV-",
        nodes=_TWO_NODES,
        addressed=True,
        answer_style=AnswerStyle.SWAPPED,
        handshake=False,
        leds=_RVR_LEDS,
        aliases=("rvr+", "rvrplus", "rvr_plus"),
    ),
    Robot(
        key="r2d2",
        name="R2-D2",
        generation=Generation.V2,
        prefix="D2-",
        nodes=_ONE_NODE,
        addressed=False,
        answer_style=AnswerStyle.NONE,
        handshake=True,
        leds=_DROID_LEDS,
        aliases=("r2-d2",),
    ),
    Robot(
        key="r2q5",
        name="R2-Q5",
        generation=Generation.V2,
        prefix="Q5-",
        nodes=_ONE_NODE,
        addressed=False,
        answer_style=AnswerStyle.NONE,
        handshake=True,
        leds=_DROID_LEDS,
        aliases=("r2-q5",),
    ),
    Robot(
        key="bb9e",
        name="BB-9E",
        generation=Generation.V2,
        prefix="GB-",
        nodes=_ONE_NODE,
        addressed=False,
        answer_style=AnswerStyle.NONE,
        handshake=True,
        leds=_BB9E_LEDS,
        aliases=("bb-9e",),
    ),
    Robot(
        key="lmq",
        name="Lightning McQueen",
        generation=Generation.V2,
        prefix="LM-",
        nodes=_ONE_NODE,
        addressed=False,
        answer_style=AnswerStyle.NONE,
        handshake=True,
        leds=None,
        aliases=("lightning-mcqueen", "mcqueen"),
    ),
)

_V1_ROBOTS = (
    Robot(
        key="sphero",
        name="Sphero",
        generation=Generation.V1,
        prefix="",
        nodes=_NO_NODES,
        addressed=False,
        answer_style=AnswerStyle.NONE,
        handshake=False,
        leds=_V1_LEDS,
        aliases=("sphero-1", "sphero-2", "sphero-2.0", "sphero2"),
    ),
    Robot(
        key="sprk",
        name="Sphero SPRK",
        generation=Generation.V1,
        prefix="",
        nodes=_NO_NODES,
        addressed=False,
        answer_style=AnswerStyle.NONE,
        handshake=False,
        leds=_V1_LEDS,
    ),
    Robot(
        key="sprk-plus",
        name="Sphero SPRK+",
        generation=Generation.V1,
        prefix="SK-",
        nodes=_NO_NODES,
        addressed=False,
        answer_style=AnswerStyle.NONE,
        handshake=True,
        leds=_V1_LEDS,
        aliases=("sprk+", "sprkplus", "sprk_plus"),
    ),
    Robot(
        key="ollie",
        name="Ollie",
        generation=Generation.V1,
        prefix="2B-",
        nodes=_NO_NODES,
        addressed=False,
        answer_style=AnswerStyle.NONE,
        handshake=True,
        leds=_V1_LEDS,
        aliases=("sphero-ollie",),
    ),
    Robot(
        key="bb8",
        name="BB-8",
        generation=Generation.V1,
        prefix="BB-",
        nodes=_NO_NODES,
        addressed=False,
        answer_style=AnswerStyle.NONE,
        handshake=True,
        leds=_V1_LEDS,
        aliases=("bb-8",),
    ),
)

ROBOTS: dict[str, Robot] = {robot.key: robot for robot in _V2_ROBOTS + _V1_ROBOTS}
"""Every robot by its key, in the order in which lists show them."""


def robot_by_word(text: str) -> Robot | None:
    """Find a robot by its key, alias or name, in upper or lower case; None where there is none."""
    word = text.strip().casefold()
    for robot in ROBOTS.values():
        if word in (robot.key, robot.name.casefold(), *robot.aliases):
            return robot
    return None


def robot_by_prefix(advertised_name: str) -> Robot | None:
    """Guess the robot from its advertised name; where models share a prefix, return the first of them."""
    fitting = [
        robot for robot in ROBOTS.values() if robot.prefix and advertised_name.startswith(robot.prefix)
    ]
    return max(fitting, key=lambda robot: len(robot.prefix), default=None)
