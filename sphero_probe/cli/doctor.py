"""``doctor``: this machine goes in, and a robot if one is named; what works and what to mend comes out."""

from collections import Counter
from functools import partial
from typing import TYPE_CHECKING

import click

from sphero_probe.cli.options import device_options, output_options
from sphero_probe.cli.output import Output

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from sphero_probe.reports.checks import Look, State

    Part = Callable[[], Awaitable[None]]


@click.command("doctor")
@click.option(
    "--timeout",
    type=click.FloatRange(min=0.1, max=600),
    default=5.0,
    metavar="SECONDS",
    help="For each look at this machine; a robot's answer gets 1 s of it at most.  [default: 5]",
)
@partial(device_options, unnamed="none is connected to")
@output_options
def command(
    output: Output, device: str, timeout: float, connect_timeout: float, adapter: str, verbose: bool
) -> None:
    """Tell whether this machine can reach a robot, and what to mend.

    A line each: ok, warn, fail or skipped; exit 1 if one failed. Without --device no robot is connected to;
    with it the link to that robot is measured, and for a robot that is not reached over Bluetooth LE, what
    Bluetooth lacks only warns.

    Example: sphero-probe doctor --device BP-1234
    """
    from sphero_probe.cli.interrupts import Interrupts, run_interruptible
    from sphero_probe.reports.checks import CHECKS, State, check_row

    checkup = Checkup(device, adapter, timeout, connect_timeout, verbose=verbose)

    async def work() -> None:
        with output.report(CHECKS) as report:
            shown = 0
            for part in checkup.parts():
                await checkup.look_safely(part)
                for name, look in checkup.looks[shown:]:
                    report.add(check_row(name, look))
                shown = len(checkup.looks)

    run_interruptible(Interrupts(), work())
    counts = Counter(look.state for _, look in checkup.looks)
    click.echo(_summary(counts, measured=bool(device)), err=True)
    if counts[State.FAIL]:
        raise click.exceptions.Exit(1)


class Checkup:
    """One round of looks, from the software to the robot.

    Attributes:
        looks: what was found so far, under the names of the checks.
    """

    def __init__(
        self, device: str, adapter: str, timeout: float, connect_timeout: float, *, verbose: bool
    ) -> None:
        from sphero_probe.cli.session import address_of

        self.looks: list[tuple[str, Look]] = []
        self._device = device
        self._adapter = adapter
        self._timeout = timeout
        self._connect_timeout = connect_timeout
        self._verbose = verbose
        self._does_without = bool(device) and address_of(device).scheme != "ble"
        self._reachable = self._does_without

    def parts(self) -> "tuple[Part, ...]":
        """Return what there is to look at, in order."""
        machine = (self._software, self._bluetooth, self._surroundings)
        return (*machine, self._robot) if self._device else machine

    async def look_safely(self, part: "Part") -> None:
        """Look at one part; what the look itself stumbles over is told like what it finds."""
        try:
            await part()
        except Exception as error:  # noqa: BLE001 - this one has to work on a broken machine
            tell = self._tell_besides if part == self._bluetooth else self._tell
            tell(part.__name__.strip("_"), _stumbled(error))

    def _tell(self, name: str, look: "Look") -> None:
        self.looks.append((name, look))

    def _tell_besides(self, name: str, look: "Look") -> None:
        """Tell what a robot that is not reached over Bluetooth LE can do without."""
        from sphero_probe.reports.checks import State

        besides = self._does_without and look.state is State.FAIL
        self._tell(name, look._replace(state=State.WARN) if besides else look)

    async def _software(self) -> None:
        from sphero_probe.cli.machine_checks import SOFTWARE

        for name, check in SOFTWARE.items():
            self._tell(name, _looked(check))

    async def _bluetooth(self) -> None:
        from sphero_probe.cli.bluetooth_checks import check_bluetooth

        works = await check_bluetooth(self._tell_besides, self._timeout, self._adapter)
        self._reachable = works or self._does_without

    async def _surroundings(self) -> None:
        from sphero_probe.cli.machine_checks import SURROUNDINGS

        for name, check in SURROUNDINGS.items():
            self._tell(name, _looked(check))

    async def _robot(self) -> None:
        from sphero_probe.cli.robot_checks import check_robot, skip_robot
        from sphero_probe.transports.base import OpenOptions

        if not self._reachable:
            skip_robot(self._tell, "Bluetooth is not usable")
            return
        options = OpenOptions(self._connect_timeout, self._adapter, self._echo)
        await check_robot(self._tell, self._device, options, self._timeout)

    def _echo(self, step: str) -> None:
        if self._verbose:
            from sphero_probe.cli.output import say

            say(f"{step} ...")


def _looked(check: "Callable[[], Look]") -> "Look":
    """What a check found; one that stumbles is a finding, too."""
    try:
        return check()
    except Exception as error:  # noqa: BLE001 - this one has to work on a broken machine
        return _stumbled(error)


def _stumbled(error: Exception) -> "Look":
    from sphero_probe.reports.checks import Look, State

    said = f"{type(error).__name__}: {error}"
    if isinstance(error, ImportError):
        return Look(State.FAIL, said, "install it anew: pip install --force-reinstall sphero-probe")
    return Look(State.FAIL, f"doctor stumbled: {said}", "please report this line")


def _summary(counts: "Counter[State]", *, measured: bool) -> str:
    from sphero_probe.reports.checks import State

    said = ", ".join(f"{counts[state]} {state.value}" for state in State if counts[state])
    return said if measured else f"{said}; to measure a robot, too: --device ROBOT"
