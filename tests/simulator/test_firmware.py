from collections.abc import Sequence

import pytest

from sphero_probe.catalogue import BRICK_DEVICES, ROBOTS, commands_of, rows_of
from sphero_probe.catalogue.model import Kind, Robot
from sphero_probe.catalogue.payload.layout import Layout
from sphero_probe.catalogue.risk import Risk
from sphero_probe.simulator import Claims, Settings
from sphero_probe.simulator.firmware import Fact, Firmware, FirmwareCommand, Lengths
from sphero_probe.simulator.response_style import RESPONSE_STYLES
from sphero_probe.simulator.settings import MOST_HIDDEN

SIMULATED = [robot for robot in ROBOTS.values() if robot.generation in RESPONSE_STYLES]
MODELS = [pytest.param(robot, id=robot.key) for robot in SIMULATED]
PROBE = 11


@pytest.mark.parametrize(
    ("lengths", "right", "wrong", "json"),
    [
        pytest.param(Lengths(0, 0), [0], [1, 11], [0], id="empty"),
        pytest.param(Lengths(4, 4), [4], [0, 3, 5], [4], id="fixed"),
        pytest.param(Lengths(0, 16), [0, 16], [17], ["0-16"], id="range"),
        pytest.param(Lengths(1, None), [1, 200], [0, 201], ["1-200"], id="variable"),
        pytest.param(Lengths(3, 9, 2), [3, 5, 9], [2, 4, 11], [3, 5, 7, 9], id="steps"),
    ],
)
def test_lengths(lengths: Lengths, right: list[int], wrong: list[int], json: Sequence[int | str]) -> None:
    assert [length for length in right if not lengths.accepts(length)] == []
    assert [length for length in wrong if lengths.accepts(length)] == []
    assert lengths.as_json() == json


@pytest.mark.parametrize("text", ["", "a:u16", "a:u8 b:bytes", "a:u8 b:u16*", "a:u8 b:uint", "a:cstring*4"])
def test_lengths_of_a_layout(text: str) -> None:
    layout = Layout(text)
    lengths = Lengths.of(layout)
    assert [lengths.accepts(length) for length in range(50)] == [
        layout.accepts(length) for length in range(50)
    ]


@pytest.mark.parametrize("model", MODELS)
def test_the_table_holds_every_documented_command_on_its_nodes(model: Robot) -> None:
    expected = {
        (node, row.did, row.cid)
        for row in commands_of(model)
        if row.kind is Kind.COMMAND
        for node in row.nodes[model.key]
    }
    commands = Firmware(Settings(model, matrix=True)).commands
    assert set(commands) == expected
    assert list(commands) == sorted(commands)
    for (node, did, cid), command in commands.items():
        assert (command.node, command.did, command.cid, command.hidden) == (node, did, cid, False)
        assert node in model.nodes
        assert command.row is not None
        assert command.risk is command.row.risk
        if command.row.request and (did, cid) != (0x10, 0x00):
            for length in range(40):
                assert command.lengths.accepts(length) == command.row.request.accepts(length)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("seed", range(4))
def test_hidden_commands_are_in_no_catalogue(model: Robot, seed: int) -> None:
    plain = Firmware(Settings(model, seed=seed))
    firmware = Firmware(Settings(model, seed=seed, hidden=40))
    hidden = [command for command in firmware.commands.values() if command.hidden]
    assert len(hidden) == 40
    assert {key for key, command in firmware.commands.items() if not command.hidden} == set(plain.commands)
    for command in hidden:
        assert rows_of(model.generation, command.did, command.cid) == ()
        assert command.row is None
        assert command.risk is not Risk.PROBE
        if command.lengths.maximum is not None:
            assert command.lengths.minimum == command.lengths.maximum
            assert command.lengths.minimum not in (11, 13)
        if command.did in BRICK_DEVICES[model.generation]:
            assert command.risk is Risk.BRICK
    assert firmware.commands == Firmware(Settings(model, seed=seed, hidden=40)).commands


def test_hidden_commands_differ_from_seed_to_seed_and_are_of_many_kinds() -> None:
    model = ROBOTS["rvr"]
    drawn = [
        {
            key: command
            for key, command in Firmware(Settings(model, seed=seed, hidden=30)).commands.items()
            if command.hidden
        }
        for seed in range(12)
    ]
    assert len({frozenset(keys) for keys in drawn}) == len(drawn)
    every = [command for commands in drawn for command in commands.values()]
    assert {command.risk for command in every} == set(Risk) - {Risk.PROBE}
    assert {command.lengths.minimum for command in every} >= {0, 1, 2, 4, 7, 16}
    lengths = [command.lengths.minimum for command in every]
    assert max(set(lengths), key=lengths.count) == 0
    documented = {did for _, did, _ in Firmware(Settings(model)).commands}
    assert any({did for _, did, _ in keys} - documented for keys in drawn)
    assert any(not {did for _, did, _ in keys} - documented for keys in drawn)


def _is_dangerous_and_variable(command: FirmwareCommand) -> bool:
    return (
        command.row is not None
        and command.row.request is not None
        and command.row.request.fixed_length is None
        and command.risk >= Risk.PERSIST
    )


@pytest.mark.unmeasured
def test_a_hidden_command_that_a_probe_would_execute_reads_or_has_dangerous_neighbours() -> None:
    """So few of them that it takes many robots to see one."""
    risks = set()
    for robot in SIMULATED:
        for seed in range(10):
            commands = Firmware(Settings(robot, seed=seed, hidden=300)).commands.values()
            neighbourhood = {
                (other.did, other.cid + distance)
                for other in commands
                if _is_dangerous_and_variable(other)
                for distance in range(-2, 3)
            }
            executed = {command for command in commands if command.hidden and command.lengths.accepts(PROBE)}
            harmful = {command for command in executed if command.risk is not Risk.READ}
            assert {(command.did, command.cid) for command in harmful} <= neighbourhood
            risks |= {command.risk for command in executed}
    assert {Risk.READ, Risk.BRICK} <= risks


@pytest.mark.parametrize("model", MODELS)
def test_there_is_room_for_all_that_may_be_hidden(model: Robot) -> None:
    assert sum(fact.hidden for fact in Firmware(Settings(model, hidden=MOST_HIDDEN)).truth()) == MOST_HIDDEN


def test_the_truth_is_the_table() -> None:
    firmware = Firmware(Settings(ROBOTS["bolt"], hidden=5))
    truth = firmware.truth()
    assert [(fact.node, fact.did, fact.cid) for fact in truth] == list(firmware.commands)
    assert sum(fact.hidden for fact in truth) == 5


def test_a_fact_as_json() -> None:
    fact = Fact(1, 0x1A, 0x1C, Lengths(1, None), Risk.WRITE, hidden=False)
    assert fact.as_json() == {
        "node": 1,
        "did": 26,
        "cid": 28,
        "lengths": ["1-200"],
        "risk": "write",
        "hidden": False,
    }


def _claimed(firmware: Firmware, nodes: dict[int, str]) -> set[tuple[int, int, int]]:
    return {
        (node, did, cid)
        for node in nodes
        for did in firmware.claimed_devices(node)
        for cid in firmware.claimed_commands(node, did)
    }


@pytest.mark.parametrize("seed", range(5))
def test_claims(seed: int) -> None:
    model = ROBOTS["rvr"]
    by_claims = {claims: Firmware(Settings(model, seed=seed, hidden=20, claims=claims)) for claims in Claims}
    told = {claims: _claimed(firmware, model.nodes) for claims, firmware in by_claims.items()}
    documented = {key for key, command in by_claims[Claims.TRUE].commands.items() if not command.hidden}
    assert told[Claims.TRUE] == documented
    assert told[Claims.PARTIAL] < documented
    assert {key for key in documented if key[1:] in {(0x10, 0x05), (0x10, 0x06)}} <= told[Claims.PARTIAL]
    ghosts = told[Claims.LYING] - documented
    assert ghosts
    assert ghosts.isdisjoint(by_claims[Claims.LYING].commands)
    assert {key for key in documented if key not in by_claims[Claims.NONE].commands} == {
        (node, 0x10, cid) for node in model.nodes for cid in (0x05, 0x06)
    }
