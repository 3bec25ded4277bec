"""Parses one command typed as words, for ``send`` and ``listen --send``."""

from contextlib import suppress
from typing import NamedTuple

from sphero_probe.catalogue import lookup, rows_of
from sphero_probe.catalogue.model import Kind, Robot
from sphero_probe.catalogue.naming import command_id, device_id, pair
from sphero_probe.catalogue.payload.typed import typed_arguments
from sphero_probe.cli.messages import say
from sphero_probe.cli.parse import hex_bytes, is_hex
from sphero_probe.errors import UsageError
from sphero_probe.protocol.packets import Generation
from sphero_probe.reports.phrases import arguments as arguments_in_words


class TypedCommand(NamedTuple):
    """A command as it was typed.

    Attributes:
        generation: the protocol whose names are used.
        ids: DID and CID.
        words: its arguments.
    """

    generation: Generation
    ids: tuple[int, int]
    words: tuple[str, ...]

    def check(self) -> None:
        """Check the arguments before the robot's model is known.

        Raises:
            UsageError: they are wrong for every robot that the catalogue has.
        """
        if len({row.request for row in rows_of(self.generation, *self.ids)}) <= 1:
            self._read(None)

    def payload(self, robot: Robot | None) -> bytes | None:
        """Return the argument bytes for a robot, None where no arguments are given.

        Words that are hex are bytes, unless only their values fit the layout; a note says so then.

        Args:
            robot: the model, None if it is not known.

        Raises:
            UsageError: the arguments are wrong.
        """
        payload, note = self._read(robot)
        if note:
            say(note)
        return payload

    def _read(self, robot: Robot | None) -> tuple[bytes | None, str]:
        """Return the argument bytes, and a note about how they were read."""
        if not self.words:
            return None, ""
        row = lookup(self.generation, *self.ids, robot)
        layout = row.request if row and row.kind is Kind.COMMAND else None
        if all(is_hex(word) for word in self.words):
            payload = hex_bytes(" ".join(self.words), "payload")
            if row and layout and len(self.words) > 1 and not layout.accepts(len(payload)):
                with suppress(UsageError):
                    typed = typed_arguments(layout, self.words, row.name)
                    said = arguments_in_words({"arguments": layout.decode(typed).fields})
                    return (
                        typed,
                        f"note: read as {said}; write bytes in one word to send them as they are",
                    )
            return payload, ""
        if row is None or layout is None:
            raise UsageError(
                f"the arguments of 0x{self.ids[0]:02x}:0x{self.ids[1]:02x} have no names", "write hex bytes"
            )
        return typed_arguments(layout, self.words, row.name), ""


def parse_command(what: tuple[str, ...], generation: Generation) -> TypedCommand:
    """Return a command as it was typed.

    Args:
        what: ``0x13 0x10``, ``0x13:0x10`` or ``NAME``; then its arguments as hex bytes, as values, or as
            ``name=value``.
        generation: the protocol whose names are used.

    Raises:
        UsageError: the words do not begin with a command.
    """
    if not what:
        raise UsageError("no command is given", "for example: sphero-probe send 0x13 0x10")
    first, *rest = what
    if first[:1].isdigit() and ":" not in first:
        if not rest:
            raise UsageError("a DID alone is not a command", "add the CID: sphero-probe send 0x13 0x10")
        second = rest.pop(0)
        ids = device_id(first, generation), command_id(second, generation)
        if any(_may_be_meant_as_hex(number) for number in (first, second)):
            say(f"note: {first} {second} is read as decimal: 0x{ids[0]:02x}:0x{ids[1]:02x}")
    else:
        ids = pair(first, generation)
    return TypedCommand(generation, ids, tuple(rest))


def _may_be_meant_as_hex(number: str) -> bool:
    """Whether a number without 0x is another number in hexadecimal."""
    return number.isdecimal() and len(number) > 1
