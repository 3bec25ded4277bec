"""Keep what is asked outside the probes: waking, identifying and measuring the robot.

With these exchanges and the findings, a recording answers a whole run as the robot did.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Final

from sphero_probe.link.events import Events, ExchangeEnded
from sphero_probe.link.exchange import Answered, Blocked, Silent
from sphero_probe.probing.finding import Note
from sphero_probe.transports.recordings import EXCHANGES

_IN_ONE_NOTE: Final = 500


@contextmanager
def exchanges_kept(events: Events) -> Iterator[list[Answered | Silent]]:
    """Yield a list that takes every exchange while the context lasts."""
    ended: list[Answered | Silent] = []

    def keep(event: ExchangeEnded) -> None:
        if not isinstance(event.exchange, Blocked):
            ended.append(event.exchange)

    with events.subscribe(keep, ExchangeEnded):
        yield ended


def exchange_notes(exchanges: Sequence[Answered | Silent]) -> Iterator[Note]:
    """Yield the notes that keep exchanges, in their order; of a long list several, as a line is bounded."""
    for at in range(0, len(exchanges), _IN_ONE_NOTE):
        some = exchanges[at : at + _IN_ONE_NOTE]
        text = f"{len(some)} commands outside the plan, to wake, identify and measure the robot"
        yield Note(EXCHANGES, text, {EXCHANGES: [_as_json(one) for one in some]})


def _as_json(exchange: Answered | Silent) -> dict[str, object]:
    answer = exchange if isinstance(exchange, Answered) else None
    return {
        "sent": exchange.sent.hex(),
        "received": answer.received.hex() if answer else None,
        "rtt_ms": round(answer.rtt * 1000, 3) if answer else None,
    }
