"""Compares the codecs with those of the peers, on simulated streams, for several read sizes."""

from collections import Counter
from collections.abc import Iterator
from functools import partial
from typing import Any, NamedTuple

from benchmarks.corpus import (
    ANSWERS_ONLY,
    Corpus,
    chunks,
    commands,
    damaged,
    first_generation,
    second_generation,
)
from benchmarks.peers import Peer, no_codec, ours, peers
from benchmarks.section import Line, Options, Remark, Section
from benchmarks.timing import race, ratio
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation, Malformed, Request, Role

_BARS = {
    Generation.V2: {
        65536: {"spherov2": 20.0, "sphero-rvr-mcp": 6.0},
        244: {"spherov2": 12.0, "sphero-rvr-mcp": 4.0},
        20: {"spherov2": 8.0, "sphero-rvr-mcp": 3.5},
        1: {"spherov2": 1.5, "sphero-rvr-mcp": 1.5},
    },
    Generation.V1: {20: {"spherov2": 3.0}, 244: {"spherov2": 5.0}},
}
_ENCODE_BARS = {"spherov2": 12.0, "sphero-rvr-mcp": 2.0}
_DAMAGE = 0.1


class _Found(NamedTuple):
    """The errors of a peer on a corpus: packets that it lost, and packets that were never sent."""

    lost: int
    false: int


def measure(options: Options) -> Iterator[Line | Remark]:
    """Yield the results of both generations; a peer that lost an undamaged frame does not count."""
    size = 2500 if options.quick else 12_000
    for corpus in (second_generation(size), first_generation(size)):
        yield Remark(corpus.summary)
        rivals = []
        for peer in peers(corpus.generation):
            if isinstance(peer, Peer):
                rivals.append(peer)
            else:
                yield Remark(peer)
        for read, bars in _BARS[corpus.generation].items():
            yield from _decoding(corpus, read, rivals, bars, options.rounds)
        if corpus.generation is Generation.V2:
            short = second_generation(size, kinds=ANSWERS_ONLY)
            yield Remark(f"and answers only: {short.summary}")
            yield from _decoding(short, 65536, rivals, {}, options.rounds)
            yield from _encoding(rivals, options)
        else:
            yield Remark("V1 detects damage by one byte: if that fits by chance, the next frame is lost")
        yield from _recovery(damaged(corpus, _DAMAGE), rivals)


def _decoding(
    corpus: Corpus, read: int, rivals: list[Peer], bars: dict[str, float], rounds: int
) -> Iterator[Line]:
    """Time all codecs on a stream that arrives in pieces of one size."""
    if read == 1:  # otherwise it would take as long as everything else
        corpus = corpus.part(len(corpus.packets) // 8)
    contestants = [ours(corpus.generation), no_codec(), *rivals]
    runners = {
        peer.name: partial(peer.read, [peer.chunk(chunk) for chunk in chunks(corpus.stream, read)], len)
        for peer in contestants
    }
    seconds = race(runners, rounds)
    mine, loop = (min(seconds[peer.name]) for peer in contestants[:2])
    for peer in rivals:
        yield Line(
            f"{corpus.generation.upper()} decode, {_read_name(read)}" + ("" if bars else ", answers only"),
            peer.name,
            ratio(seconds[peer.name], seconds[contestants[0].name]),
            bars.get(peer.name.split()[0]),
            _loss(corpus, read, peer),
            f"{mine / len(corpus.packets) * 1e6:.2f} us per frame, of which the empty loop takes "
            f"{loop / len(corpus.packets) * 1e6:.2f} us"
            + (f"; it does not report {peer.silent}" if peer.silent else ""),
        )


def _encoding(rivals: list[Peer], options: Options) -> Iterator[Line]:
    """Time all encoders on the same commands; each assigns its own sequence numbers."""
    batch = commands(500 if options.quick else 3000)
    encoders = [peer for peer in (ours(Generation.V2), *rivals) if peer.encode]
    seconds = race(
        {peer.name: partial(peer.encode, batch) for peer in encoders if peer.encode}, options.rounds
    )
    mine = seconds[encoders[0].name]
    for peer in encoders[1:]:
        yield Line(
            "V2 encode commands",
            peer.name,
            ratio(seconds[peer.name], mine),
            _ENCODE_BARS.get(peer.name.split()[0]),
            _encode_errors(peer, batch),
            f"{min(mine) / len(batch) * 1e6:.2f} us per command",
        )


def _recovery(corpus: Corpus, rivals: list[Peer]) -> Iterator[Line]:
    """Count how many of the undamaged frames between damaged ones each codec finds."""
    for read in (65536, 244, 20):
        mine = _found(corpus, read, ours(corpus.generation))
        what = f"{corpus.generation.upper()} good frames among 10 % damaged, {_read_name(read)}"
        note = f"we recovered {_share(corpus, mine)}"
        if not rivals:
            yield Line(what, "no peer", None, note=note)
        for peer in rivals:
            theirs = _found(corpus, read, peer)
            yield Line(what, peer.name, None, None, f"recovered {_share(corpus, theirs)}", note)


def _loss(corpus: Corpus, read: int, peer: Peer) -> str:
    found = _found(corpus, read, peer)
    return f"{found.lost} of {len(corpus.packets)} frames, {found.false} wrong" if any(found) else ""


def _found(corpus: Corpus, read: int, peer: Peer) -> _Found:
    """Compare the packets that were sent with those that a peer decodes."""
    heard: list[Any] = []
    peer.read([peer.chunk(chunk) for chunk in chunks(corpus.stream, read)], heard.extend)
    got = Counter(peer.facts(packet) for packet in heard if not isinstance(packet, Malformed))
    sent = Counter(map(peer.told, corpus.packets))
    return _Found((sent - got).total(), (got - sent).total())


def _encode_errors(peer: Peer, batch: list[Command]) -> str:
    """Decode a peer's frames with our decoder; return what is wrong, or an empty string."""
    assert peer.encode is not None
    heard = CODECS[Generation.V2].decoder(Role.ROBOT).feed(b"".join(peer.encode(batch)))
    said = [packet.command for packet in heard if isinstance(packet, Request)]
    return "" if said == batch else "its frames decode to other commands"


def _share(corpus: Corpus, found: _Found) -> str:
    return f"{(1 - found.lost / len(corpus.packets)) * 100:.4g} %"


def _read_name(read: int) -> str:
    return "64 KiB reads" if read == 65536 else f"{read} byte{'s' * (read > 1)} per read"


SECTION = Section("codec", "V1 and V2 codecs compared with spherov2 and sphero-rvr-mcp", measure)
