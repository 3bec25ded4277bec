"""The policy: what may be sent to which robot with which consent, for known and unknown commands."""

import itertools

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sphero_probe.catalogue import (
    BRICK_DEVICES,
    NO_EMPTY_PROBE_DEVICES,
    PERSIST_DEVICES,
    ROBOTS,
    all_rows,
    commands_of,
    lookup,
    rows_of,
)
from sphero_probe.catalogue.model import CommandRow, Kind, Robot
from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.policy import NEIGHBOURHOOD, Assessment, Consent, Policy, why_blocked
from sphero_probe.link.wrong_lengths import WRONG_LENGTH, WRONG_LENGTHS, is_wrong_length
from sphero_probe.protocol.packets import Command, Generation

V2 = Generation.V2
NODE = 0x11
ROBOT_NAME = "BP-1234"
EVERYTHING = Consent(frozenset(Risk), ROBOT_NAME)

ALL_ROBOTS = [None, *(robot for robot in ROBOTS.values() if robot.generation is V2)]
ROBOT_IDS = [robot.key if robot else "unknown robot" for robot in ALL_ROBOTS]
EACH_ROBOT = pytest.mark.parametrize("robot", ALL_ROBOTS, ids=ROBOT_IDS)
COMMAND_ROWS = [row for row in all_rows(V2) if row.kind is Kind.COMMAND]
NOTIFICATION_ONLY = sorted(
    {(row.did, row.cid) for row in all_rows(V2)} - {(row.did, row.cid) for row in COMMAND_ROWS}
)
DANGEROUS_DEVICES = BRICK_DEVICES[V2] | PERSIST_DEVICES[V2]
DEVICES = sorted({row.did for row in all_rows(V2)} | DANGEROUS_DEVICES | {0x00, 0x50, 0xEE, 0xFF})
PAIRS = sorted({(row.did, row.cid) for row in all_rows(V2)})
UNKNOWN = [(did, cid) for did in DEVICES for cid in range(256) if not rows_of(V2, did, cid)]
LENGTHS = [*range(21), 40, 64]


def policy(
    robot: Robot | None = None,
    consent: Consent | None = None,
    *,
    strict: bool = False,
    names: tuple[str, ...] = (ROBOT_NAME,),
) -> Policy:
    made = Policy(V2, robot, consent or Consent(), names)
    if strict:
        made.length_checks.trust(NODE)
        for did in range(256):
            made.length_checks.add_rejection(at(did, 0x00))
    return made


def at(did: int, cid: int, payload: bytes = b"") -> Command:
    return Command(did, cid, payload, NODE)


def meanings(did: int, cid: int, robot: Robot | None) -> list[CommandRow]:
    """What the pair may mean to this robot: what is said of it, or else all that is said of any."""
    rows = rows_of(V2, did, cid)
    return [row for row in rows if robot and robot.key in row.nodes] or list(rows)


def takes_any_length(row: CommandRow) -> bool:
    """Whether a persist or brick command has no single length that one could get wrong."""
    open_ended = row.request is None or row.request.fixed_length is None
    return row.kind is Kind.COMMAND and row.risk >= Risk.PERSIST and open_ended


def dangerous_neighbours(did: int, cid: int) -> list[CommandRow]:
    near = [row for other in range(cid - 2, cid + 3) for row in rows_of(V2, did, other)]
    return [row for row in near if takes_any_length(row)]


def is_impossible_pair(did: int, cid: int) -> bool:
    return cid in (0xFB, 0xFC, 0xFD) or (did in (0xEC, 0xED, 0xEE) and cid == 0)


def unknown_may_go(did: int, cid: int, payload: bytes, *, strict: bool) -> bool:
    if is_impossible_pair(did, cid) and did not in DANGEROUS_DEVICES:
        return payload in (bytes(11), bytes(13), bytes(40))
    return (
        strict
        and did not in DANGEROUS_DEVICES
        and payload in (bytes(11), bytes(13), bytes(40))
        and not dangerous_neighbours(did, cid)
    )


def known_may_go(row: CommandRow, payload: bytes, *, strict: bool) -> bool:
    if row.risk is Risk.READ:
        return True
    refusable = row.request is not None and not row.request.accepts(len(payload))
    return strict and refusable and row.risk is Risk.WRITE


def may_go(did: int, cid: int, payload: bytes, robot: Robot | None, *, strict: bool) -> bool:
    """The rules of the default consent, written independently."""
    rows = meanings(did, cid, robot)
    if not rows:
        return unknown_may_go(did, cid, payload, strict=strict)
    return all(
        known_may_go(row, payload, strict=strict)
        if row.kind is Kind.COMMAND
        else unknown_may_go(did, cid, payload, strict=strict)
        for row in rows
    )


@pytest.mark.unmeasured
@pytest.mark.parametrize("strict", [False, True], ids=["not measured", "strict"])
@EACH_ROBOT
def test_what_is_sent_of_the_whole_catalogue_by_default(robot: Robot | None, strict: bool) -> None:
    gate = policy(robot, strict=strict)
    for (did, cid), length in itertools.product(PAIRS, LENGTHS):
        for payload in (bytes(length), b"\x01" * length):
            sent = gate.why_blocked(at(did, cid, payload)) is None
            assert sent == may_go(did, cid, payload, robot, strict=strict), (
                f"{did:02x}/{cid:02x} {length} bytes"
            )


@pytest.mark.unmeasured
@pytest.mark.parametrize("strict", [False, True], ids=["not measured", "strict"])
def test_what_is_sent_of_all_unknown_commands_by_default(strict: bool) -> None:
    gate = policy(strict=strict)
    for (did, cid), payload in itertools.product(UNKNOWN, (b"", bytes(4), bytes(11), b"\x01" * 11)):
        sent = gate.why_blocked(at(did, cid, payload)) is None
        assert sent == unknown_may_go(did, cid, payload, strict=strict), (
            f"{did:02x}/{cid:02x} {payload.hex()}"
        )


@EACH_ROBOT
def test_proper_reads_are_always_sent_and_proper_anything_else_never(robot: Robot | None) -> None:
    gates = policy(robot), policy(robot, strict=True)
    for row in commands_of(robot) if robot else COMMAND_ROWS:
        mean = meanings(row.did, row.cid, robot)
        if row.request is None or any(each.kind is Kind.NOTIFICATION for each in mean):
            continue
        payload = row.sample if row.sample is not None else row.request.zeros()
        worst = max(each.risk for each in mean)
        for gate in gates:
            assert gate.assess(at(row.did, row.cid, payload)).risk is worst, row.name
            assert (gate.why_blocked(at(row.did, row.cid, payload)) is None) == (worst is Risk.READ), row.name


@pytest.mark.parametrize(
    ("command", "robot", "strict", "risk", "reason"),
    [
        pytest.param(at(0x13, 0x10), "bolt", False, Risk.READ, "a documented query", id="battery"),
        pytest.param(
            at(0x13, 0x10, bytes(11)), "bolt", False, Risk.READ, "documented", id="read, surplus bytes"
        ),
        pytest.param(at(0x13, 0x01), "bolt", True, Risk.MOTION, "power.sleep", id="sleep"),
        pytest.param(
            at(0x13, 0x01, bytes(11)), "bolt", True, Risk.MOTION, "not sent", id="sleep, wrong length"
        ),
        pytest.param(at(0x13, 0x01, bytes(11)), "bolt", False, Risk.MOTION, "not sent", id="sleep, lenient"),
        pytest.param(at(0x13, 0x00), "rvr", True, Risk.BRICK, "deep_sleep", id="deep sleep"),
        pytest.param(
            at(0x13, 0x00, bytes(11)), "rvr", True, Risk.BRICK, "not sent", id="deep sleep, wrong length"
        ),
        pytest.param(at(0x1D, 0x1C), "rvr", True, Risk.BRICK, "not sent", id="reset without argument"),
        pytest.param(at(0x1A, 0x35), "bolt", True, Risk.BRICK, "delete_all", id="delete all animations"),
        pytest.param(at(0x11, 0x2E), "rvr", True, Risk.BRICK, "erase_config", id="erase config"),
        pytest.param(at(0x16, 0x07, bytes(4)), "bolt-plus", True, Risk.MOTION, "drive", id="drive"),
        pytest.param(at(0x1A, 0x1C, bytes(7)), "bolt-plus", True, Risk.WRITE, "leds", id="LEDs"),
        pytest.param(
            at(0x1A, 0x1C, bytes(11)), "bolt-plus", True, Risk.WRITE, "leds", id="LEDs take 11 bytes, too"
        ),
        pytest.param(at(0x1A, 0x1C), "bolt-plus", True, Risk.PROBE, "does not take", id="LEDs without mask"),
        pytest.param(
            at(0x1A, 0x1C), "bolt-plus", False, Risk.WRITE, "not known", id="LEDs without mask, lenient"
        ),
        pytest.param(at(0x17, 0x25), "r2d2", False, Risk.READ, "documented", id="17/25 on R2-D2 reads"),
        pytest.param(at(0x17, 0x25), "lmq", True, Risk.MOTION, "set_shoulder", id="17/25 on McQueen moves"),
        pytest.param(at(0x17, 0x25), None, True, Risk.MOTION, "set_shoulder", id="17/25 on an unknown model"),
        pytest.param(
            at(0x17, 0x25), "mini", True, Risk.MOTION, "set_shoulder", id="17/25 on a robot without it"
        ),
        pytest.param(
            at(0x17, 0x05, bytes(11)), None, True, Risk.MOTION, "animation", id="one of two layouts unknown"
        ),
        pytest.param(
            at(0x17, 0x05, bytes(11)), "r2d2", True, Risk.MOTION, "not sent", id="this one's is known"
        ),
        pytest.param(
            at(0x50, 0x01, bytes(11)), None, True, Risk.PROBE, "no command takes", id="unknown device"
        ),
        pytest.param(
            at(0x50, 0x01, bytes(11)), None, False, Risk.PERSIST, "not known", id="unknown device, lenient"
        ),
        pytest.param(at(0x50, 0x01), None, True, Risk.PERSIST, "payload", id="unknown device, empty"),
        pytest.param(at(0x1A, 0x70), None, True, Risk.BRICK, "without payload", id="unknown of 1A, empty"),
        pytest.param(at(0x11, 0x70), None, True, Risk.BRICK, "without payload", id="unknown of 11, empty"),
        pytest.param(at(0x1A, 0x70, b"\x01"), None, True, Risk.BRICK, "payload", id="unknown of 1A, custom"),
        pytest.param(at(0x10, 0x04, bytes(11)), None, True, Risk.BRICK, "next to", id="next to the shell"),
        pytest.param(
            at(0x1D, 0x70, bytes(11)), None, True, Risk.BRICK, "dangerous device 0x1d", id="firmware device"
        ),
        pytest.param(
            at(0x20, 0x01, bytes(11)), None, True, Risk.PERSIST, "dangerous device 0x20", id="macro device"
        ),
    ],
)
def test_classes(command: Command, robot: str | None, strict: bool, risk: Risk, reason: str) -> None:
    assessment = policy(ROBOTS[robot] if robot else None, strict=strict).assess(command)
    assert assessment.risk is risk
    assert reason in assessment.reason


def test_the_dangerous_devices() -> None:
    assert BRICK_DEVICES[V2] == {0x1B, 0x1D, 0x1E, 0x1F, 0xFE}
    assert PERSIST_DEVICES[V2] == {0x20}
    assert NO_EMPTY_PROBE_DEVICES[V2] == {0x11, 0x1A}
    assert BRICK_DEVICES[Generation.V1] == {0x01}


@pytest.mark.parametrize("did", sorted(DANGEROUS_DEVICES), ids=lambda did: f"0x{did:02x}")
def test_unknown_commands_of_dangerous_devices_are_blocked(did: int) -> None:
    gate = policy(strict=True)
    for cid in range(256):
        if rows_of(V2, did, cid):
            continue
        gate.length_checks.mark_absent(at(did, cid))
        for payload in (b"", bytes(WRONG_LENGTH), bytes(13), bytes(40), b"\x01"):
            assert gate.why_blocked(at(did, cid, payload)) is not None
            assert gate.assess(at(did, cid, payload)).risk >= Risk.PERSIST


def test_the_dangerous_device_of_v1() -> None:
    gate = Policy(Generation.V1, None, Consent())
    gate.length_checks.trust(None)
    assert gate.assess(Command(0x01, 0xEE, bytes(WRONG_LENGTH))).risk is Risk.BRICK


def test_no_fixed_length_command_takes_a_wrong_length() -> None:
    assert WRONG_LENGTH in WRONG_LENGTHS
    lengths = {row.request.fixed_length for row in COMMAND_ROWS if row.request}
    assert not lengths & WRONG_LENGTHS


NEIGHBOURS = [
    pytest.param(row, id=row.name)
    for row in COMMAND_ROWS
    if takes_any_length(row) and row.did not in DANGEROUS_DEVICES
]


@pytest.mark.parametrize("row", NEIGHBOURS)
def test_unknown_neighbours_take_the_class_of_what_takes_any_length(row: CommandRow) -> None:
    gate = policy(strict=True)
    for cid in range(row.cid - NEIGHBOURHOOD, row.cid + NEIGHBOURHOOD + 1):
        if not 0 <= cid <= 0xFF or rows_of(V2, row.did, cid):
            continue
        worst = max(near.risk for near in dangerous_neighbours(row.did, cid))
        assessment = gate.assess(at(row.did, cid, bytes(WRONG_LENGTH)))
        assert assessment.risk is worst
        assert "next to" in assessment.reason
        assert gate.why_blocked(at(row.did, cid, bytes(WRONG_LENGTH))) is not None


def test_dangerous_neighbours_make_no_command_milder() -> None:
    near = [pair for pair in UNKNOWN if dangerous_neighbours(*pair)]
    far = {did: cid for did, cid in UNKNOWN if not dangerous_neighbours(did, cid)}
    assert near
    for gate in (policy(), policy(strict=True)):
        for (did, cid), payload in itertools.product(near, (b"", b"\x01", bytes(WRONG_LENGTH))):
            here, there = gate.assess(at(did, cid, payload)), gate.assess(at(did, far[did], payload))
            assert here.risk >= there.risk, f"{did:02x}/{cid:02x} {payload.hex()}"


@pytest.mark.parametrize(
    "pair",
    [
        pytest.param((did, cid), id=f"{did:02x}/{cid:02x}")
        for did, cid in NOTIFICATION_ONLY
        if did not in DANGEROUS_DEVICES
    ],
)
def test_notifications_are_no_commands(pair: tuple[int, int]) -> None:
    lenient, strict = policy(), policy(strict=True)
    for gate in (lenient, strict):
        assert gate.why_blocked(at(*pair)) is not None
        assert gate.why_blocked(at(*pair, b"\x01")) is not None
    assert lenient.why_blocked(at(*pair, bytes(WRONG_LENGTH))) is not None
    near = dangerous_neighbours(*pair)
    assert (strict.why_blocked(at(*pair, bytes(WRONG_LENGTH))) is None) == (not near)


@pytest.mark.parametrize(
    ("payload", "goes"),
    [
        pytest.param(bytes(11), True, id="11 zeros"),
        pytest.param(bytes(13), True, id="13 zeros"),
        pytest.param(bytes(40), True, id="40 zeros"),
        pytest.param(b"", False, id="empty"),
        pytest.param(bytes(1), False, id="1 zero"),
        pytest.param(bytes(10), False, id="10 zeros"),
        pytest.param(bytes(12), False, id="12 zeros"),
        pytest.param(bytes(10) + b"\x01", False, id="11 bytes, the last not zero"),
        pytest.param(b"\x01" + bytes(39), False, id="40 bytes, the first not zero"),
        pytest.param(bytes(1024), False, id="1024 zeros"),
    ],
)
def test_an_unknown_command_is_sent_only_as_a_wrong_length_of_zeros(payload: bytes, goes: bool) -> None:
    strict = policy(strict=True)
    for did in (0x50, 0x13, 0x11, 0x1A):
        assert (strict.why_blocked(at(did, 0x70, payload)) is None) == goes
        assert policy().why_blocked(at(did, 0x70, payload)) is not None


def test_trust_is_for_one_node() -> None:
    gate = policy()
    probe = Command(0x50, 0x01, bytes(WRONG_LENGTH))
    targets = (None, 0x01, 0x10, 0x11, 0x12)
    for target in (0x11, None):
        gate.length_checks.trust(target)
        gate.length_checks.trust(target)
        sent = [other for other in targets if gate.why_blocked(probe._replace(target=other)) is None]
        assert sent == [target]
        gate.length_checks.suspend(target)
        assert gate.why_blocked(probe._replace(target=target)) is not None
    gate.length_checks.suspend(0x33)


@pytest.mark.parametrize(
    "payload", [b"", bytes(11), b"\x01\x02", bytes(40)], ids=lambda payload: f"{len(payload)} bytes"
)
def test_what_the_robot_called_absent_may_be_asked_in_any_way(payload: bytes) -> None:
    gate = policy()
    gate.length_checks.mark_absent(at(0x50, 0x01, b"\x07"))
    assert gate.assess(at(0x50, 0x01, payload)).risk is Risk.PROBE
    assert gate.why_blocked(at(0x50, 0x01, payload)) is None
    assert gate.why_blocked(Command(0x50, 0x01, payload, 0x12)) is not None
    assert gate.why_blocked(Command(0x50, 0x01, payload)) is not None
    assert gate.why_blocked(at(0x50, 0x02, payload)) is not None


@pytest.mark.parametrize("strict", [False, True], ids=["not measured", "strict"])
@pytest.mark.parametrize(
    ("command", "risk"),
    [
        pytest.param(at(0x13, 0xFD), Risk.BRICK, id="power: deep sleep is in it"),
        pytest.param(at(0x16, 0xFC), Risk.PERSIST, id="drive"),
        pytest.param(at(0x50, 0xFB), Risk.PERSIST, id="unknown device"),
        pytest.param(at(0xEE, 0x00), Risk.PERSIST, id="device that cannot exist"),
        pytest.param(at(0xEC, 0x00), Risk.PERSIST, id="another"),
    ],
)
def test_a_command_that_is_only_assumed_to_be_absent_is_not_sent_without_payload(
    command: Command, risk: Risk, strict: bool
) -> None:
    gate, other = policy(strict=strict), command._replace(did=0x51, cid=0x01)
    before = gate.assess(command)
    assert before.risk is risk
    assert before.risk is gate.assess(command._replace(cid=0x70)).risk, "as any unknown command there"
    assert "without payload, which may run it" in before.blocked
    assert gate.assess(command._replace(payload=bytes(WRONG_LENGTH))).risk is Risk.PROBE
    gate.length_checks.mark_absent(other)
    assert gate.assess(command).risk is risk, "another one was measured"
    gate.length_checks.mark_absent(command)
    assert gate.assess(command).risk is Risk.PROBE
    assert not gate.why_blocked(command)


@pytest.mark.parametrize("did", sorted(NO_EMPTY_PROBE_DEVICES[V2]), ids=lambda did: f"0x{did:02x}")
@pytest.mark.parametrize("cid", [0x70, 0xFD], ids=lambda cid: f"0x{cid:02x}")
def test_where_empty_commands_erase_none_is_sent_even_if_called_absent(did: int, cid: int) -> None:
    gate = policy(strict=True)
    gate.length_checks.mark_absent(at(did, cid))
    assert gate.assess(at(did, cid)).risk is Risk.BRICK
    assert gate.assess(at(did, cid, bytes(40))).risk is Risk.PROBE


@pytest.mark.parametrize(
    ("command", "depends"),
    [
        pytest.param(at(0x50, 0x01, bytes(11)), True, id="unknown, wrong length"),
        pytest.param(at(0x50, 0x01), False, id="unknown, empty"),
        pytest.param(at(0x13, 0x10, bytes(11)), False, id="read"),
        pytest.param(at(0x16, 0x07, bytes(11)), False, id="motion, wrong length"),
        pytest.param(at(0x1A, 0x1C), True, id="write, wrong length"),
        pytest.param(at(0x16, 0x07, bytes(4)), False, id="motion, proper"),
        pytest.param(at(0x13, 0x00, bytes(11)), False, id="brick, wrong length"),
    ],
)
def test_what_depends_on_the_length_check(command: Command, depends: bool) -> None:
    gate = policy(ROBOTS["rvr"])
    before = gate.assess(command)
    assert is_wrong_length(command, lookup(V2, command.did, command.cid, ROBOTS["rvr"])) == depends
    gate.length_checks.trust(NODE)
    assert (gate.assess(command).risk < before.risk) == depends


def test_assessments_are_kept_until_something_is_measured() -> None:
    gate = policy()
    probe = at(0x50, 0x01, bytes(WRONG_LENGTH))
    before = gate.assess(probe)
    assert gate.assess(probe) is before
    revision = gate.revision
    gate.length_checks.trust(NODE)
    assert gate.revision > revision
    assert gate.assess(probe).risk < before.risk


EXAMPLES = {
    Risk.READ: at(0x13, 0x10),
    Risk.PROBE: at(0x50, 0x01, bytes(WRONG_LENGTH)),
    Risk.WRITE: at(0x1A, 0x1C, bytes(7)),
    Risk.MOTION: at(0x16, 0x07, bytes(4)),
    Risk.PERSIST: at(0x12, 0x11),
    Risk.BRICK: at(0x1D, 0x1C, bytes(1)),
}


@pytest.mark.parametrize("allowed", [pytest.param(risk, id=risk.word) for risk in Risk])
def test_classes_are_allowed_one_by_one(allowed: Risk) -> None:
    consent = Consent(frozenset({allowed}), ROBOT_NAME)
    gate = policy(ROBOTS["rvr"], consent, strict=True)
    for risk, command in EXAMPLES.items():
        assert gate.assess(command).risk is risk
        assert (gate.why_blocked(command) is None) == (risk is allowed)


@EACH_ROBOT
def test_with_everything_allowed_nothing_is_blocked(robot: Robot | None) -> None:
    gate = policy(robot, EVERYTHING)
    for (did, cid), length in itertools.product(PAIRS, (0, 4, WRONG_LENGTH)):
        assert gate.why_blocked(at(did, cid, bytes(length))) is None
    assert all(gate.why_blocked(at(did, cid)) is None for did, cid in UNKNOWN[::7])


@EACH_ROBOT
def test_reasons_name_the_flag(robot: Robot | None) -> None:
    gate = policy(robot)
    for (did, cid), length in itertools.product(PAIRS, (0, 4, WRONG_LENGTH)):
        command = at(did, cid, bytes(length))
        risk, phrase, _ = gate.assess(command)
        reason = gate.why_blocked(command)
        if reason is None:
            assert risk <= Risk.PROBE
            continue
        assert reason.startswith(f"{risk.word}: {phrase}")
        assert f"--allow {risk.word}" in reason
        assert ("--confirm" in reason) == (risk is Risk.BRICK)


BRICK = Assessment(Risk.BRICK, "it erases")


@pytest.mark.parametrize(
    ("allowed", "confirmed", "names", "goes"),
    [
        pytest.param({Risk.BRICK}, "BP-1234", ("BP-1234",), True, id="allowed and confirmed"),
        pytest.param({Risk.BRICK}, "BP-1234", ("bolt-plus", "BP-1234"), True, id="one of its names"),
        pytest.param({Risk.BRICK}, "", ("BP-1234",), False, id="not confirmed"),
        pytest.param({Risk.BRICK}, "BP-12345", ("BP-1234",), False, id="another robot"),
        pytest.param({Risk.BRICK}, "BP-123", ("BP-1234",), False, id="part of the name"),
        pytest.param({Risk.BRICK}, "bp-1234", ("BP-1234",), False, id="not as it is written"),
        pytest.param({Risk.BRICK}, "BP-1234", (), False, id="a robot without a name"),
        pytest.param({Risk.BRICK}, "", (), False, id="no name at all"),
        pytest.param({Risk.BRICK}, "", ("",), False, id="an empty name"),
        pytest.param({Risk.PERSIST}, "BP-1234", ("BP-1234",), False, id="confirmed, another class allowed"),
        pytest.param(set(), "BP-1234", ("BP-1234",), False, id="confirmed, nothing allowed"),
    ],
)
def test_brick_needs_consent_and_the_name(
    allowed: set[Risk], confirmed: str, names: tuple[str, ...], goes: bool
) -> None:
    consent = Consent(frozenset(allowed), confirmed)
    reason = why_blocked(BRICK, consent, names)
    assert (reason is None) == goes
    assert reason is None or "--confirm" in reason
    gate = Policy(V2, None, consent, iter(names))
    assert [gate.why_blocked(at(0x1D, 0x05)) is None for _ in range(2)] == [goes, goes]


def test_other_classes_need_no_name() -> None:
    for risk in Risk:
        if risk is not Risk.BRICK:
            assert why_blocked(Assessment(risk, ""), Consent(frozenset({risk})), ()) is None


def test_consent_in_words() -> None:
    assert Consent().words == ("read", "probe")
    assert EVERYTHING.words == ("read", "probe", "write", "motion", "persist", "brick")
    assert Consent(frozenset({Risk.BRICK, Risk.READ})).words == ("read", "brick")


TARGETS = st.sampled_from([None, 0x01, 0x10, 0x11, 0x12])
NEAR_WHAT_IS_KNOWN = st.tuples(st.sampled_from(PAIRS), st.integers(-3, 3)).map(
    lambda near: (near[0][0], (near[0][1] + near[1]) % 256)
)
ANY_PAIR = NEAR_WHAT_IS_KNOWN | st.tuples(st.integers(0, 255), st.integers(0, 255))
ANY_PAYLOAD = (
    st.binary(max_size=45) | st.integers(0, 45).map(bytes) | st.sampled_from(sorted(WRONG_LENGTHS)).map(bytes)
)


@given(ANY_PAIR, ANY_PAYLOAD, TARGETS, st.sampled_from(ALL_ROBOTS), st.sets(TARGETS))
@example((0x17, 0x05), bytes(11), 0x11, None, {0x11})
@example((0x1A, 0x04), bytes(11), 0x11, None, set())
def test_the_default_consent_blocks_everything_that_could_act(
    pair: tuple[int, int], payload: bytes, target: int | None, robot: Robot | None, strict: set[int | None]
) -> None:
    gate = Policy(V2, robot, Consent(), (ROBOT_NAME,))
    for node in strict:
        gate.length_checks.trust(node)
    if gate.why_blocked(Command(*pair, payload, target)) is not None:
        return
    rows = [row for row in meanings(*pair, robot) if row.kind is Kind.COMMAND]
    if rows and all(row.risk is Risk.READ for row in rows):
        return
    if not rows and is_impossible_pair(*pair):
        assert payload in (bytes(11), bytes(13), bytes(40))
        return
    assert target in strict, "it was not measured that this node rejects wrong lengths"
    assert all(row.request is not None for row in rows)
    dangerous = [row for row in rows_of(V2, *pair) if row.kind is Kind.COMMAND and row.risk > Risk.READ]
    assert not any(row.request.accepts(len(payload)) for row in dangerous if row.request)
    assert not any(row.risk is Risk.BRICK for row in dangerous)


@given(ANY_PAIR, ANY_PAYLOAD, TARGETS, st.sampled_from(ALL_ROBOTS))
def test_measuring_a_node_never_makes_a_command_more_dangerous(
    pair: tuple[int, int], payload: bytes, target: int | None, robot: Robot | None
) -> None:
    gate = policy(robot)
    before = gate.assess(Command(*pair, payload, target))
    gate.length_checks.trust(target)
    after = gate.assess(Command(*pair, payload, target))
    assert after.risk <= before.risk


@given(ANY_PAIR, ANY_PAYLOAD, TARGETS, st.sampled_from(ALL_ROBOTS), st.sets(st.sampled_from(Risk)))
def test_what_is_sent_was_allowed_by_its_own_name(
    pair: tuple[int, int], payload: bytes, target: int | None, robot: Robot | None, allowed: set[Risk]
) -> None:
    gate = Policy(V2, robot, Consent(frozenset(allowed), ROBOT_NAME), (ROBOT_NAME,))
    command = Command(*pair, payload, target)
    assert (gate.why_blocked(command) is None) == (gate.assess(command).risk in allowed)


HAZARDOUS = sorted(
    {row.did for row in COMMAND_ROWS if row.risk >= Risk.MOTION and row.did not in DANGEROUS_DEVICES}
)


@pytest.mark.parametrize("did", HAZARDOUS, ids=lambda did: f"0x{did:02x}")
def test_unknown_commands_of_a_device_that_acts_wait_for_evidence_there(did: int) -> None:
    cid = next(
        cid for cid in range(0x70, 256) if not rows_of(V2, did, cid) and not dangerous_neighbours(did, cid)
    )
    gate, probe = policy(), at(did, cid, bytes(WRONG_LENGTH))
    gate.length_checks.trust(NODE)
    assert gate.assess(probe).risk >= Risk.PERSIST
    assert "no command of it was seen to check lengths" in gate.assess(probe).reason
    gate.length_checks.add_rejection(Command(did, 0x01, b"", 0x12))
    assert gate.why_blocked(probe) is not None
    gate.length_checks.add_rejection(at(did, 0x01))
    assert gate.assess(probe).risk is Risk.PROBE


def test_a_node_on_which_a_wrong_length_was_accepted_gets_no_other() -> None:
    gate = policy(strict=True)
    probes = [at(0x50, 0x01, bytes(11)), at(0x50, 0xFD, bytes(11)), at(0x1A, 0x1C)]
    assert [gate.why_blocked(probe) for probe in probes] == [None] * 3
    gate.length_checks.distrust(NODE)
    gate.length_checks.trust(NODE)
    assert all(gate.why_blocked(probe) for probe in probes)
    assert "accepted a wrong length" in gate.assess(probes[0]).reason
    assert gate.why_blocked(at(0x13, 0x10)) is None


def test_an_uninformative_device_gets_no_unknown_command() -> None:
    gate = policy(strict=True)
    gate.length_checks.mark_uninformative(NODE, 0x50)
    assert "cannot exist" in gate.assess(at(0x50, 0x01, bytes(11))).reason
    assert gate.why_blocked(at(0x50, 0x01, bytes(11))) is not None
    assert gate.why_blocked(at(0x51, 0x01, bytes(11))) is None


def test_what_was_asked_for_implies_a_class_for_exactly_its_commands() -> None:
    gate, stop = policy(), at(0x16, 0x01, bytes(4))
    assert gate.why_blocked(stop) is not None
    with gate.implying(Risk.MOTION, stop):
        assert gate.why_blocked(stop) is None
        assert gate.assess(stop).risk is Risk.MOTION
        assert gate.why_blocked(stop._replace(payload=b"\x00\x01\x00\x00")) is not None
        assert gate.why_blocked(stop._replace(target=0x12)) is not None
    assert gate.why_blocked(stop) is not None


def test_a_command_of_another_class_is_not_implied() -> None:
    gate, stop = policy(), at(0x16, 0x01, bytes(4))
    with gate.implying(Risk.WRITE, stop):
        assert gate.why_blocked(stop) is not None


@pytest.mark.parametrize("other", [0x11, 0x12], ids=["same command", "another node"])
def test_implications_may_overlap_and_each_ends_by_itself(other: int) -> None:
    gate, stop = policy(), at(0x16, 0x01, bytes(4))
    first, second = gate.implying(Risk.MOTION, stop), gate.implying(Risk.MOTION, stop._replace(target=other))
    revisions = [gate.revision]
    for step in (first.__enter__, second.__enter__):
        step()
        revisions.append(gate.revision)
        assert gate.why_blocked(stop) is None
    first.__exit__(None, None, None)
    revisions.append(gate.revision)
    assert (gate.why_blocked(stop) is None) is (stop.target == other)
    second.__exit__(None, None, None)
    revisions.append(gate.revision)
    assert gate.why_blocked(stop) is not None
    assert revisions == sorted(set(revisions))


def test_an_implication_ends_with_an_error_too() -> None:
    gate, stop = policy(), at(0x16, 0x01, bytes(4))
    with pytest.raises(ZeroDivisionError), gate.implying(Risk.MOTION, stop):
        raise ZeroDivisionError
    assert gate.why_blocked(stop) is not None
