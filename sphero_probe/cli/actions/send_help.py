"""``send NAME --help``: print what a command takes and answers, with an example and its bytes."""

import click

from sphero_probe.catalogue import lookup
from sphero_probe.catalogue.model import CommandRow, Kind
from sphero_probe.catalogue.naming import pair
from sphero_probe.catalogue.payload.typed import example_words, values_of
from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import UsageError
from sphero_probe.link.policy import Consent, flag_for
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation


def command_help(words: list[str]) -> str | None:
    """Return the help for the command that the first word names, None if it names none.

    Args:
        words: what was typed with ``--help``.
    """
    for generation in (Generation.V2, Generation.V1):
        try:
            row = lookup(generation, *pair(words[0], generation), None) if words else None
        except UsageError:
            continue
        if row and row.kind is Kind.COMMAND:
            return "\n".join(_lines(row))
    return None


def _lines(row: CommandRow) -> list[str]:
    lines = [f"{row.name}  0x{row.did:02x}:0x{row.cid:02x}  {row.generation.value}  risk: {row.risk.word}"]
    lines += [f"  {row.note}"] if row.note else []
    if row.request is None:
        lines.append("Arguments: not known; write them as hex bytes")
    else:
        lines.append("Arguments:" if row.request.text else "Arguments: none")
        lines += [
            f"  {field.name:<20} {field.type:<8} {values_of(field)}{' (may be left out)' * field.optional}"
            for field in row.request.fields
        ]
    lines.append(f"Answer: {'not known' if row.response is None else row.response.text or 'no data'}")
    if row.request is not None:
        words = " ".join(("sphero-probe send", row.name, *example_words(row.request), *_allow(row.risk)))
        command = Command(row.did, row.cid, row.request.zeros())
        frame = CODECS[row.generation].encode_command(command, CODECS[row.generation].sequence_numbers[0])
        lines += [f"Example: {words}", f"Bytes:   {frame.hex(' ')}"]
    return lines


def _allow(risk: Risk) -> list[str]:
    return [] if risk in Consent().allowed else [flag_for(risk)]


def show_command_help(words: list[str]) -> bool:
    """Print the help for the command that the first word names; return whether there is one."""
    text = command_help(words)
    if text is not None:
        click.echo(text)
    return text is not None
