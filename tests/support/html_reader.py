"""Reads an HTML page with the parser of the standard library."""

import re
from html.parser import HTMLParser
from typing import NamedTuple

VOID = frozenset(("meta", "input", "br", "wbr", "img", "link", "hr"))
ALLOWED = frozenset(
    [
        "html",
        "head",
        "meta",
        "title",
        "style",
        "body",
        "a",
        "header",
        "h1",
        "h2",
        "h3",
        "h4",
        "nav",
        "ul",
        "li",
        "main",
        "section",
        "p",
        "strong",
        "dl",
        "dt",
        "dd",
        "table",
        "caption",
        "thead",
        "tbody",
        "tr",
        "th",
        "td",
        "span",
        "div",
        "figure",
        "figcaption",
        "svg",
        "text",
        "path",
        "rect",
        "article",
        "search",
        "label",
        "input",
        "output",
        "fieldset",
        "legend",
        "code",
        "small",
        "wbr",
        "script",
    ]
)
"""Every element that a page may have."""
SVG_SHAPES = frozenset(("path", "rect"))


class Element(NamedTuple):
    """One element: its tag, its attributes, and its text with that of the elements in it."""

    tag: str
    attributes: dict[str, str]
    text: str

    @property
    def classes(self) -> frozenset[str]:
        return frozenset(self.attributes.get("class", "").split())


class Page(HTMLParser):
    """Reads a page; raises AssertionError where it is not well formed."""

    def __init__(self, markup: str) -> None:
        super().__init__(convert_charrefs=True)
        self.elements: list[Element] = []
        self.shape: list[str] = []
        self._open: list[tuple[str, dict[str, str], list[str]]] = []
        self.feed(markup)
        self.close()
        assert not self._open, self._open[-1][0]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        names = [name for name, _ in attrs]
        assert len(names) == len(set(names)), tag
        held = {name: value or "" for name, value in attrs}
        self.shape.append(f"{tag} {' '.join(names)}")
        if tag in VOID:
            self.elements.append(Element(tag, held, ""))
        else:
            self._open.append((tag, held, []))

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.handle_endtag(tag)

    def handle_endtag(self, tag: str) -> None:
        opened, attributes, texts = self._open.pop()
        assert opened == tag, f"</{tag}> closes <{opened}>"
        text = "".join(texts)
        self.elements.append(Element(tag, attributes, text))
        if self._open:
            self._open[-1][2].append(text)

    def handle_data(self, data: str) -> None:
        if self._open:
            self._open[-1][2].append(data)

    def all(self, tag: str, kind: str = "") -> list[Element]:
        """Return the elements with a tag and a class, in the order in which they end."""
        return [one for one in self.elements if one.tag == tag and (not kind or kind in one.classes)]

    def one(self, tag: str, kind: str = "") -> Element:
        """Return the only such element."""
        (element,) = self.all(tag, kind)
        return element

    @property
    def text(self) -> str:
        """The text of the page, without its style sheet and its script."""
        return " ".join(one.text for one in self.elements if one.tag in ("header", "nav", "main"))


def assert_safe(page: Page) -> None:
    """Check that a page loads nothing, runs nothing of its own text, and that its links lead somewhere."""
    ids = [one.attributes["id"] for one in page.elements if "id" in one.attributes]
    assert len(ids) == len(set(ids))
    for element in page.elements:
        assert element.tag in ALLOWED, element.tag
        for name, value in element.attributes.items():
            assert not name.startswith("on"), (element.tag, name)
            assert name not in ("src", "srcset", "style", "action", "formaction", "data", "xlink:href"), name
            if name == "href":
                assert re.fullmatch(r"#[a-z0-9-]+", value), value
                assert value[1:] in ids, value
            if name in ("for", "aria-labelledby"):
                assert value in ids, value
    assert len(page.all("script")) == len(page.all("style")) == 1
    assert "url(" not in page.one("style").text
    assert "@import" not in page.one("style").text
