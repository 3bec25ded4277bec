"""Other libraries, read from their source: compared with the imported library and with the maker's table."""

import inspect
import os
import pkgutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import partialmethod
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import pytest
import spherov2.toy
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sphero_probe.catalogue.commands import rows_of
from sphero_probe.catalogue.libraries.claims import Claim, Library
from sphero_probe.catalogue.libraries.comparison import OURS, compare_library
from sphero_probe.catalogue.libraries.finding import find_library
from sphero_probe.catalogue.libraries.source import read_source
from sphero_probe.catalogue.model import NO_DEVICE, Kind
from sphero_probe.errors import BadInputFileError
from sphero_probe.protocol.packets import Generation

V1, V2 = Generation.V1, Generation.V2
SPHEROV2: Final = find_library("spherov2")
KEYS: Final = {"BOLT": "bolt", "Mini": "mini", "RVR": "rvr", "R2D2": "r2d2", "R2Q5": "r2q5", "BB9E": "bb9e"}
KEYS_V1: Final = {"Sphero": "sphero", "Sprk2": "sprk-plus", "Ollie": "ollie", "BB8": "bb8"}


def toys() -> Iterator[tuple[str, type[Any]]]:
    """The robot classes of the imported library, by our key."""
    for module in pkgutil.iter_modules(spherov2.toy.__path__, "spherov2.toy."):
        for name, kind in inspect.getmembers(import_module(module.name), inspect.isclass):
            if kind.__module__ == module.name and name in KEYS | KEYS_V1:
                yield (KEYS | KEYS_V1)[name], kind


def methods(toy: type[Any]) -> set[tuple[int, str, int | None]]:
    """DID, name and processor of the commands of an imported robot class."""
    found: dict[str, tuple[int, str, int | None]] = {}
    for kind in reversed(toy.__mro__):
        for name, value in vars(kind).items():
            function, processor = value, None
            if isinstance(value, partialmethod):
                function, processor = value.func, value.keywords.get("proc")
            if inspect.isfunction(function) and function.__module__.startswith("spherov2.commands."):
                owner = getattr(sys.modules[function.__module__], function.__qualname__.partition(".")[0])
                node = None if processor is None else int(processor)
                found[name] = (owner._did, function.__name__, node)
    return set(found.values())


@pytest.mark.parametrize(("key", "toy"), list(toys()))
def test_a_robot_has_the_commands_of_its_imported_class(key: str, toy: type[Any]) -> None:
    theirs = {
        (did, claim.name, claim.robots[key])
        for (_, did, _), claim in SPHEROV2.claims.items()
        if claim.kind is Kind.COMMAND and key in claim.robots
    }
    assert theirs == methods(toy)
    assert len(theirs) > 20


def test_it_is_as_large_as_was_surveyed() -> None:
    """test_makers_tables.py counts the same in another way."""
    assert SPHEROV2.name == "spherov2 0.12.1"
    assert SPHEROV2.robots == set((KEYS | KEYS_V1).values())
    assert sum(key[0] is V2 for key in SPHEROV2.claims) == 205
    assert sum(key[:2] == (V1, NO_DEVICE) for key in SPHEROV2.claims) == 6
    assert len(SPHEROV2.claims) == 205 + 34 + 6


def test_the_catalogue_has_it_all() -> None:
    assert {difference.known_by for difference in compare_library(SPHEROV2)} == {OURS}


RUNS_NOTHING: Final = """
import sys
from sphero_probe.cli import main
sys.argv = ["sphero-probe", "catalog", "--compare", "spherov2"]
try:
    main()
except SystemExit:
    pass
assert not [name for name in sys.modules if name.startswith("spherov2")]
"""


def test_nothing_of_it_is_imported() -> None:
    subprocess.run([sys.executable, "-c", RUNS_NOTHING], check=True, capture_output=True, timeout=60)


def sdk_table() -> dict[tuple[int, int], tuple[str, str]]:
    """Pair -> device and function, from the maker's table in tests/data."""
    lines = (Path(__file__).parents[1] / "data" / "sdk_rvr.txt").read_text(encoding="utf-8").splitlines()
    words = [line.split() for line in lines if not line.startswith("#")]
    return {(int(did, 16), int(cid, 16)): (f"device_{did}", name) for did, cid, name, *_ in words}


def test_the_sdk_is_read_in_the_shape_that_it_has(tmp_path: Path) -> None:
    table = sdk_table()
    devices = {device: did for (did, _), (device, _) in table.items()}
    (tmp_path / "devices.py").write_text(
        "from enum import IntEnum\nclass DevicesEnum(IntEnum):\n"
        + "".join(f"    {device} = {did:#x}\n" for device, did in devices.items())
    )
    for device, did in devices.items():
        commands = {cid: name for (one, cid), (_, name) in table.items() if one == did}
        (tmp_path / f"{device}_enums.py").write_text(
            "class CommandsEnum(IntEnum):\n"
            + "".join(f"    {name} = {cid:#04x}\n" for cid, name in commands.items())
        )
        (tmp_path / f"{device}.py").write_text(
            f"from sdk.enums.{device}_enums import CommandsEnum\nfrom sdk.devices import DevicesEnum\n"
            + "".join(
                f"def {name}(target, timeout):\n    return {{'did': DevicesEnum.{device}, "
                f"'cid': CommandsEnum.{name}, 'target': target}}\n"
                for name in commands.values()
            )
        )
    library = find_library(str(tmp_path))
    assert library.robots == {"rvr"}
    assert {key[1:]: claim.name for key, claim in library.claims.items()} == {
        pair: name.removeprefix("on_") for pair, (_, name) in table.items()
    }
    for key, claim in library.claims.items():
        (row,) = [row for row in rows_of(*key) if "rvr" in row.nodes]
        assert row.kind is claim.kind
    assert all(difference.known_by == OURS for difference in compare_library(library))


def test_what_only_one_side_knows() -> None:
    battery = Claim("get_battery_percentage", Kind.COMMAND, {"mini": None, "lmq": 1, "sphero": None})
    new = Claim("fly", Kind.COMMAND, {"mini": None})
    unused = Claim("hover", Kind.NOTIFICATION, {})
    claims = {(V2, 0x13, 0x10): battery, (V2, 0x77, 0x01): new, (V2, 0x77, 0x02): unused}
    theirs: list[Any] = []
    ours: list[Any] = []
    for one in compare_library(Library("other", frozenset({"mini"}), claims)):
        (ours if one.known_by == OURS else theirs).append(one)
    assert [(one.did, one.cid, one.name, one.their_name, one.robots) for one in theirs] == [
        (0x13, 0x10, "power.get_battery_percentage", "get_battery_percentage", ("lmq", "sphero")),
        (0x77, 0x01, "", "fly", ("mini",)),
        (0x77, 0x02, "", "hover", ()),
    ]
    assert {one.robots for one in ours} == {("mini",)}
    assert not [one for one in ours if (one.did, one.cid) == (0x13, 0x10)]


TOY: Final = """
from x import Power
class Power:
    _did = 0x13
    def wake(toy): toy._execute(Power._encode(toy, 0x0d, None))
class Mini(ToyV2):
    toy_type = ToyType('Sphero Mini', 'SM-', 'SM', .12)
    wake = Power.wake
"""


def _loop(folder: Path) -> None:
    (folder / "again").symlink_to(folder, target_is_directory=True)
    (folder / "link.py").symlink_to("/etc/passwd")


HOSTILE: Final[dict[str, Callable[[Path], object]]] = {
    "runs": lambda folder: (folder / "a.py").write_text(f"open({str(folder / 'ran')!r}, 'w')\n"),
    "deep": lambda folder: (folder / "a.py").write_text("(" * 5000),
    "deep-but-valid": lambda folder: (folder / "a.py").write_text("x = " + "-" * 50_000 + "1"),
    "long-sum": lambda folder: (folder / "a.py").write_text("x = " + "1+" * 20_000 + "1"),
    "nul": lambda folder: (folder / "a.py").write_bytes(b"x = 1\0"),
    "no-text": lambda folder: (folder / "a.py").write_bytes(b"# coding: nothing\n\xff\xfe"),
    "huge": lambda folder: (folder / "a.py").write_bytes(b"#" * (1 << 20)),
    "folder": lambda folder: (folder / "a.py").mkdir(),
    "loop": _loop,
    "pipe": lambda folder: os.mkfifo(folder / "a.py"),
    "cycle": lambda folder: (folder / "a.py").write_text(
        "class A(B):\n    toy_type = T('a', 'SM-')\nclass B(A):\n    toy_type = T('b', 'SM-')\n"
    ),
    "odd": lambda folder: (folder / "a.py").write_text(
        "class Power:\n    _did = 'x'\n    a = ()\n    b = ((),)\n    c = (1, 2, 3, 4)\n"
        "    d = (19, True, 0xff)\nclass Toy:\n    toy_type = T()\n    x = partialmethod()\n"
        "    y = partialmethod(*z, **w)\n    q = P.q\n"
    ),
}


@pytest.mark.parametrize("kind", HOSTILE)
@pytest.mark.filterwarnings("ignore")
def test_a_hostile_tree_is_harmless(tmp_path: Path, kind: str) -> None:
    if kind == "pipe" and not hasattr(os, "mkfifo"):
        pytest.skip("no named pipes")
    HOSTILE[kind](tmp_path)
    with pytest.raises(BadInputFileError, match="no commands of robots"):
        find_library(str(tmp_path))
    (tmp_path / "good.py").write_text(TOY)
    library = find_library(str(tmp_path))
    assert library.claims == {(V2, 0x13, 0x0D): Claim("wake", Kind.COMMAND, {"mini": None})}
    assert not (tmp_path / "ran").exists()


def test_a_large_tree_is_read_in_part(tmp_path: Path) -> None:
    for number in range(510):
        (tmp_path / f"{number:04}.py").write_text("x = 1\n")
    assert len(list(read_source(tmp_path))) == 500


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=40)
@given(
    st.lists(st.sampled_from(TOY.replace("(", " ( ").replace(",", " , ").split(" ")), max_size=60).map(
        " ".join
    )
)
def test_no_source_makes_it_raise(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.py").write_text(text)
    (tmp_path / "good.py").write_text(TOY)
    assert find_library(str(tmp_path)).claims


@pytest.mark.parametrize("name", ["nowhere", "a\0b", "", "x" * 5000])
def test_a_place_that_is_none_is_told(name: str) -> None:
    with pytest.raises(BadInputFileError):
        find_library(name)
