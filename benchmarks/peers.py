"""Adapters that give the codecs of other projects one interface, each used in its fastest way.

From spherov2, the collector of each generation is used, which takes the notifications of a BLE
characteristic. From sphero-rvr-mcp, the reader of its serial dispatcher is used, without the dispatching. If
a parser raises an exception on a bad packet, the rest of that chunk is lost, as in the project itself.
"""

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from importlib import import_module
from importlib.metadata import version
from typing import Any, NamedTuple

from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation, Notification, Packet, Response, Role

EXTRA = "pip install -e '.[bench]'"
"""The command that installs the peers."""

Take = Callable[[list[Any]], object]
"""Receives the packets of one chunk, in a list that is reused afterwards."""
Feed = Callable[[Any], Iterable[Any] | None]
Flush = Callable[[], Iterable[Any]]
Open = Callable[[list[Any]], tuple[Feed, Flush]]
"""Returns a new decoder as two functions, which decode a chunk and return what is still buffered.

A decoder may return the packets, or append them to the list that it is given.
"""


class Peer(NamedTuple):
    """A codec to compare with.

    Attributes:
        name: its name and version.
        open: returns a new decoder.
        facts: one of its packets -> the contents.
        told: one of our packets -> the contents that the peer should report.
        encode: commands -> frames; None if it has no encoder for the generation.
        silent: the contents that its packets leave out.
        chunk: converts bytes to the type that it needs.
    """

    name: str
    open: Open
    facts: Callable[[Any], tuple[object, ...]]
    told: Callable[[Packet], tuple[object, ...]]
    encode: Callable[[list[Command]], list[bytes]] | None = None
    silent: str = ""
    chunk: Callable[[bytes], Any] = bytes

    def read(self, chunks: list[Any], take: Take) -> None:
        """Decode the chunks of a stream; every codec is timed in this same loop."""
        found: list[Any] = []
        feed, flush = self.open(found)
        for chunk in chunks:
            try:
                packets = feed(chunk)
            except Exception:  # noqa: BLE001 - spherov2 raises half a dozen kinds
                packets = None
            if packets:
                found += packets
            take(found)
            found.clear()
        take([*flush()])


def ours(generation: Generation) -> Peer:
    """Return the project's own codec."""
    return Peer(
        "sphero-probe", partial(_open_ours, generation), tuple, tuple, partial(_encode_ours, generation)
    )


def peers(generation: Generation) -> Iterator[Peer | str]:
    """Yield the peers that support a generation; for one that is not installed, a remark."""
    for name, open_peer in _PEERS[generation]:
        try:
            yield open_peer(f"{name} {version(name)}")
        except ImportError as error:
            yield f"{name} is left out: {error.name or error} is not installed, run {EXTRA}"


def no_codec() -> Peer:
    """Return a codec that decodes nothing, to time the loop itself."""
    return Peer("no codec", lambda _: (_ignore, tuple), tuple, tuple)


def _ignore(_: bytes) -> None:
    """Decode nothing."""


def _open_ours(generation: Generation, _: list[Any]) -> tuple[Feed, Flush]:
    decoder = CODECS[generation].decoder(Role.HOST)
    return decoder.feed, decoder.give_up


def _encode_ours(generation: Generation, commands: list[Command]) -> list[bytes]:
    encode = CODECS[generation].encode_command
    return [encode(command, number % 255) for number, command in enumerate(commands)]


def _open_collector(collector: Callable[..., Any], found: list[Any]) -> tuple[Feed, Flush]:
    return collector(found.append).add, tuple


def _spherov2_second(name: str) -> Peer:
    packet = import_module("spherov2.controls.v2").Packet

    def encode(commands: list[Command]) -> list[bytes]:
        new_packet = packet.Manager().new_packet
        return [new_packet(did, cid, target, payload).build() for did, cid, payload, target, _ in commands]

    def facts(its: Any) -> tuple[object, ...]:
        code = its.err if its.flags & 0x01 else None
        return (its.did, its.cid, its.seq, code, its.tid, its.sid, bytes(its.data))

    def told(packet: Packet) -> tuple[object, ...]:
        match packet:
            case Response(seq, code, payload, did, cid, source, target):
                return (did, cid, seq, code, target, source, payload)
            case Notification(did, cid, payload, source, target, seq):
                return (did, cid, seq, None, target, source, payload)
        return ()

    return Peer(name, partial(_open_collector, packet.Collector), facts, told, encode)


def _spherov2_first(name: str) -> Peer:
    packet = import_module("spherov2.controls.v1").Packet

    def facts(its: Any) -> tuple[object, ...]:
        if isinstance(its, packet.Response):
            return (int(its.mrsp), its.seq, bytes(its.data))
        return (its.id_code, bytes(its.data))

    def told(packet: Packet) -> tuple[object, ...]:
        match packet:
            case Response(seq, code, payload):
                return (code, seq, payload)
            case Notification(_, cid, payload):
                return (cid, payload)
        return ()

    return Peer(name, partial(_open_collector, packet.Collector), facts, told, chunk=bytearray)


def _rvr_mcp(name: str) -> Peer:
    build_packet = import_module("sphero_rvr_mcp.protocol.packet").build_packet
    dispatcher = import_module("sphero_rvr_mcp.protocol.dispatcher").SerialDispatcher

    def open_reader(found: list[Any]) -> tuple[Feed, Flush]:
        reader = dispatcher(None)
        reader._dispatch_response = found.append  # noqa: SLF001 - time its framing, not its matching
        return reader._process_data, tuple  # noqa: SLF001 - the only entry point without a thread

    def encode(commands: Iterable[Command]) -> list[bytes]:
        return [build_packet(did, cid, target, payload, True) for did, cid, payload, target, _ in commands]

    def facts(its: Any) -> tuple[object, ...]:
        return (its.did, its.cid, its.seq, its.data)

    def told(packet: Packet) -> tuple[object, ...]:
        match packet:
            case Response(seq, _, payload, did, cid) | Notification(did, cid, payload, _, _, seq):
                return (did, cid, seq, payload)
        return ()

    return Peer(name, open_reader, facts, told, encode, "code, target and source")


_PEERS: dict[Generation, tuple[tuple[str, Callable[[str], Peer]], ...]] = {
    Generation.V1: (("spherov2", _spherov2_first),),
    Generation.V2: (("spherov2", _spherov2_second), ("sphero-rvr-mcp", _rvr_mcp)),
}
