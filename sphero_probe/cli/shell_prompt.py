"""The prompt of ``shell``: history, completion, and notifications above it. Needs the extra ``shell``."""

import os
from collections.abc import Iterable
from contextlib import suppress

from click.shell_completion import ShellComplete
from prompt_toolkit import PromptSession
from prompt_toolkit.completion import CompleteEvent, Completer, Completion
from prompt_toolkit.document import Document
from prompt_toolkit.history import FileHistory, History, InMemoryHistory
from prompt_toolkit.patch_stdout import patch_stdout

from sphero_probe.cli import COMPLETE_VARIABLE, NAME
from sphero_probe.cli.connect import connect
from sphero_probe.cli.group import group
from sphero_probe.cli.messages import say
from sphero_probe.cli.shared_connection import SharedConnection
from sphero_probe.cli.values import ConnectOptions
from sphero_probe.errors import SpheroProbeError
from sphero_probe.link.exchange import Unsolicited
from sphero_probe.link.policy import Consent
from sphero_probe.link.unsolicited import describe_unsolicited
from sphero_probe.reports.phrases import packet, pair, shown
from sphero_probe.runs.folders import state_folder


class ShellPrompt:
    """Asks for lines; while it waits, it keeps listening to the robot."""

    def __init__(self, shared: SharedConnection, connecting: ConnectOptions) -> None:
        self._shared = shared
        self._connecting = connecting
        self._prompts: PromptSession[str] = PromptSession(
            history=_history(), completer=GroupCompleter(), complete_while_typing=False
        )

    def ask(self) -> str:
        """Return the next line.

        Raises:
            EOFError: Ctrl-D.
            KeyboardInterrupt: Ctrl-C.
        """
        lines: list[str] = []

        async def wait() -> None:
            try:
                async with connect(self._connecting, Consent()) as session:
                    with patch_stdout(), describe_unsolicited(session.link, _print_packet):
                        lines.append(await self._prompts.prompt_async(f"{session.connection.name}> "))
            except SpheroProbeError as error:
                say(f"sphero-probe: {error}")
                with patch_stdout():
                    lines.append(await self._prompts.prompt_async("not connected> "))

        self._shared.run(wait())
        return lines[0]


class GroupCompleter(Completer):
    """Offers what the shells offer: commands, options, names of the catalogue."""

    def get_completions(self, document: Document, complete_event: CompleteEvent) -> Iterable[Completion]:
        """Yield the candidates for the word before the cursor."""
        del complete_event
        *words, begun = document.text_before_cursor.split(" ")
        complete = ShellComplete(group, {}, NAME, COMPLETE_VARIABLE)
        with suppress(SpheroProbeError):
            for item in complete.get_completions([word for word in words if word], begun):
                yield Completion(item.value, -len(begun), display_meta=item.help or "")


def _history() -> History:
    """Return the history of earlier shells, an empty one where it cannot be kept."""
    try:
        folder = state_folder()
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except (OSError, RuntimeError):
        return InMemoryHistory()
    file = folder / "shell_history"
    return FileHistory(os.fspath(file))


def _print_packet(_: Unsolicited, described: dict[str, object]) -> None:
    """Print a notification above the prompt."""
    name = shown(described.get("name")) or pair(described)
    say(f"{name}: {packet(described)}")
