"""``led``: set LEDs by name and colour, or list them."""

from sphero_probe.catalogue import ROBOTS
from sphero_probe.catalogue.leds import Colour
from sphero_probe.catalogue.model import Robot
from sphero_probe.catalogue.naming import colour
from sphero_probe.catalogue.risk import Risk
from sphero_probe.cli.oneshot import send_commands
from sphero_probe.cli.output import show
from sphero_probe.cli.values import AskOptions, ConnectOptions, JournalOptions, Output
from sphero_probe.errors import UsageError
from sphero_probe.link.policy import Consent
from sphero_probe.protocol.packets import Command
from sphero_probe.reports.rows import led_row
from sphero_probe.reports.views import LEDS
from sphero_probe.session.addressing import address_of, model_behind
from sphero_probe.session.commands import led_commands_for


def set_leds(
    output: Output,
    journal: JournalOptions,
    connecting: ConnectOptions,
    asking: AskOptions,
    front: str | None,
    back: str | None,
    leds: tuple[str, ...],
    *,
    off: bool,
) -> None:
    """Set LEDs and show the answers, or show what would be sent.

    Args:
        output: where and how to show the findings.
        journal: which journal to keep.
        connecting: which robot.
        asking: what is allowed besides setting LEDs, and which node.
        front: the colour of the front LED, None to leave it alone.
        back: of the back LED.
        leds: further ones, each ``NAME=RRGGBB``.
        off: switch off every LED that is not named.

    Raises:
        SpheroProbeError: the options are not valid, or a command failed.
    """
    wanted = wanted_leds(front, back, leds)
    if not wanted and not off:
        raise UsageError("no LED is named", "try: sphero-probe led --front ff0000, or --off")

    def make(robot: Robot | None, port: int) -> tuple[Command, ...]:
        return led_commands_for(wanted, robot, port, asking.target, off=off)

    consent = Consent.of(asking.allow, asking.confirm, Risk.WRITE)  # setting LEDs is what was asked for
    send_commands("led", make, consent, output, connecting, asking, journal)


def list_leds(output: Output, device: str) -> None:
    """Show the LEDs of the robot that an address names, without connecting, or those of every robot.

    Raises:
        UsageError: the address is not valid.
    """
    robot = model_behind(address_of(device)) if device else None
    robots = (robot,) if robot else tuple(ROBOTS.values())
    show(output, LEDS, [led_row(one, group) for one in robots if one.leds for group in one.leds.groups])


def wanted_leds(front: str | None, back: str | None, leds: tuple[str, ...]) -> dict[str, Colour]:
    """Return LED name -> colour, in the order they were given.

    Args:
        front: the colour of the front LED, None to leave it alone.
        back: of the back LED.
        leds: further ones, each ``NAME=COLOUR``.

    Raises:
        UsageError: a colour is not valid, or an LED is named twice.
    """
    wanted: dict[str, Colour] = {}
    for name, text in (("front", front), ("back", back)):
        if text is not None:
            wanted[name] = colour(text)
    for led in leds:
        name, equals, text = led.partition("=")
        if not equals or not name:
            raise UsageError(f"--led {led} is not NAME=COLOUR", "for example: --led front=ff0000")
        if name.lower() in wanted:
            raise UsageError(f"--led {led}: the LED {name} is named twice")
        wanted[name.lower()] = colour(text)
    return wanted
