"""Which robot is meant by what was typed, and what is said where none can be chosen."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue import robot_by_prefix
from sphero_probe.errors import RobotNotFoundError
from sphero_probe.protocol.packets import Generation
from sphero_probe.reports.printable import visible
from sphero_probe.transports.base import WHY_UNHEARD, Seen
from sphero_probe.transports.ble.choosing import NAMESAKES, SETTLING, choose, patience

ONE, TWO, THREE = "AA:BB:CC:DD:EE:01", "AA:BB:CC:DD:EE:02", "AA:BB:CC:DD:EE:03"
APPLE = "0A1B2C3D-0000-4000-8000-0A1B2C3D4E5F"


def robot(name: str, address: str = ONE, rssi: int | None = -50, **more: Any) -> Seen:
    return Seen(name, robot_by_prefix(name), address, rssi, **more)


AROUND = [
    robot("BP-1234", ONE),
    robot("BP-1299", TWO),
    robot("SB-0001", THREE),
    robot("Kettle", "AA:BB:CC:DD:EE:04"),
    robot("Fred", "AA:BB:CC:DD:EE:05", generation=Generation.V2),
    robot("", APPLE),
]


@pytest.mark.parametrize(
    ("wanted", "name"),
    [
        pytest.param("BP-1234", "BP-1234", id="name"),
        pytest.param("bp-1234", "BP-1234", id="name-in-another-case"),
        pytest.param("sb-", "SB-0001", id="beginning"),
        pytest.param("BP-129", "BP-1299", id="beginning-almost-the-whole"),
        pytest.param("fr", "Fred", id="beginning-of-an-unknown-sphero"),
        pytest.param("Kettle", "Kettle", id="whole-name-of-a-stranger"),
        pytest.param(TWO.lower(), "BP-1299", id="address"),
        pytest.param(APPLE.lower(), "", id="address-of-macos"),
    ],
)
def test_the_one_that_is_meant(wanted: str, name: str) -> None:
    assert choose(wanted, AROUND, 10).name == name


def test_a_whole_name_beats_those_that_begin_with_it() -> None:
    around = [robot("BP-12", ONE), robot("BP-123", TWO)]
    assert choose("BP-12", around, 10).address == ONE


def test_the_very_name_beats_another_case() -> None:
    around = [robot("bp-12", ONE), robot("BP-12", TWO)]
    assert choose("BP-12", around, 10).address == TWO


def test_a_name_that_is_the_address_of_another_robot_counts_for_nothing() -> None:
    impostor = robot(TWO, ONE, generation=Generation.V2)
    assert choose(TWO, [impostor, robot("BP-1299", TWO)], 10).address == TWO
    with pytest.raises(RobotNotFoundError, match="was heard"):
        choose(TWO, [impostor], 10)


def test_the_only_robot_is_taken_among_strangers() -> None:
    strangers = [robot("Kettle", TWO), robot("", THREE)]
    assert choose("", [*strangers, robot("BP-1234")], 10).address == ONE


@pytest.mark.parametrize(
    ("wanted", "around", "message", "hint"),
    [
        pytest.param(
            "bp",
            AROUND,
            "'bp' fits 2 robots: BP-1234, BP-1299",
            "choose one: --device BP-1234",
            id="two-begin",
        ),
        pytest.param(
            "",
            AROUND[:4],
            "3 robots are near: BP-1234, BP-1299, SB-0001",
            "choose one: --device BP-1234",
            id="several-near",
        ),
        pytest.param(
            "BP-1234",
            [robot("BP-1234", ONE), robot("BP-1234", TWO)],
            f"2 robots are called BP-1234: {ONE}, {TWO}",
            f"type the address: --device {ONE}",
            id="shared-name",
        ),
        pytest.param(
            "BP",
            [robot("BP-1234", ONE), robot("BP-1234", TWO), robot("BP-1", THREE)],
            f"'BP' fits 3 robots: BP-1234 ({ONE}), BP-1234 ({TWO}), BP-1",
            f"choose one: --device {ONE}",
            id="shared-name-among-several",
        ),
        pytest.param(
            "",
            [robot("", ONE, generation=Generation.V1), robot("BP-1 ; rm", TWO)],
            f"2 robots are near: {ONE}, BP-1 ; rm",
            f"choose one: --device {ONE}",
            id="nameless",
        ),
        pytest.param(
            "BP",
            [robot("BP-1 ; rm", TWO), robot("BP-2", ONE)],
            "'BP' fits 2 robots: BP-1 ; rm, BP-2",
            f"choose one: --device {TWO}",
            id="name-that-no-shell-takes",
        ),
        pytest.param(
            "",
            [robot("BP-1", TWO), robot("BP-2", ONE, None, connected=True)],
            "2 robots are near: BP-1, BP-2 (connected to this machine)",
            "choose one: --device BP-1",
            id="one-free-one-in-use",
        ),
        pytest.param(
            "BP-2",
            [robot("BP-1", TWO), robot("BP-2", ONE, None, connected=True)],
            "BP-2 is connected to this machine already",
            "close the program that uses it; was that killed, disconnect the robot in the Bluetooth settings "
            f"(Linux: bluetoothctl disconnect {ONE})",
            id="in-use",
        ),
        pytest.param(
            "XX",
            AROUND[2:],
            "no robot 'XX' was heard within 10 s; heard: SB-0001, Fred",
            WHY_UNHEARD,
            id="others-heard",
        ),
        pytest.param("XX", [], "no robot 'XX' was heard within 10 s", WHY_UNHEARD, id="nobody"),
        pytest.param(
            "Kett", AROUND[3:4], "no robot 'Kett' was heard within 10 s", WHY_UNHEARD, id="begins-a-stranger"
        ),
        pytest.param(
            "",
            AROUND[3:4],
            "no robot was heard within 10 s",
            f"{WHY_UNHEARD} or try --device fake:bolt-plus",
            id="strangers-alone",
        ),
    ],
)
def test_why_none_is_chosen(wanted: str, around: list[Seen], message: str, hint: str) -> None:
    with pytest.raises(RobotNotFoundError) as raised:
        choose(wanted, around, 10)
    assert (str(raised.value), raised.value.hint) == (message, hint)


def test_a_message_names_eight_robots_and_counts_the_rest() -> None:
    around = [robot(f"BP-{number:04}", f"AA:BB:CC:DD:EE:{number:02X}") for number in range(20)]
    with pytest.raises(RobotNotFoundError) as raised:
        choose("", around, 10)
    said = str(raised.value)
    assert said.startswith("20 robots are near: BP-0000, ")
    assert said.endswith("BP-0007 and 12 more")


@pytest.mark.parametrize(
    ("wanted", "seen", "seconds"),
    [
        pytest.param(ONE, robot("BP-1234"), 0, id="address"),
        pytest.param("BP-1234", robot("BP-1234"), NAMESAKES, id="name"),
        pytest.param("bp-1234", robot("BP-1234"), NAMESAKES, id="name-in-another-case"),
        pytest.param("BP", robot("BP-1234"), SETTLING, id="beginning"),
        pytest.param("", robot("BP-1234"), SETTLING, id="any"),
        pytest.param(ONE, robot("BP-1234", ONE, None, connected=True), SETTLING, id="in-use"),
        pytest.param("SB", robot("BP-1234"), None, id="another"),
        pytest.param("", robot("Kettle"), None, id="stranger"),
        pytest.param("K", robot("Kettle"), None, id="beginning-of-a-stranger"),
    ],
)
def test_how_long_namesakes_are_waited_for(wanted: str, seen: Seen, seconds: float | None) -> None:
    assert patience(wanted, seen) == seconds
    assert 0 < NAMESAKES < SETTLING


names = st.one_of(
    st.sampled_from(
        ["BP-1234", "BP-12", "bp-12", "SB-1", "", " ", ONE, TWO, APPLE, "BP-\x1b[2J", "é", "E\u0301"]
    ),
    st.text(max_size=8).map("BP-{}".format),
    st.text(min_size=190, max_size=200).map("SB-{}".format),
)
sightings = st.lists(
    st.builds(robot, names, rssi=st.integers(-100, -20), connected=st.booleans()), max_size=30
)


def outcome(wanted: str, around: list[Seen]) -> Seen | RobotNotFoundError:
    try:
        return choose(wanted, around, 10)
    except RobotNotFoundError as error:
        return error


@given(names, sightings)
def test_never_one_of_several_and_always_a_short_message(wanted: str, robots: list[Seen]) -> None:
    around = [seen._replace(address=f"AA:BB:CC:DD:EE:{number:02X}") for number, seen in enumerate(robots)]
    meant = [seen for seen in around if patience(wanted, seen) is not None]
    chosen = outcome(wanted, around)
    if isinstance(chosen, RobotNotFoundError):
        assert len(meant) != 1 or meant[0].connected
        assert len(str(chosen)) < 640  # eight robots of one name, all connected to this machine
        assert len(chosen.hint) < 200
        assert "\n" not in visible(str(chosen))
        return
    assert chosen in meant
    assert not chosen.connected
    if len(meant) > 1:
        alike = [seen for seen in meant if seen.name.strip() == chosen.name.strip()]
        assert chosen.address == wanted or (
            chosen.name.strip().casefold() == wanted.casefold() and len(alike) == 1
        )
