"""Runs all checks of ``doctor`` in order: software, Bluetooth, this machine, and a robot if one is named."""

from collections.abc import Awaitable, Callable, Collection

from sphero_probe.diagnostics.bluetooth import check_bluetooth
from sphero_probe.diagnostics.machine import SOFTWARE, SURROUNDINGS
from sphero_probe.diagnostics.robot import check_robot, skip_robot
from sphero_probe.reports.checks import Look, State
from sphero_probe.session.addressing import address_of
from sphero_probe.transports.base import OpenOptions

Part = Callable[[], Awaitable[None]]


class Checkup:
    """One run of all checks, from the software to the robot.

    Attributes:
        looks: the results so far, with the names of the checks.
    """

    def __init__(
        self,
        device: str,
        options: OpenOptions,
        timeout: float,
        tolerate: Collection[str] = (),
    ) -> None:
        self.looks: list[tuple[str, Look]] = []
        self._device = device
        self._options = options
        self._timeout = timeout
        self._tolerate = tolerate
        self._does_without = bool(device) and address_of(device).scheme != "ble"
        self._reachable = self._does_without

    def parts(self) -> tuple[Part, ...]:
        """Return the groups of checks, in order."""
        machine = (self._software, self._bluetooth, self._surroundings)
        return (*machine, self._robot) if self._device else machine

    async def look_safely(self, part: Part) -> None:
        """Run one group of checks; an unexpected error becomes a result."""
        try:
            await part()
        except Exception as error:  # noqa: BLE001 - doctor must work on a broken machine
            tell = self._tell_besides if part == self._bluetooth else self._tell
            tell(part.__name__.strip("_"), _stumbled(error))

    def _tell(self, name: str, look: Look) -> None:
        self.looks.append((name, look))

    def _tell_besides(self, name: str, look: Look) -> None:
        """Report a check of Bluetooth; a failure is only a warning for a robot that does not use it."""
        besides = self._does_without and look.state is State.FAIL
        self._tell(name, look._replace(state=State.WARN) if besides else look)

    async def _software(self) -> None:
        for name, check in SOFTWARE.items():
            self._tell(name, _looked(check))

    async def _bluetooth(self) -> None:
        works = await check_bluetooth(self._tell_besides, self._timeout, self._options.adapter)
        self._reachable = works or self._does_without

    async def _surroundings(self) -> None:
        for name, check in SURROUNDINGS.items():
            self._tell(name, _looked(check))

    async def _robot(self) -> None:
        if not self._reachable:
            skip_robot(self._tell, "Bluetooth is not usable")
            return
        await check_robot(self._tell, self._device, self._options, self._timeout, self._tolerate)


def _looked(check: Callable[[], Look]) -> Look:
    """Return the result of a check; an unexpected error is a result too."""
    try:
        return check()
    except Exception as error:  # noqa: BLE001 - doctor must work on a broken machine
        return _stumbled(error)


def _stumbled(error: Exception) -> Look:
    said = f"{type(error).__name__}: {error}"
    if isinstance(error, ImportError):
        return Look(State.FAIL, said, "reinstall: pip install --force-reinstall sphero-probe")
    return Look(State.FAIL, f"this check failed unexpectedly: {said}", "please report this line")
