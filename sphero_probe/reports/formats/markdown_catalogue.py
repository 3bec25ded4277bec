"""The catalogue in Markdown: a reference with a table for each device."""

from functools import partial
from typing import Final, TextIO

from sphero_probe.reports import phrases
from sphero_probe.reports.markdown_text import MarkdownWriter, code, safe
from sphero_probe.reports.phrases import Data, hex_id, shown
from sphero_probe.reports.registry import Style
from sphero_probe.reports.rows import Row
from sphero_probe.reports.views import View

_TITLES: Final = ("DID:CID", "Name", "Risk", "Request", "Response", "Robots: nodes", "Known from", "Remarks")


class MarkdownCatalogue:
    """Collects the commands and writes a table for each device at the end."""

    def __init__(self, out: TextIO, view: View, style: Style) -> None:
        self._writer = MarkdownWriter(out)
        self._empty = view.empty
        self._devices: dict[tuple[str, str, str], list[tuple[str, ...]]] = {}
        self._safe = partial(safe, limit=None, unicode=style.unicode)
        self._code = partial(code, limit=None, unicode=style.unicode)

    def add(self, row: Row) -> None:
        """Keep a command."""
        if row.type != "command":
            return
        data = row.data
        device = shown(data.get("name")).partition(".")[0]
        key = (shown(data.get("generation")).upper(), hex_id(data.get("did")), device)
        self._devices.setdefault(key, []).append(
            (
                self._code(phrases.pair(data)),
                self._code(shown(data.get("name"))),
                self._safe(phrases.role(data)),
                "" if data.get("kind") == "notification" else self._layout(data.get("request")),
                self._layout(data.get("response")),
                self._code(phrases.robots(data.get("robots"))),
                self._safe(shown(data.get("sources"))),
                self._safe(_remarks(data)),
            )
        )

    def close(self) -> None:
        """Write the page."""
        self._writer.heading(1, "Known commands of Sphero robots")
        if not self._devices:
            self._writer.paragraph(self._empty)
        for (generation, did, device), rows in self._devices.items():
            title = " ".join(filter(None, (self._safe(generation), did, self._safe(device))))
            self._writer.heading(2, title)
            self._writer.table(_TITLES, rows)

    def _layout(self, value: object) -> str:
        text = phrases.layout(value)
        return text if text in ("unknown", "nothing") else self._code(text)


def _remarks(data: Data) -> str:
    also = f"also called {shown(data.get('aliases'))}" if data.get("aliases") else ""
    enabled = f"enabled by {phrases.switch(data)}" if phrases.switch(data) else ""
    return "; ".join(filter(None, (shown(data.get("note")), phrases.catalogue_remark(data), also, enabled)))
