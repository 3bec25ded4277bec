"""An evidence run sends only what is harmless, and settles questions as the built-in robot really is."""

from pathlib import Path

import pytest

from sphero_probe.catalogue import ROBOTS
from sphero_probe.catalogue.model import AnswerStyle
from sphero_probe.catalogue.risk import Risk
from sphero_probe.probing.evidence import Ending, Topic
from sphero_probe.probing.open_questions import OPEN_QUESTIONS, is_known_firmware, questions_for
from sphero_probe.protocol.packets import Generation
from sphero_probe.simulator import FakeRobot, parse_settings
from sphero_probe.simulator.firmware import Firmware, FirmwareCommand, Lengths
from sphero_probe.simulator.settings import Strict
from tests.support.cli import objects
from tests.support.evidence import collect, settled

V2_ROBOTS = [key for key, robot in ROBOTS.items() if robot.generation is Generation.V2]
TWO_NODES = [key for key, robot in ROBOTS.items() if len(robot.nodes) > 1]
ADDRESSED = [key for key, robot in ROBOTS.items() if robot.addressed]
FEW = ("bolt", "mini", "bb8")
WITHOUT_ABSENT_READS = ("sphero", "sprk")
"""No other V1 model has a harmless read that these lack."""
MOST_FRAMES = {1: 75, 2: 150}
"""Nodes -> frames of a run: 31 are echoes at once; on an RVR, 50 ask for a code."""
FAULTS = ["strict=none", "strict=minimum", "mask=1", "hidden=40&claims=lying", "strict=none&mask=1&hidden=40"]
FIRST = "the command first: an absent command is called absent at every length"
LENGTH_FIRST = "the length first: with a payload, an absent command is answered bad data length"


@pytest.mark.unmeasured
@pytest.mark.parametrize("key", ROBOTS)
@pytest.mark.parametrize("fault", ["", *(pytest.param(fault, marks=pytest.mark.slow) for fault in FAULTS)])
def test_nothing_above_a_read_is_ever_executed(key: str, fault: str, tmp_path: Path) -> None:
    """The ledger is the simulator's own: it knows what a command does, whatever the catalogue thinks."""
    ledger = tmp_path / "ledger"
    evidence = collect(f"{key}?ledger={ledger}&{fault}")
    executed = objects(ledger.read_text())
    assert len(executed) > 30
    assert {line["risk"] for line in executed} == {"read"}
    assert evidence.complete
    assert not evidence.surprises
    assert [burst.sent for burst in evidence.bursts] == [1, 2, 4, 8, 16]
    assert len(evidence.nodes) == len(ROBOTS[key].nodes)
    if not fault:
        assert 40 <= evidence.frames_sent <= MOST_FRAMES[len(ROBOTS[key].nodes)]
        assert {node.strictness for node in evidence.nodes} == {"strict"}


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    "key", [key if key in FEW else pytest.param(key, marks=pytest.mark.slow) for key in ROBOTS]
)
@pytest.mark.parametrize(
    ("settings", "lengths"),
    [
        pytest.param("strict=exact", "surplus bytes are rejected", id="exact"),
        pytest.param("strict=minimum", "surplus bytes are accepted", id="minimum"),
        pytest.param("strict=none", "surplus bytes are accepted", id="none"),
    ],
)
@pytest.mark.parametrize("mask", [False, True])
def test_the_order_of_the_checks_is_that_of_the_robot(
    key: str, settings: str, lengths: str, *, mask: bool
) -> None:
    """``mask=1``: lengths are checked before the command is looked up, in all devices that are there."""
    said = settled(collect(f"{key}?{settings}&mask={int(mask)}"))
    order = said["command-before-length"]
    if key in WITHOUT_ABSENT_READS and mask:
        assert not order.settled  # what answers "bad length" may exist, so it is not sent at other lengths
        return
    assert order.settled
    assert order.text.startswith(LENGTH_FIRST if mask else FIRST)
    assert said["device-before-length"].text.startswith("the device first")
    assert lengths in said["exact-length"].text
    if key == "bolt":
        missing = "missing bytes are accepted" if "none" in settings else "missing bytes are rejected"
        assert missing in said["exact-length"].text


@pytest.mark.parametrize("key", ["bolt", "bb8"])
@pytest.mark.parametrize("places", [1, 4, 12])
@pytest.mark.parametrize("overflow", ["lost", "busy"])
def test_the_queue_is_as_deep_as_the_robot_has_it(key: str, places: int, overflow: str) -> None:
    """One command is served while as many wait as there are places [the simulator's ``queue`` key]."""
    said = settled(collect(f"{key}?queue={places}&overflow={overflow}"))["queue-depth"]
    room = places + 1
    full = max(size for size in (1, 2, 4, 8, 16) if size <= room)
    rest = "lost" if overflow == "lost" else "answered with busy"
    assert said.settled
    assert said.text == (
        f"{full} echoes sent at once were all answered; of {2 * full}, {room} were, the rest was {rest}"
    )


@pytest.mark.unmeasured
@pytest.mark.parametrize("fault", ["loss=0.15", "busy=0.3"])
@pytest.mark.parametrize("seed", range(3))
def test_no_queue_is_made_of_a_bad_link(fault: str, seed: int) -> None:
    said = settled(collect(f"bolt?{fault}&seed={seed}"))["queue-depth"]
    assert not said.settled or said.text.startswith("at least 16")


TRUE_ON_ANY_LINK = (
    *("command-before-length", "device-before-length", "exact-length", "bad-value", "own-lists"),
    *("addresses", "second-node", "missing-commands"),
)


@pytest.mark.unmeasured
@pytest.mark.parametrize("fault", ["loss=0.1", "busy=0.2", "corrupt=0.05&duplicate=0.1", "reorder=0.3"])
@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 12))])
def test_a_bad_link_leaves_questions_open_and_answers_none_wrongly(fault: str, seed: int) -> None:
    """Independent: the same robot on a link without faults."""
    quiet, said = settled(collect(f"rvr?seed={seed}")), settled(collect(f"rvr?seed={seed}&{fault}"))
    wrong = {
        key: (said[key].text, quiet[key].text)
        for key in TRUE_ON_ANY_LINK
        if said[key].settled and not set(parts(said[key].text)) <= set(parts(quiet[key].text))
    }
    assert wrong == {}


def parts(text: str) -> list[str]:
    """Return what a text says of each node; less may be known of a node on a bad link."""
    said, _, nodes = text.partition(" (")
    return [said] if nodes else text.split("; ")


@pytest.mark.unmeasured
@pytest.mark.parametrize("seed", range(2))
def test_answers_out_of_order_are_told(seed: int) -> None:
    told = settled(collect(f"bolt?reorder=0.5&latency=5ms&seed={seed}"))["answer-order"]
    assert told.settled
    assert told.text.startswith("no: not the answers to")
    assert settled(collect(f"bolt?seed={seed}"))["answer-order"].text == "yes, up to 16 echoes at once"


@pytest.mark.parametrize("key", ADDRESSED)
def test_the_lists_are_those_of_the_robot(key: str) -> None:
    """Independent: the devices of the commands that exist, as the simulator's truth has them."""
    told = settled(collect(key))["own-lists"].text
    truth = FakeRobot(parse_settings(key)).truth()
    for node, name in ROBOTS[key].nodes.items():
        devices = bytes(sorted({fact.did for fact in truth if fact.node == node}))
        assert f"devices {devices.hex(' ')}" in told
        assert len(ROBOTS[key].nodes) == 1 or f"{name}: devices {devices.hex(' ')}" in told


@pytest.mark.unmeasured
@pytest.mark.parametrize("key", V2_ROBOTS)
def test_codes_addresses_and_nodes_are_those_of_the_robot(key: str) -> None:
    robot, said = ROBOTS[key], settled(collect(key))
    codes = "10 of 10 codes as asked for" if key.startswith("rvr") else "answers 0x02 bad command id"
    assert codes in said["codes-on-demand"].text
    styles = {
        AnswerStyle.SWAPPED: "swapped",
        AnswerStyle.SOURCE_ONLY: "answers carry the source only",
        AnswerStyle.NONE: "answers carry no addresses",
    }
    assert said["addresses"].text == styles[robot.answer_style]
    second = "yes, an echo at 0x12 comes back"
    assert (said["second-node"].text == second) == (key in TWO_NODES)
    assert said["echo-size"].text == "16 bytes come back; 17 got 0x05 bad data length"


def test_flags_and_nodes_of_the_codes_are_as_asked() -> None:
    """Flags 3A, 1E and 0A, as in the public reports of an RVR."""
    asked = [one for one in collect("rvr").asked if one.command[:2] == (0x10, 0x09) and one.command.payload]
    forms = {(one.flags, one.command.target): 0 for one in asked if len(one.command.payload) == 1}
    for one in asked:
        if one.topic is not Topic.ORDER:
            forms[one.flags, one.command.target] += one.code == one.command.payload[0]
    assert forms == dict.fromkeys([(0x3A, 0x11), (0x3A, 0x12), (0x1E, 0x11), (0x1E, 0x12), (0x0A, None)], 10)


def test_over_a_serial_line_nothing_is_said_of_bluetooth() -> None:
    said = settled(collect("rvr?line=uart"))
    assert not said["addresses"].settled
    assert not said["second-node"].settled


@pytest.mark.parametrize("size", [1, 7, 20])
def test_the_pieces_are_as_large_as_the_robot_sends_them(size: int) -> None:
    evidence = collect(f"mini?split={size}&latency=5ms")
    assert max(evidence.chunks) == size
    assert f"at most {size} byte" in settled(evidence)["chunk-size"].text


@pytest.mark.parametrize(("key", "heard"), [("bolt", ["13:19", "13:1a"]), ("bb8", ["05", "14"])])
def test_a_robot_that_falls_asleep_is_heard(key: str, heard: list[str]) -> None:
    evidence = collect(f"{key}?sleep_after=90s", idle=120)
    idle = evidence.idle
    assert idle
    names = [f"{one.cid:02x}" if one.did is None else f"{one.did:02x}:{one.cid:02x}" for one in idle.heard]
    assert names == heard
    assert [one.after for one in idle.heard] == [80.0, 90.0]
    assert idle.awake is False
    said = settled(evidence)["sleep"]
    assert said.settled
    assert said.text.startswith("asleep after 120 s; notifications: ")
    assert "will_sleep" in said.text


def test_a_robot_that_stays_awake_leaves_the_question_open() -> None:
    said = settled(collect("bolt?sleep_after=300s", idle=60))["sleep"]
    assert said == (False, "it was still awake after 60 s; no notification")


@pytest.mark.unmeasured
@pytest.mark.parametrize("after", range(5, 100, 23))
def test_a_link_that_drops_once_costs_no_answer(after: int) -> None:
    """Each question is as settled as without the drop, unless two drops in one part left it out."""
    before, evidence = settled(collect("bolt")), collect(f"bolt?disconnect_after={after}")
    said = settled(evidence)
    if evidence.complete:
        assert {key: one.settled for key, one in said.items()} == {
            key: one.settled for key, one in before.items()
        }
    assert said["command-before-length"].text.startswith(FIRST)


def test_a_node_that_answers_nothing_is_left_alone() -> None:
    evidence = collect("rvr?die=2@0s")
    assert [node.strictness for node in evidence.nodes] == ["strict", "unknown"]
    silent = [
        one for one in evidence.asked if one.ending is Ending.SILENT and one.topic is not Topic.CALIBRATION
    ]
    assert {one.topic for one in silent} <= {Topic.NODES}
    assert settled(evidence)["second-node"].text == "no answer to an echo at 0x12"
    assert evidence.seconds < 60


def test_an_executed_setter_is_reported_and_ends_wrong_lengths(monkeypatch: pytest.MonkeyPatch) -> None:
    """A firmware of which reads check lengths, and the LED setter does not."""
    from sphero_probe.simulator import execution

    takes = execution._takes

    def lenient_setter(command: object, length: int, strict: object) -> bool:
        return getattr(command, "cid", None) == 0x1C or takes(command, length, strict)  # type: ignore[arg-type]

    monkeypatch.setattr(execution, "_takes", lenient_setter)
    evidence = collect("bolt-plus?seed=77")  # of no other test: results are kept
    assert [command[:2] for command in evidence.surprises] == [(0x1A, 0x1C)]
    assert evidence.nodes[0].strictness == "lenient"
    assert {one.ending for one in evidence.asked if one.command[:2] == (0x10, 0xFD)} >= {Ending.ANSWERED}


@pytest.mark.parametrize("length", [0, 2])
@pytest.mark.parametrize("strict", [*Strict])
def test_a_command_that_could_not_exist_and_does_is_not_run(
    length: int, strict: Strict, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A firmware with a command where calibration looks for an absent one; at 11 bytes it is rejected."""
    real = Firmware.find

    def find(firmware: Firmware, node: int, did: int, cid: int) -> FirmwareCommand | None:
        if (did, cid) == (0x10, 0xFD):
            return FirmwareCommand(node, did, cid, Lengths(length, length), Risk.PERSIST)
        return real(firmware, node, did, cid)

    monkeypatch.setattr(Firmware, "find", find)
    ledger = tmp_path / "ledger"
    evidence = collect(f"bolt-plus?ledger={ledger}&strict={strict}")
    ran = [line for line in objects(ledger.read_text()) if line["risk"] != "read"]
    if strict is Strict.EXACT:
        assert ran == []
        assert settled(evidence)["command-before-length"].text == FIRST
    else:  # calibration itself meets it, as in any run; nothing is sent to it after that
        assert {len(line["payload"]) for line in ran} == {22}
        assert len(ran) == 1


@pytest.mark.parametrize("key", ROBOTS)
def test_every_robot_has_open_questions(key: str) -> None:
    robot = ROBOTS[key]
    keys = [question.key for question in questions_for(robot, robot.generation)]
    assert len(keys) == len(set(keys)) >= 6
    assert ("own-lists" in keys) == (robot.generation is Generation.V2)
    assert ("bolt-plus" in keys) == (key == "bolt-plus")


def test_each_open_question_of_the_public_record_is_asked() -> None:
    """Independent: the list of open questions in the public record, each with the keys that stand for it."""
    asked = {
        "order of the checks: device, command, length, value": (
            "device-before-length command-before-length bad-value"
        ),
        "whether lengths are checked exactly; surplus bytes": "exact-length",
        "which answers 0x04, 0x05 and 0x08 are given for": "rare-codes",
        "depth of the command queue": "queue-depth",
        "what 10/05 and 10/06 answer on any robot": "own-lists",
        "whether addresses are swapped in answers over BLE": "addresses",
        "everything about BOLT+ beyond the reference": "bolt-plus",
    }
    keys = {question.key for question in OPEN_QUESTIONS}
    assert {key for line in asked.values() for key in line.split()} <= keys


@pytest.mark.parametrize(
    ("key", "firmware", "known"),
    [
        pytest.param("rvr", {"primary": "9.1.462", "secondary": "9.2.482"}, True, id="reported"),
        pytest.param("rvr", {"primary": "9.1.462", "secondary": "1.0.0"}, False, id="one node differs"),
        pytest.param("bolt-plus", {"primary": "9.1.462"}, False, id="another model"),
        pytest.param("rvr", {}, False, id="not told"),
        pytest.param("", {"robot": "9.1.462"}, False, id="unknown model"),
    ],
)
def test_known_firmware(key: str, firmware: dict[str, str], *, known: bool) -> None:
    """Versions from reports in public trackers: Bura-hub/Atriz_migracion_ros2, evidence 41."""
    assert is_known_firmware(ROBOTS.get(key), firmware) == known
