"""HTML that escapes all text it is given, and the report's items written in it."""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Mapping, Sequence
from typing import Any

from metro.report.content import Abreast, Bullets, Facts, Heading, Item, Paragraph, Picture, Simple, Table
from metro.report.document import UNIT

SHORT = 26  # most characters of a cell that is not broken into lines
VOID = {"meta", "img", "hr"}
# A sign as well as a word and a colour, so that the verdicts are distinct in grey print, too.
SIGNS = {
    "clean": "✓",
    "explained": "✓",
    "partly explained": "◐",
    "undetermined": "?",
    "unexplained": "!",
    "insufficient data": "–",
}


class Html(str):
    """Text that is markup already; any other text is escaped when it is put into markup."""

    __slots__ = ()


def tag(name: str, /, *children: str, **attributes: str) -> Html:
    """Return an element; ``class_`` is the attribute ``class``, and ``_`` in a name means a hyphen."""
    said = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{html.escape(value)}"' for key, value in attributes.items()
    )
    inside = joined(children)
    return Html(f"<{name}{said}>" if name in VOID else f"<{name}{said}>{inside}</{name}>")


def joined(children: Sequence[str]) -> Html:
    """Join texts, each escaped unless it is markup."""
    return Html("".join(each if isinstance(each, Html) else html.escape(each) for each in children))


def embedded(content: Any) -> Html:
    """Return JSON for a ``script`` element: nothing in it can close the element or open a comment."""
    text = json.dumps(content, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return Html(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))


def badge(status: str) -> Html:
    """Return a verdict's word with its sign."""
    sign = tag("span", SIGNS.get(status, "–"), aria_hidden="true")
    return tag("span", sign, f" {status}", class_=f"badge {status.replace(' ', '-')}")


def items_of(items: Sequence[Item], links: Mapping[str, str], level: int = 3) -> Html:
    """Write paragraphs, lists, tables and figures of a report.

    Parameters
    ----------
    links : name of a batch → target of its link, in tables and lists. level : of headings among them.
    """
    flat = [part for item in items for part in (item.items if isinstance(item, Abreast) else [item])]
    return joined([_item(item, links, level) for item in flat])


def _item(item: Simple, links: Mapping[str, str], level: int) -> Html:
    match item:
        case Paragraph():
            return tag("p", _unbroken(item.text), class_=item.look)
        case Bullets():
            return tag("ul", *(tag("li", _linked(text, links)) for text in item.items))
        case Heading():
            return tag(f"h{level}", item.text)
        case Facts():
            pairs = [tag("div", tag("dt", a), tag("dd", b, " ", tag("small", c))) for a, b, c in item.items]
            return tag("dl", *pairs)
        case Picture():
            source = "data:image/svg+xml;base64," + base64.b64encode(item.svg).decode()
            return tag(
                "figure",
                tag("img", src=source, alt=item.alt),
                tag("figcaption", item.caption),
                class_="still",
            )
        case Table():
            return _table(item, links)


def _table(table: Table, links: Mapping[str, str]) -> Html:
    head = tag("tr", *(tag("th", name, scope="col") for name in table.header))
    rows = [
        tag("tr", *(_cell(n, c, links) for n, c in zip(table.header, row, strict=True))) for row in table.rows
    ]
    caption = tag("caption", table.caption)
    verdicts = {"data_verdicts": ""} if {"batch", "verdict"} <= set(table.header) else {}
    inside = tag("table", caption, tag("thead", head), tag("tbody", *rows), **verdicts)
    return tag("div", inside, class_="scroll", role="group", aria_label=table.caption)


def _cell(column: str, text: str, links: Mapping[str, str]) -> Html:
    if column == "verdict":
        return tag("td", badge(text))
    if column in ("batch", "batches"):
        return tag("td", _linked(text, links), class_="short" if column == "batch" else "long")
    return (
        tag("td", text, class_="short") if len(text) <= SHORT else tag("td", _unbroken(text), class_="long")
    )


def _linked(text: str, links: Mapping[str, str]) -> Html:
    """Link the names of batches in a list, or at the start of a sentence, to the batches."""
    names = text.split(", ")
    parts = [tag("a", name, href=links[name]) if name in links else _unbroken(name) for name in names]
    return joined([joined([", ", part]) if i else part for i, part in enumerate(parts)])


def _unbroken(text: str) -> str:
    """Keep a value, its interval and its unit on one line."""
    return UNIT.sub("\u00a0", text.replace(" ± ", "\u00a0±\u00a0"))
