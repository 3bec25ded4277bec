"""Writes the frame of an HTML page: its style sheet, its script, and a policy that allows nothing else.

The policy names both by their hash, so a browser runs no script that came with untrusted text, loads nothing
from anywhere and sends nothing.
"""

import base64
import hashlib
from collections.abc import Iterable, Sequence
from functools import cache
from html import escape
from importlib.resources import files
from typing import Final, TextIO

from sphero_probe.reports.phrases import shown
from sphero_probe.reports.printable import LIMIT, visible

BYTES_SHOWN: Final = 96
"""Bytes of a frame that are shown."""


def text(value: object, *, limit: int | None = LIMIT) -> str:
    """Return an untrusted value as the text of an element or of an attribute, in ASCII.

    Args:
        value: anything that a row may hold.
        limit: the most characters that are shown, None for all.
    """
    return ascii_only(escape(visible(shown(value), limit=limit)))


def breakable(markup: str) -> str:
    """Return a long name that may be broken after a dot or an underscore."""
    return markup.replace(".", ".<wbr>").replace("_", "_<wbr>")


def ascii_only(markup: str) -> str:
    """Return markup with numeric character references, so that it reads the same in every encoding."""
    return markup.encode("ascii", "xmlcharrefreplace").decode("ascii")


def write_page(
    out: TextIO, title: str, links: Sequence[tuple[str, str]], body: Iterable[str], *, skip_to: int = 0
) -> None:
    """Write a page.

    Args:
        out: where to.
        title: untrusted text.
        links: anchor and untrusted title of each part of the page.
        body: the markup of the parts; each piece is written as it is made.
        skip_to: which link the first stop of the keyboard leads to.
    """
    style, script = _resource("style.css"), _resource("search.js")
    policy = (
        f"default-src 'none'; style-src '{_hash(style)}'; script-src '{_hash(script)}'; "
        "base-uri 'none'; form-action 'none'"
    )
    out.write(
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<meta name="referrer" content="no-referrer">\n'
        f"<title>{text(title)}</title>\n<style>{style}</style>\n</head>\n<body>\n"
    )
    anchor, name = links[skip_to]
    out.write(f'<a class="skip" href="#{anchor}">Skip to: {text(name)}</a>\n')
    out.write(f"<header><h1>{text(title)}</h1></header>\n")
    if len(links) > 1:
        items = "".join(f'<li><a href="#{anchor}">{text(name)}</a></li>' for anchor, name in links)
        out.write(f'<nav aria-label="Contents"><ul>{items}</ul></nav>\n')
    out.write("<main>\n")
    out.writelines(body)
    out.write(f"</main>\n<script>{script}</script>\n</body>\n</html>\n")


def search_box(states: Iterable[tuple[str, str]] = ()) -> str:
    """Return the search field, which only the script shows.

    Args:
        states: key and label of each state that can be hidden.
    """
    boxes = "".join(
        f'<label><input type="checkbox" value="{key}" checked> {label}</label>' for key, label in states
    )
    chosen = f"<fieldset><legend>Show</legend>{boxes}</fieldset>" if boxes else ""
    return (
        '<search class="search" id="search" hidden><label for="q">Search </label>'
        '<input type="search" id="q" placeholder="name, 0x13:0x10, bytes" autocomplete="off">'
        f'<output id="found" for="q" aria-live="polite"></output>{chosen}</search>\n'
    )


@cache
def _resource(name: str) -> str:
    return files(__package__).joinpath(name).read_text("utf-8")


def _hash(content: str) -> str:
    """Return the hash of an inline element as a Content-Security-Policy names it."""
    return "sha256-" + base64.b64encode(hashlib.sha256(content.encode()).digest()).decode()
