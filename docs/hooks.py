"""What mkdocs fills in while it builds: the reference of the command line, and the public modules of the API.

Nothing of this is written by hand, so it cannot differ from the code: help texts come from the click
commands, docstrings through mkdocstrings, and exit codes from the README, whose table a test compares with
the exceptions.
"""

import re
from collections.abc import Callable, Iterator
from html import escape
from importlib import import_module
from importlib.metadata import entry_points
from importlib.util import find_spec
from inspect import cleandoc
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from sphero_probe.reports import views

if TYPE_CHECKING:
    from mkdocs.structure.pages import Page

ROOT: Final = Path(__file__).resolve().parent.parent
NAME: Final = "sphero-probe"
PUBLIC_MODULES: Final = (
    "sphero_probe.api.connecting",
    "sphero_probe.api.robot",
    "sphero_probe.api.answer",
    "sphero_probe.api.running",
    "sphero_probe.api.result",
    "sphero_probe.api.notifications",
    "sphero_probe.api.decoding",
    "sphero_probe.sync",
    "sphero_probe.pytest_plugin",
    "sphero_probe.pytest_plugin.fake",
)
"""What scripts and tests import; documented from the day it exists."""
_SPECIAL: Final = re.compile(r"([\\`*_{}\[\]])")
_PREFORMATTED: Final = "\b"
"""Begins a paragraph of help that click prints as it stands."""
_EXAMPLE: Final = "Example: "


def on_page_markdown(markdown: str, page: "Page", **_: Any) -> str:
    """Fill in what a page marks with ``<!-- name -->`` (an event of mkdocs).

    Args:
        markdown: the page as it is written.
        page: which page it is.
    """
    return fill_in(markdown, page.file.src_uri)


def fill_in(markdown: str, where: str) -> str:
    """Replace the marks of a page by what the code says.

    Raises:
        ValueError: a page that should have a mark lacks it.
    """
    for mark, make in MARKS.get(where, {}).items():
        if mark not in markdown:
            raise ValueError(f"{where} lacks the line {mark}")
        markdown = markdown.replace(mark, make())
    return markdown


def commands() -> str:
    """Return the reference of every command: usage, help, example, options."""
    (script,) = entry_points(group="console_scripts", name=NAME)
    group: click.Group = import_module(script.module).everything
    return "\n".join(_describe(group, click.Context(group, info_name=NAME, **group.context_settings)))


def exit_codes() -> str:
    """Return the README's table of exit codes."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    return readme.split("\n## Exit codes\n")[1].split("\n## ")[0].strip()


def record_columns() -> str:
    """Return a table of the columns of plain and csv output, in their order."""
    columns: dict[str, str] = {}
    for value in vars(views).values():
        if isinstance(value, views.View):
            columns[value.type] = ", ".join(f"`{column.key}`" for column in value.record_columns)
    return "\n".join(
        ("| record | columns |", "|---|---|", *(f"| {kind} | {said} |" for kind, said in columns.items()))
    )


def public_modules() -> str:
    """Return a mkdocstrings directive for each public module that exists."""
    return "\n\n".join(f"::: {name}" for name in PUBLIC_MODULES if find_spec(name))


MARKS: Final[dict[str, dict[str, Callable[[], str]]]] = {
    "cli.md": {
        "<!-- commands -->": commands,
        "<!-- record columns -->": record_columns,
        "<!-- exit codes -->": exit_codes,
    },
    "api.md": {"<!-- public modules -->": public_modules},
}
"""Page -> mark -> what takes its place."""


def _describe(command: click.Command, context: click.Context) -> Iterator[str]:
    yield f"\n## {context.command_path}\n"
    yield f"```\n{' '.join((context.command_path, *command.collect_usage_pieces(context)))}\n```\n"
    for paragraph in cleandoc(command.help or "").split("\n\n"):
        yield _paragraph(paragraph) + "\n"
    records = [option.get_help_record(context) for option in command.get_params(context)]
    if rows := [record for record in records if record]:
        yield "| option | meaning |\n|---|---|"
        yield from (f"| {_code(words)} | {_text(said)} |" for words, said in rows)
    for name, member in command.commands.items() if isinstance(command, click.Group) else ():
        if not member.hidden:
            yield from _describe(member, click.Context(member, info_name=name, parent=context))


def _paragraph(text: str) -> str:
    if text.startswith(_PREFORMATTED):
        return f"```\n{text.removeprefix(_PREFORMATTED).strip()}\n```"
    flat = " ".join(text.split())
    if flat.startswith(_EXAMPLE):
        return f"```console\n$ {flat.removeprefix(_EXAMPLE)}\n```"
    return _text(flat)


def _text(text: str) -> str:
    """Keep Markdown from reading anything into a text."""
    return _SPECIAL.sub(r"\\\1", escape(text, quote=False)).replace("|", "&#124;")


def _code(text: str) -> str:
    """Return a text as code, within a table."""
    return "`" + text.replace("|", r"\|") + "`"
