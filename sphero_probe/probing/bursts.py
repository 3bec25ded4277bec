"""Send commands to a node at once, as a burst, and see how many are answered and in which order."""

from collections.abc import Sequence

from sphero_probe.link.concurrent import ask_together
from sphero_probe.link.events import ExchangeEnded
from sphero_probe.link.exchange import Answered
from sphero_probe.link.link import Link
from sphero_probe.link.pacing import FIRST_TIMEOUT
from sphero_probe.probing.evidence import Burst
from sphero_probe.protocol.packets import Command, Verdict


async def send_burst(link: Link, commands: Sequence[Command]) -> Burst:
    """Send commands at once, whatever the pace of their node, and wait for the answers.

    Args:
        link: to a robot that has nothing else to do.
        commands: of the class ``read``, all to one node.

    Raises:
        LinkLostError: the link was lost.
    """
    ended: list[ExchangeEnded] = []
    timeout = max(FIRST_TIMEOUT, link.pace(commands[0].target).timeout)
    with link.window.fixed(len(commands)), link.events.subscribe(ended.append, ExchangeEnded):
        exchanges = await ask_together(link.ask(command, timeout=timeout) for command in commands)
    place = {one.seq: number for number, one in enumerate(exchanges) if isinstance(one, Answered)}
    came = [event.exchange for event in ended if isinstance(event.exchange, Answered)]
    served = [one for one in came if link.codec.verdict(one.response.code) is not Verdict.BUSY]
    places = [place[one.seq] for one in served]
    return Burst(
        sent=len(commands),
        answered=len(served),
        busy=len(came) - len(served),
        in_order=places == sorted(places),
        milliseconds=tuple(round(one.rtt * 1000, 1) for one in served),
    )
