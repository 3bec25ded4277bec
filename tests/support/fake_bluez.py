"""A fake BlueZ that needs no Bluetooth: unpatched bleak finds its robots at a D-Bus address.

It is a message bus and bluetoothd in one. It runs in its own thread, so that a test and the processes that
the test starts can both use it::

    with FakeBlueZ([Peripheral("BP-1234", "AA:BB:CC:DD:EE:FF", robot=robot)]) as bluez:
        monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", bluez.address)
"""

import asyncio
import contextlib
import tempfile
import threading
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Self
from urllib.parse import quote

from dbus_fast import Message

from tests.support.fake_bluez_air import (
    ACCESS_DENIED,
    CHILD_EXITED,
    PHRASE,
    V2_API,
    V2_GATE,
    V2_SERVICE,
    BusFaults,
    Characteristic,
    Faults,
    Peripheral,
    Profile,
    Robot,
    Service,
    sphero_v1,
    sphero_v2,
)
from tests.support.fake_bluez_device import DEVICE, ROOT, Adapter
from tests.support.fake_bluez_links import Links
from tests.support.fake_bluez_objects import Objects
from tests.support.fake_bluez_scans import Scans
from tests.support.fake_bluez_wire import BUS_ERROR, Bus, CallError, Client, unknown_method

__all__ = [
    "ACCESS_DENIED",
    "CHILD_EXITED",
    "PHRASE",
    "V2_API",
    "V2_GATE",
    "V2_SERVICE",
    "Adapter",
    "BusFaults",
    "Call",
    "Characteristic",
    "FakeBlueZ",
    "Faults",
    "Peripheral",
    "Profile",
    "Robot",
    "Service",
    "sphero_v1",
    "sphero_v2",
]

PATIENCE = 10.0
"""Timeout in seconds for a request to the fake's own thread."""


class Call(NamedTuple):
    """One method call that the fake BlueZ received.

    Attributes:
        member: the method, ``StartDiscovery``.
        path: the object.
        interface: its interface.
        body: the arguments.
    """

    member: str
    path: str
    interface: str
    body: list[Any]


class FakeBlueZ:
    """The machine's Bluetooth, inside the ``with`` block.

    Attributes:
        address: for ``DBUS_SYSTEM_BUS_ADDRESS``.
        faults: what is wrong with the machine.
        log: every call that reached BlueZ.
    """

    def __init__(
        self,
        peripherals: Iterable[Peripheral] = (),
        *,
        adapters: Sequence[Adapter] = (Adapter(),),
        faults: BusFaults | None = None,
    ) -> None:
        self.address = ""
        self.faults = faults or BusFaults()
        self.log: list[Call] = []
        self._peripherals = list(peripherals)
        self._adapters = adapters
        self._problems: list[Exception] = []
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._run, name="fake BlueZ")
        self._loop: asyncio.AbstractEventLoop
        self._stop: asyncio.Event
        self._bus: Bus
        self._objects: Objects
        self._links: Links
        self._scans: Scans

    def __enter__(self) -> Self:
        self._thread.start()
        assert self._ready.wait(PATIENCE)
        self._complain()
        return self

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(RuntimeError):  # the loop is closed: what ended it is told below
            self._loop.call_soon_threadsafe(self._stop.set)
        self._thread.join(PATIENCE)
        self._complain()

    def add(self, peripheral: Peripheral) -> None:
        """Bring a robot into range."""
        self._ask(lambda: self._scans.add(peripheral))

    def remove(self, peripheral: Peripheral) -> None:
        """Remove a robot permanently."""
        self._ask(lambda: self._links.remove(peripheral))

    def drop(self, peripheral: Peripheral) -> None:
        """Drop the link to a robot."""
        self._ask(lambda: self._links.drop(peripheral))

    def hold(self, peripheral: Peripheral) -> None:
        """Make another program on this machine connect to a robot, by the first adapter, and keep it."""
        self._ask(lambda: self._links.hold(self._links.of(peripheral)[0]))

    def power(self, *, on: bool, adapter: str = "hci0") -> None:
        """Switch an adapter on or off."""
        self._ask(lambda: self._scans.power(adapter, on=on))

    def hang_up(self) -> None:
        """Close every connection to the bus, as when dbus-daemon is restarted."""
        self._ask(self._bus.hang_up)

    @property
    def most_links(self) -> dict[str, int]:
        """Name of an adapter -> the most links that it had at a time; without those that had none."""
        return {path.rpartition("/")[2]: most for path, most in self._links.most_at_once.items()}

    def called(self, member: str) -> list[Call]:
        """Return the calls of one method, ``StartDiscovery``."""
        return [call for call in self.log if call.member == member]

    def _ask(self, action: Callable[[], object]) -> None:
        """Run a function in the bus's own thread, and wait for it."""

        async def act() -> None:
            action()

        asyncio.run_coroutine_threadsafe(act(), self._loop).result(PATIENCE)

    def _complain(self) -> None:
        """Raise errors from inside the fake, so that they are not mistaken for a silent robot."""
        if self._problems:
            raise ExceptionGroup("the fake BlueZ stumbled", self._problems)

    def _run(self) -> None:
        try:
            with tempfile.TemporaryDirectory(prefix="bluez-") as folder:
                asyncio.run(self._live(Path(folder) / "bus"))
        except Exception as error:  # noqa: BLE001 - raised again in the test's thread
            self._problems.append(error)
        finally:
            self._ready.set()

    async def _live(self, path: Path) -> None:
        self._loop = asyncio.get_running_loop()
        self._loop.set_exception_handler(self._note_problem)
        self._stop = asyncio.Event()
        self._bus = Bus("org.bluez", self._serve, self._gone, self.faults)
        self._objects = Objects(self._bus)
        self._objects.tree[ROOT] = {"org.bluez.AgentManager1": {}}
        self._links = Links(self._objects)
        self._scans = Scans(self._objects, self._links, self._adapters)
        for peripheral in self._peripherals:
            self._scans.add(peripheral)
        server = await self._loop.create_unix_server(self._bus.welcome, path)
        self.address = f"unix:path={quote(str(path))}"
        self._ready.set()
        try:
            await self._stop.wait()
        finally:
            server.close()
            self._bus.hang_up()
            await server.wait_closed()

    def _note_problem(self, _loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        self._problems.append(context.get("exception") or RuntimeError(context["message"]))

    def _gone(self, client: Client) -> None:
        self._scans.gone(client)
        self._links.gone(client)

    def _serve(self, client: Client, call: Message) -> Message | None:
        path, interface, member = call.path or "", call.interface or "", call.member or ""
        self.log.append(Call(member, path, interface, call.body))
        if member == self.faults.hangs_up_at:
            self.faults.hangs_up_at = ""
            self._bus.hang_up()
            return None
        for name in (member, "*"):
            if name in self.faults.errors:
                raise CallError(*self.faults.errors[name])
            if name in self.faults.unanswered:
                return None
        try:
            return self._objects.answer(call) or self._act(client, call)
        except CallError:
            raise
        except Exception as error:
            self._problems.append(error)
            raise CallError(f"{BUS_ERROR}.Failed", f"the fake BlueZ stumbled: {error!r}") from error

    def _act(self, client: Client, call: Message) -> Message | None:
        path, interface, member = call.path or "", call.interface or "", call.member or ""
        method = (self._links.methods | self._scans.methods).get((interface, member))
        if method is None or interface not in self._objects.tree[path]:
            raise unknown_method(call)
        if (interface, member) == (DEVICE, "Connect"):
            self._scans.check_power(self._links.devices[path].adapter)
        return method(client, call)
