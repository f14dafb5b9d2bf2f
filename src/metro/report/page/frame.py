"""The frame of a page: one HTML file that needs no other file and may load none."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Mapping, Sequence
from importlib.resources import files
from urllib.parse import quote

from metro.report.page.markup import Html, tag


def section(title: str, *children: str) -> Html:
    """Return a titled part of a page."""
    heading = tag("h2", title, id=named(title), tabindex="-1")
    return tag("section", heading, *children, aria_label=title)


def named(title: str) -> str:
    """Return the id of a titled part."""
    return title.lower().replace(" ", "-")


def contents(titles: Sequence[str]) -> Html:
    """Link the sections from the top of the page."""
    links = [tag("li", tag("a", title, href=f"#{quote(named(title))}")) for title in titles]
    return tag("nav", tag("ul", *links), aria_label="Sections")


def document(
    title: str, header: Html, parts: Sequence[Html], skips: Mapping[str, str], scripts: Sequence[str] = ()
) -> str:
    """Put the parts into a page that may load nothing, and run only its own script and style.

    Parameters
    ----------
    skips : what a keyboard may skip to, by its id. scripts : names of the page's own scripts.
    """
    assets = files("metro.report.page") / "assets"
    script = "".join((assets / name).read_text(encoding="utf-8") for name in scripts)
    style = (assets / "page.css").read_text(encoding="utf-8")
    allowed = f"script-src {_hashed(script)}; " if scripts else ""
    policy = f"default-src 'none'; img-src data:; {allowed}style-src {_hashed(style)}"
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", http_equiv="Content-Security-Policy", content=policy),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("title", title),
        tag("style", Html(style)),
    )
    links = [tag("a", f"To the {name}", href=f"#{target}", class_="skip") for name, target in skips.items()]
    run = [tag("script", Html(script))] if scripts else []
    body = tag("body", *links, header, tag("main", *parts, id="main", tabindex="-1"), *run, id="top")
    return f"<!DOCTYPE html>\n{tag('html', head, body, lang='en')}\n"


def _hashed(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
