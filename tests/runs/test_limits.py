"""Whatever a decoder accepts can be shown, stored and read again: one limit for all of them."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.exchange import Answered
from sphero_probe.probing.finding import Confidence, Finding, Outcome
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation, Malformed, Packet, Response, Role
from sphero_probe.protocol.v2_frames import MAX_FRAME, frame
from sphero_probe.reports import views
from sphero_probe.reports.rows import finding_row, packet_row
from sphero_probe.runs.decode import Opening, decode
from sphero_probe.runs.encode import encode_finding
from tests.support.reports_by_hand import rendered

OPENING = Opening("sweep", "test", "", {}, "", "fake:bolt", Generation.V2, "bolt", "SB-1", ("read",))
SIZES = st.integers(0, 64) | st.integers(MAX_FRAME - 80, MAX_FRAME)


def decoded(body: bytes) -> Packet | None:
    """The packet of a frame around these bytes, None where a decoder takes it for damage."""
    packets = CODECS[Generation.V2].decoder(Role.HOST).feed(frame(body))
    sound = [packet for packet in packets if not isinstance(packet, Malformed)]
    return sound[0] if sound else None


@pytest.mark.unmeasured
@given(SIZES, st.sampled_from([b"\x00", b"\x8d", b"\xab\x01"]), st.sampled_from([0x01, 0x31, 0x38, 0x08]))
def test_what_is_decoded_can_be_written_shown_and_kept(size: int, filling: bytes, flags: int) -> None:
    body = bytes([flags, 0x13, 0x10, 0x07, 0x00, 0x00, 0x00]) + (filling * size)[:size]
    packet = decoded(body)
    if packet is None:
        assert len(frame(body)) > MAX_FRAME // 2, "only what is too long is damage"
        return
    raw = CODECS[Generation.V2].frame_of(packet)
    assert raw == frame(body)
    for form in ("table", "plain", "jsonl", "csv"):
        assert rendered(form, [packet_row(packet, Generation.V2, raw)], views.PACKETS)
    if isinstance(packet, Response):
        assert packet.did is not None
        assert packet.cid is not None
        command = Command(packet.did, packet.cid)
        exchange = Answered(command, packet.seq, b"sent", packet, raw, 0.01)
        finding = Finding(1, command, Outcome.EXISTS, Confidence.CERTAIN, Risk.READ, exchange, None, "", 1)
        kept = decode(json.loads(encode_finding(finding)), OPENING)
        assert isinstance(kept, Finding)
        assert kept.exchange == exchange
        assert rendered("table", [finding_row(finding)], views.FINDINGS)
