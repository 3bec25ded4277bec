"""Fleet files: what is written is read again, and anything else gives one clear line."""

from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.errors import BadInputFileError, OutputError
from sphero_probe.fleet.robots import FleetRobot
from sphero_probe.fleet.robots_file import MAX_BYTES, MAX_ROBOTS, MAX_TEXT, read_robots, write_robots

TOML = """
[[robot]]
name = "BP-1234"
address = "AA:BB:CC:DD:EE:01"
label = "table 3"

[[robot]]
name = "RV-5678"
"""
CSV = "name,address,label\nBP-1234,AA:BB:CC:DD:EE:01,table 3\nRV-5678,,\n"
TEXT = st.text(st.characters(codec="utf-8"), min_size=1, max_size=20).map(str.strip).filter(bool)


def read(tmp_path: Path, name: str, text: str | bytes) -> tuple[FleetRobot, ...]:
    file = tmp_path / name
    file.write_bytes(text.encode() if isinstance(text, str) else text)
    return read_robots(file)


@pytest.mark.parametrize(("name", "text"), [("a.toml", TOML), ("a.csv", CSV), ("A.CSV", "\ufeff" + CSV)])
def test_both_forms_name_the_same_robots(tmp_path: Path, name: str, text: str) -> None:
    assert read(tmp_path, name, text) == (
        FleetRobot("BP-1234", "AA:BB:CC:DD:EE:01", "table 3"),
        FleetRobot("RV-5678", "RV-5678", ""),
    )


@pytest.mark.parametrize("suffix", [".toml", ".csv"])
@given(names=st.lists(TEXT, min_size=1, max_size=4, unique_by=str.casefold), label=TEXT)
def test_what_is_written_is_read_again(
    tmp_path_factory: pytest.TempPathFactory, suffix: str, names: list[str], label: str
) -> None:
    robots = tuple(
        FleetRobot(name, f"AA:BB:CC:DD:EE:{number:02X}", label) for number, name in enumerate(names)
    )
    file = tmp_path_factory.mktemp("fleet") / f"robots{suffix}"
    write_robots(file, robots)
    assert read_robots(file) == robots


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        pytest.param("a.txt", "", "ends in .toml or .csv", id="suffix"),
        pytest.param("a.toml", "[[robot", "not valid TOML", id="syntax"),
        pytest.param("a.toml", "[[robot]]\nname = 5", "name is not text", id="number"),
        pytest.param("a.toml", "[[robot]]\nnmae = 'a'", "unknown key 'nmae'", id="key"),
        pytest.param("a.toml", "[[robots]]\nname = 'a'", "unknown key 'robots'", id="table"),
        pytest.param("a.toml", "robot = 1", "not a list of tables", id="no-list"),
        pytest.param("a.toml", "[[robot]]\nlabel = 'a'", "neither name nor address", id="nameless"),
        pytest.param("a.toml", "", "at least one robot", id="empty"),
        pytest.param("a.toml", b"\xff\xfe", "not UTF-8", id="bytes"),
        pytest.param("a.toml", "#" * (MAX_BYTES + 1), "not a fleet file", id="size"),
        pytest.param("a.toml", f"[[robot]]\nname = '{'a' * (MAX_TEXT + 1)}'", "more than", id="long"),
        pytest.param("a.toml", "a = " + "[" * 5000, "not valid TOML", id="depth"),
        pytest.param("a.csv", "name\na,b\n", "more values than columns", id="columns"),
        pytest.param("a.csv", 'name\n"a', "not valid CSV", id="quotes"),
        pytest.param("a.csv", "address\nfake:no-such\n", "unknown fake robot", id="address"),
        pytest.param("a.csv", "name\nBP-1\nBP-1\n", "named twice", id="twice"),
        pytest.param(
            "a.csv", "name\n" + "".join(f"BP-{n}\n" for n in range(MAX_ROBOTS + 1)), "more than", id="many"
        ),
    ],
)
def test_a_bad_file_gives_one_clear_line(tmp_path: Path, name: str, text: str | bytes, said: str) -> None:
    with pytest.raises(BadInputFileError) as raised:
        read(tmp_path, name, text)
    assert said in str(raised.value)
    assert str(tmp_path / name) in str(raised.value)


@given(text=st.binary(max_size=200))
@pytest.mark.parametrize("name", ["a.toml", "a.csv"])
def test_any_bytes_are_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, name: str, text: bytes
) -> None:
    with suppress(BadInputFileError):
        read(tmp_path_factory.mktemp("any"), name, text)


def test_a_file_that_cannot_be_read_or_written(tmp_path: Path) -> None:
    with pytest.raises(BadInputFileError, match="no such file"):
        read_robots(tmp_path / "none.toml")
    (tmp_path / "folder.toml").mkdir()
    with pytest.raises(BadInputFileError, match="not a regular file"):
        read_robots(tmp_path / "folder.toml")
    with pytest.raises(OutputError):
        write_robots(tmp_path / "folder.toml", ())
    with pytest.raises(OutputError, match=r"\.toml or \.csv"):
        write_robots(tmp_path / "robots.txt", ())
