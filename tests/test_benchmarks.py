"""The benchmark runs, its simulated traffic is as described, and it reports which peer lost what."""

import json
import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

from benchmarks import codec, fleet, modelled, peers, sweep, whole
from benchmarks.__main__ import main
from benchmarks.corpus import (
    ANSWERS_ONLY,
    chunks,
    commands,
    damaged,
    first_generation,
    second_generation,
)
from benchmarks.section import Line, Options, Ratio, Remark
from benchmarks.timing import race, ratio
from sphero_probe.protocol.packets import Generation, Notification, Response
from sphero_probe.protocol.v2 import V2
from tests.support import reference_decoder, reference_decoder_v1

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parent.parent


@pytest.mark.unmeasured
def test_the_codec_section_runs_and_names_every_peer(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--quick", "--only", "codec", "--rounds", "3", "--json"]) == 0
    entries = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    lines = [entry for entry in entries if entry["type"] == "line"]
    assert {entry["section"] for entry in entries} == {"codec"}
    decoding = [line for line in lines if "decode" in line["what"] and line["peer"].startswith("spherov2")]
    assert len(decoding) == 7
    for line in decoding:
        assert line["ratio"]["median"] > 1
        assert not line["lost"]
    assert any("encode" in line["what"] for line in lines)
    damaged_lines = [line for line in lines if "damaged" in line["what"]]
    assert all(line["lost"] and line["ratio"] is None for line in damaged_lines)
    assert all("we recovered 100 %" in line["note"] for line in damaged_lines if line["what"][:2] == "V2")


def test_the_quick_benchmark_is_a_command() -> None:
    command = [sys.executable, "-m", "benchmarks", "--help"]
    ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    for word in ("--quick", "--only", "--rounds", "--json", "codec", "decode"):
        assert word in ran.stdout


@pytest.mark.parametrize(
    "arguments",
    [
        pytest.param(["--only", "cooking"], id="no such section"),
        pytest.param(["--rounds", "0"], id="no round"),
    ],
)
def test_what_cannot_be_measured_is_refused(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    assert arguments[1] in capsys.readouterr().err or arguments[1] == "0"


def test_the_text_shows_targets_and_losses(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    entries: list[Line | Remark] = [
        Remark("what is simulated"),
        Line("a task", "a peer", Ratio(3.0, 2.0, 4.0), 2.5),
        Line("a task", "a slow one", Ratio(2.0, 2.0, 2.0), 2.5, note="1 us"),
        Line("a task", "a lossy one", Ratio(9.0, 9.0, 9.0), 2.5, "7 of 9 frames"),
    ]
    section = codec.SECTION._replace(measure=lambda _: iter(entries))
    monkeypatch.setattr("benchmarks.__main__.sections", lambda: {"codec": section})
    assert main(["--quick"]) == 0
    shown, targets = capsys.readouterr().out.split("\ntargets: ")
    remark, met, missed, lossy = shown.splitlines()[-4:]
    assert remark.strip() == "what is simulated"
    assert "3.0x [2.0-4.0]" in met
    assert "target 2.5x met" in met
    assert "target 2.5x missed" in missed
    assert "7 of 9 frames" in lossy
    assert "met" not in lossy
    assert targets.splitlines()[1:] == [
        "  missed        2    >= 2.5  a task | a slow one",
        "  met           3    >= 2.5  a task | a peer",
    ]


def test_a_missing_peer_is_named_with_the_command_that_installs_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> None:
        raise ModuleNotFoundError(f"No module named {name}", name=name)

    monkeypatch.setattr(peers, "version", missing)
    left_out = list(peers.peers(Generation.V2))
    assert len(left_out) == 2
    assert all("[bench]" in text and "not installed" in text for text in left_out)
    rows = list(codec._recovery(damaged(second_generation(50), 0.1), []))
    assert all("we recovered 100 %" in row.note for row in rows)


def test_a_peer_that_loses_frames_is_reported() -> None:
    def deaf(found: list[object]) -> tuple[peers.Feed, peers.Flush]:
        feed, flush = peers.ours(Generation.V2).open(found)
        first = iter([True])
        return lambda chunk: None if next(first, False) else feed(chunk), flush

    corpus = second_generation(200)
    poor = peers.ours(Generation.V2)._replace(name="a deaf peer", open=deaf)
    assert codec._loss(corpus, 244, peers.ours(Generation.V2)) == ""
    assert codec._loss(corpus, 244, poor).endswith("of 200 frames, 0 wrong")
    assert codec._encode_errors(poor, commands(20)) == ""
    assert codec._encode_errors(poor._replace(encode=lambda _: [b""]), commands(20))


def test_the_plain_decoders_read_the_corpora() -> None:
    for corpus in (second_generation(300), second_generation(100, kinds=ANSWERS_ONLY)):
        plain = reference_decoder.frames_in(corpus.stream, 4096)
        assert len(plain) == len(corpus.packets)
        for frame, packet in zip(plain, corpus.packets, strict=True):
            assert isinstance(packet, Response | Notification)
            assert (frame.did, frame.cid, frame.seq) == (packet.did, packet.cid, packet.seq)
            assert (frame.tid, frame.sid, frame.data) == (packet.target, packet.source, packet.payload)
            assert frame.flags == packet.flags
    corpus = first_generation(60)
    said = [packet for packet in corpus.packets if isinstance(packet, Response | Notification)]
    assert len(said) == len(corpus.packets)
    payloads = [frame.data for frame in reference_decoder_v1.frames_in(corpus.stream, "host", 4096)]
    assert payloads == [packet.payload for packet in said]


def test_a_corpus_is_the_same_for_the_same_seed() -> None:
    assert second_generation(50) == second_generation(50)
    assert second_generation(50).stream != second_generation(50, seed=2).stream
    assert b"".join(chunks(first_generation(50).stream, 7)) == first_generation(50).stream
    assert all(len(command.payload) < 12 for command in commands(40))


def test_damage_leaves_the_good_frames_whole() -> None:
    corpus = second_generation(500)
    corpus_with_damage = damaged(corpus, 0.1)
    assert 420 < len(corpus_with_damage.packets) < 480
    at = 0
    for packet in corpus_with_damage.packets:
        frame = V2.frame_of(packet)
        at = corpus_with_damage.stream.index(frame, at) + len(frame)


def test_rounds_are_interleaved() -> None:
    order: list[str] = []
    seconds = race({name: partial(order.append, name) for name in "abc"}, 3)
    assert "".join(order) == "abc" + "abc" + "bca" + "cab"
    assert all(len(times) == 3 for times in seconds.values())
    assert ratio([2.0, 4.0, 9.0], [1.0, 1.0, 3.0]) == Ratio(3.0, 2.5, 3.5)
    assert ratio([3.0], [1.5]) == Ratio(2.0, 2.0, 2.0)


def test_rounds_are_at_least_seven(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Options] = []

    def measure(options: Options) -> Iterator[Line | Remark]:
        asked.append(options)
        return iter(())

    section = codec.SECTION._replace(measure=measure)
    monkeypatch.setattr("benchmarks.__main__.sections", lambda: {"codec": section})
    for arguments in ([], ["--quick"], ["--rounds", "2"]):
        main(arguments)
    assert [options.rounds for options in asked] == [15, 7, 2]


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("loss", sweep.LOSSES)
@pytest.mark.parametrize("queue", sweep.QUEUES)
@pytest.mark.parametrize("silent", sweep.SILENT)
@pytest.mark.parametrize(("interval", "per_event"), sweep.LINKS)
@pytest.mark.unmeasured
def test_no_answer_is_taken_for_silence_on_any_modelled_link(
    interval: float, per_event: int, silent: float, queue: int, loss: float, seed: int
) -> None:
    swept = modelled.sweep_of(modelled.Cell(interval, per_event, silent, queue, loss), [0x13], seed)
    assert swept.false == 0
    assert swept.seconds >= swept.limit


@pytest.mark.parametrize(("interval", "per_event"), sweep.LINKS)
@pytest.mark.unmeasured
def test_a_sweep_of_whole_devices_comes_near_its_link(interval: float, per_event: int) -> None:
    """On a virtual clock: the same on every machine, even a busy one."""
    cell = modelled.Cell(interval, per_event, *sweep.USUAL, 0.0)
    swept = modelled.sweep_of(cell, range(0x40, 0x48), 0)
    assert swept.seconds / swept.limit < 1.2  # begin and end weigh more than in a sweep of all devices
    theirs = modelled.strategy_of_spherov2(cell, 0)
    assert theirs / modelled.sweep_of(cell, [0x13], 0).seconds > 20


def test_a_fleet_is_measured_with_time_and_memory() -> None:
    one = fleet.sweep(1, 15)
    two = fleet.sweep(2, 15)
    assert min(one.seconds, one.cpu) > 0
    if one.mebibytes and two.mebibytes:
        assert 10 < one.mebibytes <= two.mebibytes * 1.1


def test_a_whole_sweep_is_measured_and_resumed(tmp_path: Path) -> None:
    journal = tmp_path / "run.jsonl"
    swept = whole.sweep(1, "--journal", str(journal))
    held = journal.read_bytes()
    journal.write_bytes(held[: len(held) // 2])
    resumed = whole.resume(journal)
    assert min(swept.cpu, resumed.cpu) > 0
    assert journal.read_bytes().count(b'"type":"finding"') >= 256
    assert [whole._memory("jsonl", 38.0, many, 1 << 16).verdict for many in (40.0, 80.0)] == ["met", "missed"]
