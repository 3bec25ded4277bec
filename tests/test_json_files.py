"""Objects of JSON files in every layout, and the place of what is wrong."""

import json
from pathlib import Path

import pytest

from sphero_probe.errors import BadInputFileError
from sphero_probe.json_files import JsonObjects, open_regular

OBJECTS = [{"a": [1, {"b": "}"}]}, {}, {"c": "["}]


def read(path: Path, *, lenient: bool = False) -> list[dict[str, object]]:
    with open_regular(path) as file:
        return list(JsonObjects(file, path, lenient=lenient))


@pytest.mark.parametrize(
    "text",
    [
        "".join(f"{json.dumps(each)}\n" for each in OBJECTS),
        "\r\n".join(json.dumps(each) for each in OBJECTS),
        "[\n" + ",\n".join(json.dumps(each) for each in OBJECTS) + "\n]\n",
        *(json.dumps(OBJECTS, indent=indent) for indent in (None, 0, 2)),
    ],
)
@pytest.mark.parametrize("lenient", [True, False])
def test_every_layout_holds_the_same(tmp_path: Path, text: str, *, lenient: bool) -> None:
    path = tmp_path / "x"
    path.write_text(text)
    assert read(path, lenient=lenient) == OBJECTS


@pytest.mark.parametrize(
    ("text", "says", "held"),
    [
        ('{}\n5\n{"a": 1}', ":2: not a JSON object", 2),
        ('[{}, 5, {"a": 1}]', ": object 2: not a JSON object", 2),
        ('{"a": Infinity}', ":1: not valid JSON", 1),
        ('{"a": 1e999}', ":1: not valid JSON", 1),
        ('{}\n{"a"', ":2: not valid JSON", 1),
        ('{}\n{"a"\n', ":2: not valid JSON", None),
        ('{"a"', ":1: not valid JSON", None),
        ("[{}", ": object 1: not valid JSON", None),
    ],
)
def test_what_is_wrong_is_named_or_skipped(tmp_path: Path, text: str, says: str, held: int | None) -> None:
    path = tmp_path / "x"
    path.write_text(text)
    with pytest.raises(BadInputFileError) as caught:
        read(path)
    assert str(caught.value) == f"{path}{says}"
    if held is None:
        with pytest.raises(BadInputFileError):
            read(path, lenient=True)
    else:
        assert len(read(path, lenient=True)) == held


def test_a_large_file_is_not_opened(tmp_path: Path) -> None:
    path = tmp_path / "x"
    path.write_bytes(b"12345")
    open_regular(path, most=5).close()
    with pytest.raises(BadInputFileError, match="larger than 4 bytes"):
        open_regular(path, most=4)
