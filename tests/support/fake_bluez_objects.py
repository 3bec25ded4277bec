"""The tree of D-Bus objects of the fake BlueZ; a change of the tree sends its signals."""

from typing import Any

from dbus_fast import Message, Variant

from tests.support.fake_bluez_wire import BUS_ERROR, BUS_NAME, Bus, CallError, Client, unknown_method

PROPERTIES = f"{BUS_NAME}.Properties"
OBJECTS = f"{BUS_NAME}.ObjectManager"

Properties = dict[str, Variant]


class BlueZError(CallError):
    """An error of ``org.bluez``."""

    def __init__(self, name: str, text: str) -> None:
        super().__init__(f"org.bluez.Error.{name}", text)


def returns(call: Message, signature: str = "", *body: Any) -> Message:
    """Return the reply to a successful call."""
    return Message.new_method_return(call, signature, list(body))


class Objects:
    """Path -> interface -> properties, as every client can see them.

    Attributes:
        tree: the objects.
        bus: where signals and late replies go.
    """

    def __init__(self, bus: Bus) -> None:
        self.tree: dict[str, dict[str, Properties]] = {}
        self.bus = bus

    def __contains__(self, path: str) -> bool:
        return path in self.tree

    def read(self, path: str, interface: str, name: str) -> Any:
        """Return the plain value of a property."""
        return self.tree[path][interface][name].value

    def change(
        self, path: str, interface: str, changed: Properties, invalidated: tuple[str, ...] = ()
    ) -> None:
        """Set and remove properties, and send the signal; an object that does not exist is not created."""
        if path not in self.tree:
            return
        shown = self.tree[path][interface]
        shown |= changed
        for name in invalidated:
            shown.pop(name, None)
        body = [interface, changed, list(invalidated)]
        self.bus.spread(Message.new_signal(path, PROPERTIES, "PropertiesChanged", "sa{sv}as", body))

    def show(self, path: str, interface: str, properties: Properties) -> None:
        """Add an object, and send the signal."""
        self.tree[path] = {interface: properties}
        body = [path, {interface: properties}]
        self.bus.spread(Message.new_signal("/", OBJECTS, "InterfacesAdded", "oa{sa{sv}}", body))

    def hide(self, path: str) -> None:
        """Remove an object and all below it, the deepest first, and send the signals."""
        below = [one for one in self.tree if one == path or one.startswith(f"{path}/")]
        for one in sorted(below, reverse=True):
            body = [one, list(self.tree.pop(one))]
            self.bus.spread(Message.new_signal("/", OBJECTS, "InterfacesRemoved", "oas", body))

    def answer(self, call: Message) -> Message | None:
        """Reply to a call of ObjectManager or Properties; return None for any other.

        Raises:
            CallError: there is no such object, interface, property or method.
        """
        path = call.path or ""
        if (call.interface, call.member) == (OBJECTS, "GetManagedObjects"):
            return returns(call, "a{oa{sa{sv}}}", self.tree)
        if path not in self.tree:
            raise unknown_method(call, "Object")
        if call.interface != PROPERTIES:
            return None
        interface, *rest = call.body
        shown = self.tree[path].get(interface)
        if shown is None or (rest and rest[0] not in shown):
            raise CallError(f"{BUS_ERROR}.InvalidArgs", f"No such property or interface '{interface}'")
        match call.member:
            case "GetAll":
                return returns(call, "a{sv}", shown)
            case "Get":
                return returns(call, "v", shown[rest[0]])
            case "Set":
                self.change(path, interface, {rest[0]: rest[1]})
                return returns(call)
            case _:
                raise unknown_method(call)

    def reply(self, client: Client, call: Message) -> None:
        """Reply at once that a call succeeded, before its effects."""
        self.bus.reply(client, call, returns(call))
