"""The message bus of the fake BlueZ: speaks D-Bus with clients, for one service."""

import asyncio
import io
import re
from collections.abc import Callable
from typing import NamedTuple

from dbus_fast import Message, MessageType, Variant
from dbus_fast._private.constants import LITTLE_ENDIAN, PROTOCOL_VERSION, HeaderField
from dbus_fast._private.marshaller import Marshaller
from dbus_fast._private.unmarshaller import Unmarshaller
from dbus_fast.constants import MessageFlag

from tests.support.fake_bluez_air import BusFaults

BUS_NAME = "org.freedesktop.DBus"
BUS_ERROR = f"{BUS_NAME}.Error"
GUID = "5f3759df" * 4
SERVICE_ADDRESS = ":1.0"
_FIXED_HEADER = 16
_RULE_PART = re.compile(r"(\w+)='?([^',]*)'?")
_ARGUMENT = re.compile(r"arg(\d+)(path)?")


class CallError(Exception):
    """A method call ends in a D-Bus error.

    Attributes:
        name: of the error, ``org.bluez.Error.Failed``.
        text: its body.
    """

    def __init__(self, name: str, text: str) -> None:
        super().__init__(name, text)
        self.name = name
        self.text = text


class MatchRule(NamedTuple):
    """The rule of one ``AddMatch``: all conditions must match."""

    conditions: tuple[tuple[str, str], ...]

    @classmethod
    def parse(cls, text: str) -> "MatchRule":
        """Read ``type='signal',member='…'``, quotes or not."""
        return cls(tuple(sorted(_RULE_PART.findall(text))))

    def fits(self, message: Message, senders: tuple[str, ...]) -> bool:
        """Whether a message matches; ``senders`` are all names of its sender."""
        return all(self._holds(key, value, message, senders) for key, value in self.conditions)

    @staticmethod
    def _holds(key: str, value: str, message: Message, senders: tuple[str, ...]) -> bool:
        if key == "type":
            return message.message_type.name.lower() == value
        if key == "sender":
            return value in senders
        if key == "path_namespace":
            return value == "/" or f"{message.path}/".startswith(f"{value}/")
        if argument := _ARGUMENT.fullmatch(key):
            number, is_path = int(argument[1]), argument[2]
            body = message.body
            if number >= len(body) or not isinstance(body[number], str):
                return False
            if not is_path:
                return bool(body[number] == value)
            return any(
                a == b or (a.endswith("/") and b.startswith(a))
                for a, b in ((value, body[number]), (body[number], value))
            )
        return bool(getattr(message, key, None) == value)


def to_bytes(message: Message, scheduler: str, serial: int) -> bytes:
    """Encode a message as a bus forwards it: with the sender, which dbus-fast's own encoder leaves out."""
    body = Marshaller(message.signature, message.body).marshall()
    fields = [
        (HeaderField.PATH, "o", message.path),
        (HeaderField.INTERFACE, "s", message.interface),
        (HeaderField.MEMBER, "s", message.member),
        (HeaderField.ERROR_NAME, "s", message.error_name),
        (HeaderField.REPLY_SERIAL, "u", message.reply_serial),
        (HeaderField.DESTINATION, "s", message.destination),
        (HeaderField.SENDER, "s", scheduler),
        (HeaderField.SIGNATURE, "g", message.signature),
    ]
    present = [[field.value, Variant(kind, value)] for field, kind, value in fields if value]
    kind, flags = message.message_type.value, MessageFlag.NO_REPLY_EXPECTED.value
    header = Marshaller(
        "yyyyuua(yv)", [LITTLE_ENDIAN, kind, flags, PROTOCOL_VERSION, len(body), serial, present]
    ).marshall()
    return bytes(header) + bytes(-len(header) % 8) + bytes(body)


def frame_length(start: bytes | bytearray) -> int:
    """Return the length in bytes of a message from its first 16."""
    order = "little" if start[0] == LITTLE_ENDIAN else "big"
    body = int.from_bytes(start[4:8], order)  # type: ignore[arg-type]
    fields = int.from_bytes(start[12:16], order)  # type: ignore[arg-type]
    return int(_FIXED_HEADER + fields + -fields % 8 + body)


class Client(asyncio.Protocol):
    """One connection to the bus: first the SASL authentication in lines, then messages.

    Attributes:
        name: its unique name, ``:1.7``.
        rules: the messages that it subscribed to.
    """

    def __init__(self, bus: "Bus", number: int) -> None:
        self.name = f":1.{number}"
        self.rules: list[MatchRule] = []
        self._bus = bus
        self._buffer = bytearray()
        self._begun = False
        self._serial = 0
        self._transport: asyncio.Transport

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        self._bus.clients.append(self)

    def connection_lost(self, exc: Exception | None) -> None:
        self._bus.clients.remove(self)
        self._bus.gone(self)

    def data_received(self, data: bytes) -> None:
        self._buffer += data
        while not self._begun and b"\r\n" in self._buffer:
            line, _, self._buffer = self._buffer.partition(b"\r\n")
            self._hear_line(bytes(line).lstrip(b"\0").decode("ascii"))
        while self._begun and len(self._buffer) >= _FIXED_HEADER:
            length = frame_length(self._buffer[:_FIXED_HEADER])
            if len(self._buffer) < length:
                break
            frame = bytes(self._buffer[:length])
            del self._buffer[:length]
            message = Unmarshaller(io.BytesIO(frame)).unmarshall()  # type: ignore[arg-type]
            assert message is not None
            self._bus.hear(self, message)

    def send(self, message: Message, scheduler: str) -> None:
        """Send a message to the client."""
        self._serial += 1
        self._transport.write(to_bytes(message, scheduler, self._serial))

    def hang_up(self) -> None:
        """Close the connection at once."""
        self._transport.abort()

    def _hear_line(self, line: str) -> None:
        answer: str
        match line.split(" "):
            case ["AUTH", "EXTERNAL"]:
                answer = "DATA"
            case ["AUTH", "EXTERNAL", _] | ["DATA", *_]:
                answer = "REJECTED EXTERNAL" if self._bus.faults.rejects_authentication else f"OK {GUID}"
            case ["NEGOTIATE_UNIX_FD"]:
                answer = "AGREE_UNIX_FD"
            case ["BEGIN"]:
                self._begun = True
                return
            case ["AUTH", *_]:
                answer = "REJECTED EXTERNAL"
            case _:
                answer = "ERROR"
        if not self._bus.faults.mute:
            self._transport.write(f"{answer}\r\n".encode())


class Bus:
    """The message bus: replies to its own methods, forwards other calls to its one service, sends its
    signals.

    Attributes:
        clients: every open connection.
        faults: its faults.
        gone: called for every client that leaves.
    """

    def __init__(
        self,
        service: str,
        serve: Callable[[Client, Message], Message | None],
        gone: Callable[[Client], None],
        faults: BusFaults,
    ) -> None:
        self.clients: list[Client] = []
        self.faults = faults
        self.gone = gone
        self._service = service
        self._serve = serve
        self._greeted = 0

    def welcome(self) -> Client:
        """Return the protocol of a new connection."""
        self._greeted += 1
        return Client(self, self._greeted)

    def hear(self, client: Client, message: Message) -> None:
        """Reply to a call; ignore anything else that a client sends."""
        if message.message_type is not MessageType.METHOD_CALL:
            return
        try:
            if message.destination == BUS_NAME:
                reply: Message | None = self._answer(client, message)
            elif not self.faults.absent and message.destination in (self._service, SERVICE_ADDRESS):
                reply = self._serve(client, message)
            else:
                raise CallError(  # noqa: TRY301
                    f"{BUS_ERROR}.ServiceUnknown",
                    f"The name {message.destination} was not provided by any .service files",
                )
        except CallError as error:
            reply = Message.new_error(message, error.name, error.text)
        if reply is not None:
            self.reply(client, message, reply)

    def reply(self, client: Client, call: Message, reply: Message) -> None:
        """Send a reply, now or later, unless the caller wants none."""
        if not call.flags.value & MessageFlag.NO_REPLY_EXPECTED.value and client in self.clients:
            reply.destination = client.name
            client.send(reply, BUS_NAME if call.destination == BUS_NAME else SERVICE_ADDRESS)

    def spread(self, signal: Message) -> None:
        """Send a signal of the service to every client whose rules match."""
        names = (self._service, SERVICE_ADDRESS)
        for client in self.clients:
            if any(rule.fits(signal, names) for rule in client.rules):
                client.send(signal, SERVICE_ADDRESS)

    def hang_up(self) -> None:
        """Close every connection."""
        for client in list(self.clients):
            client.hang_up()

    def _answer(self, client: Client, call: Message) -> Message:
        body = call.body
        match call.member:
            case "Hello":
                return Message.new_method_return(call, "s", [client.name])
            case "AddMatch":
                client.rules.append(MatchRule.parse(body[0]))
            case "RemoveMatch":
                rule = MatchRule.parse(body[0])
                if rule not in client.rules:
                    raise CallError(f"{BUS_ERROR}.MatchRuleNotFound", "The given match rule wasn't found")
                client.rules.remove(rule)
            case "GetNameOwner":
                owner = self._owners().get(body[0])
                if owner is None:
                    raise CallError(
                        f"{BUS_ERROR}.NameHasNoOwner",
                        f"Could not get owner of name '{body[0]}': no such name",
                    )
                return Message.new_method_return(call, "s", [owner])
            case "NameHasOwner":
                return Message.new_method_return(call, "b", [body[0] in self._owners()])
            case "ListNames":
                return Message.new_method_return(call, "as", [list(self._owners())])
            case "GetId":
                return Message.new_method_return(call, "s", [GUID])
            case "RequestName" | "ReleaseName":
                return Message.new_method_return(call, "u", [1])
            case _:
                raise unknown_method(call)
        return Message.new_method_return(call)

    def _owners(self) -> dict[str, str]:
        """Return every name on the bus and its owner."""
        owners = {client.name: client.name for client in self.clients} | {BUS_NAME: BUS_NAME}
        return owners if self.faults.absent else owners | {self._service: SERVICE_ADDRESS}


def unknown_method(call: Message, what: str = "Method") -> CallError:
    """Return the error that libdbus gives for a method or an object that does not exist."""
    return CallError(
        f"{BUS_ERROR}.Unknown{what}",
        f'Method "{call.member}" with signature "{call.signature}" '
        f'on interface "{call.interface}" doesn\'t exist\n',
    )
