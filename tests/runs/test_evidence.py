"""Evidence files: nothing that identifies a robot goes out, and nothing invalid comes in."""

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sphero_probe.catalogue import ROBOTS, commands_of
from sphero_probe.errors import BadInputFileError, BadLineError
from sphero_probe.probing.evidence import Asked, Ending, Evidence, Replaced, Topic
from sphero_probe.protocol.packets import Command
from sphero_probe.reports.evidence import markdown, settlement_rows
from sphero_probe.runs.evidence import encode, redact
from sphero_probe.runs.evidence_reader import MAX_FILE, decode, read_evidence
from sphero_probe.simulator import FakeRobot, parse_settings
from sphero_probe.simulator.readings import Readings
from tests.support.evidence import collect

KEY = b"any key"
NAME, MAC = "BP-7F3A", "C6:01:DE:AD:BE:EF"


def identifying(key: str) -> set[bytes]:
    """Return what identifies a built-in robot: name, address, and the marked fields of its answers."""
    robot, readings = ROBOTS[key], Readings(ROBOTS[key], 0)
    fake = FakeRobot(parse_settings(key))
    address = bytes.fromhex(fake.address.replace(":", ""))
    found = {fake.name.encode(), fake.name.rpartition("-")[2].encode(), address, fake.address.encode()}
    for row in commands_of(robot):
        for node in row.nodes.get(key, ()) or robot.nodes:
            if row.response:
                answer = readings.payload(row, node)
                found |= {answer[start:end] for _, start, end in row.response.identifying_spans(answer)}
    return {value for value in found if len(value) > 2}


def traces(secrets: set[bytes], text: str) -> list[bytes]:
    """Return which of these values a text holds: as text or in hex, forwards or backwards, in any case."""
    lowered = text.lower()
    held = []
    for secret in secrets:
        forms = {secret.hex(), secret.hex(" "), secret.hex(":"), secret[::-1].hex(), secret.hex()[::-1]}
        if secret.isascii():
            forms |= {secret.decode().lower(), secret.decode().lower()[::-1]}
        held += [secret for form in forms if form in lowered]
    return held


@pytest.mark.parametrize("key", ROBOTS)
def test_the_files_of_a_robot_hold_nothing_of_it_and_are_valid(key: str) -> None:
    fake = FakeRobot(parse_settings(key))
    evidence = redact(collect(key), (fake.name, fake.address), KEY)
    text = encode(evidence)
    secrets = identifying(key)
    assert len(secrets) >= 4
    assert traces(secrets, text + markdown(evidence)) == []
    assert text.isascii()
    assert decode(text.encode()) == evidence._replace(seconds=round(evidence.seconds, 1))
    assert len(text) < 40_000


def with_answer(did: int, cid: int, data: bytes) -> Evidence:
    asked = Asked(Topic.LISTS, Command(did, cid, b"", 0x11), 0x3A, Ending.ANSWERED, 0, data, 1, None, 1.0)
    return collect("bolt-plus")._replace(asked=(asked,))


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    "hidden",
    [
        pytest.param(NAME.encode(), id="name"),
        pytest.param(NAME.lower().encode()[::-1], id="name, backwards"),
        pytest.param(b"7f3a", id="number of the name"),
        pytest.param(bytes.fromhex("c601deadbeef"), id="address"),
        pytest.param(bytes.fromhex("c601deadbeef")[::-1], id="address, backwards"),
        pytest.param(b"c601deadbeef", id="address in hex"),
        pytest.param(MAC.encode(), id="address as text"),
        pytest.param(NAME.encode().hex().encode(), id="name in hex"),
    ],
)
@given(before=st.binary(max_size=8), after=st.binary(max_size=8))
@settings(max_examples=6)
def test_an_identifier_in_an_answer_is_replaced(hidden: bytes, before: bytes, after: bytes) -> None:
    """10/05 may hold any bytes, so only the search for identifiers can find them there."""
    raw = with_answer(0x10, 0x05, before + hidden + after)
    redacted = redact(raw, (NAME, f"ble:{MAC}"), KEY)
    assert isinstance(redacted.asked[0].data, Replaced)
    assert redacted.asked[0].data.length == len(before + hidden + after)
    secrets = {hidden, hidden.lower()}
    assert traces(secrets, encode(raw))
    assert traces(secrets, encode(redacted)) == []


@pytest.mark.parametrize(
    ("did", "cid", "data"),
    [
        pytest.param(0x11, 0x06, b"c601deadbeef", id="address"),
        pytest.param(0x11, 0x13, b"\x12\x34", id="statistics id"),
        pytest.param(0x11, 0x38, b"RVR01-1234", id="SKU"),
        pytest.param(0x19, 0x04, b"Mine", id="name"),
        pytest.param(0x1F, 0x27, b"\0\0\1\2", id="chassis id"),
        pytest.param(0x11, 0x00, b"\0\1\0\2\0\3extra", id="more than the layout has"),
        pytest.param(0x55, 0x01, b"\1", id="a command that no catalogue knows"),
    ],
)
def test_answers_that_may_identify_are_replaced(did: int, cid: int, data: bytes) -> None:
    redacted = redact(with_answer(did, cid, data), (), KEY)
    replaced = redacted.asked[0].data
    assert isinstance(replaced, Replaced)
    assert redact(with_answer(did, cid, data), (), KEY).asked[0].data == replaced
    assert redact(with_answer(did, cid, data), (), b"another key").asked[0].data != replaced
    assert data.hex() not in encode(redacted)
    assert KEY.hex() not in encode(redacted)


def test_answers_that_settle_questions_stay() -> None:
    assert redact(with_answer(0x10, 0x05, b"\x10\x11"), (NAME,), KEY).asked[0].data == b"\x10\x11"
    assert redact(with_answer(0x11, 0x00, b"\0\1\0\2\0\3"), (NAME,), KEY).asked[0].data == b"\0\1\0\2\0\3"


def document() -> dict[str, Any]:
    held: dict[str, Any] = json.loads(encode(redact(collect("bolt-plus", idle=5), (), KEY)))
    return held


def changed(path: tuple[str | int, ...], value: object) -> bytes:
    whole = document()
    inner: Any = whole
    for step in path[:-1]:
        inner = inner[step]
    inner[path[-1]] = value
    return json.dumps(whole).encode()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        pytest.param(b"", "not valid JSON", id="empty"),
        pytest.param(b"[]", "not a JSON object", id="list"),
        pytest.param(b"{}", "not an evidence file", id="other"),
        pytest.param(b"[" * 100_000, "not valid JSON", id="deep"),
        pytest.param(b'{"type":"evidence","schema_version":2}', "of another version", id="version"),
        pytest.param(b'{"type":"evidence","schema_version":1}', "tool_version is missing", id="missing"),
        pytest.param(b" " * (MAX_FILE + 1), "larger than", id="large"),
        pytest.param(changed(("robot",), "toaster"), "robot is not one of", id="robot"),
        pytest.param(changed(("line",), "wifi"), "line is not one of", id="line"),
        pytest.param(changed(("owner",), "me"), "a field that no evidence file has", id="unknown field"),
        pytest.param(changed(("firmware", "primary"), "1.x"), "firmware is not", id="firmware"),
        pytest.param(changed(("chunks", "many"), 3), "chunks is not", id="chunks"),
        pytest.param(changed(("seconds",), "NaN"), "seconds is not", id="seconds"),
        pytest.param(changed(("asked",), [{}] * 1025), "asked is not a list of at most", id="too many"),
        pytest.param(changed(("asked", 3), 7), "asked, entry 4: an entry is not an object", id="no object"),
        pytest.param(changed(("asked", 0, "code"), 256), "asked, entry 1: code is not", id="code"),
        pytest.param(changed(("asked", 0, "payload"), "zz"), "payload is not hexadecimal", id="payload"),
        pytest.param(changed(("asked", 0, "payload"), "00" * 1025), "payload is not a text", id="long"),
        pytest.param(changed(("asked", 0, "data"), {"length": 1}), "digest is missing", id="replaced"),
        pytest.param(
            changed(("asked", 0, "data"), {"length": 1, "digest": "x"}), "digest is not", id="digest"
        ),
        pytest.param(changed(("asked", 0, "topic"), "gossip"), "topic is not one of", id="topic"),
        pytest.param(changed(("bursts", 0, "milliseconds"), [1e400]), "not valid JSON", id="infinite"),
        pytest.param(changed(("nodes", 0, "why"), "x" * 300), "why is not a text", id="why"),
        pytest.param(changed(("idle", "awake"), 1), "awake is neither", id="flag"),
        pytest.param(changed(("idle",), []), "an entry is not an object", id="idle"),
        pytest.param(changed(("frames_sent",), True), "frames_sent is not", id="bool for a number"),
    ],
)
def test_an_invalid_file_gives_one_line(text: bytes, said: str, tmp_path: Path) -> None:
    file = tmp_path / "evidence.json"
    file.write_bytes(text)
    with pytest.raises(BadInputFileError, match=r"evidence\.json: ") as raised:
        read_evidence(file)
    assert said in str(raised.value)
    assert "\n" not in str(raised.value)
    assert len(str(raised.value)) < 400


def test_what_is_no_file_gives_one_line(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "absent", Path("/dev/null")):
        with pytest.raises(BadInputFileError):
            read_evidence(path)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=5,
)


def places(value: object, here: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    """Return the path of each value in a document, with the first three entries of a list."""
    inner: list[tuple[Any, object]] = []
    if isinstance(value, dict):
        inner = list(value.items())
    elif isinstance(value, list):
        inner = list(enumerate(value))[:3]
    return [path for key, held in inner for path in ((*here, key), *places(held, (*here, key)))]


PLACES = places(document())


@pytest.mark.unmeasured
@given(st.lists(st.tuples(st.sampled_from(PLACES), JSON | st.integers(0, 255)), min_size=1, max_size=3))
@settings(max_examples=60)
def test_any_change_is_refused_or_shown(changes: list[tuple[tuple[str | int, ...], object]]) -> None:
    """Whatever a stranger writes: either one clear error, or a document that every report can show."""
    whole = document()
    for path, value in changes:
        inner: Any = whole
        try:
            for step in path[:-1]:
                inner = inner[step]
            inner[path[-1]] = value
        except (KeyError, IndexError, TypeError):
            continue  # an earlier change took it away
    try:
        evidence = decode(json.dumps(whole).encode())
    except BadLineError:
        return
    assert list(settlement_rows(evidence))
    assert markdown(evidence).startswith("# Evidence")
    assert decode(encode(evidence).encode()) == evidence._replace(seconds=round(evidence.seconds, 1))


def test_a_hostile_text_stays_harmless_in_markdown() -> None:
    hostile = "<script>|x|\x1b[31m\n# heading [a](b)"
    evidence = decode(changed(("nodes", 0, "why"), hostile))
    (line,) = [line for line in markdown(evidence).splitlines() if "script" in line]
    assert line.endswith(r"\<script\>\|x\|\\x1b\[31m\\n\# heading \[a\](b) |")
