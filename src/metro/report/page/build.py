"""The page: the content of the campaign's PDF, then each batch in a section that unfolds, with its plots."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from urllib.parse import quote

from metro import __version__
from metro.report.campaign import TITLE
from metro.report.content import Section
from metro.report.page.batch import anchor, batch_section
from metro.report.page.markup import Html, items_of, tag
from metro.report.results import Results

SCRIPTS = ("kit.js", "panel.js", "chart.js", "face.js", "tables.js", "page.js")
BATCHES = "Batches"
WHOLE, PER_BATCH = 4_000_000, 400_000  # bytes that the data of all plots, and those of one batch, may take


def campaign_page(sections: Sequence[Section], batches: Iterable[Results], links: Mapping[str, str]) -> str:
    """Return the campaign as one HTML file that needs no other file; the same text for the same results.

    Parameters
    ----------
    sections : of the summary, see :func:`metro.report.campaign.campaign_sections`.
    batches : with the tables of the campaign stage; read one by one, none is kept once written.
    links : name of every batch → path to its report, relative to the page.
    """
    budget = min(PER_BATCH, WHOLE // max(1, len(links)))
    anchors = {name: f"#{quote(anchor(name))}" for name in links}
    summary = [_section(s.title, items_of(s.items, anchors)) for s in sections]
    unfolding = [batch_section(results, links[results.batch.name], budget) for results in batches]
    buttons = [
        tag("button", "Unfold all", type="button", data_fold="open"),
        tag("button", "Fold all", type="button", data_fold="close"),
    ]
    without = tag("noscript", tag("p", "The plots need JavaScript; all else is here without it."))
    head = tag("p", *buttons, class_="tools")
    parts = [*summary, _section(BATCHES, head, without, *unfolding)]
    below = f"{len(links)} batches · metro {__version__} · "
    header = tag(
        "header",
        tag("h1", TITLE),
        tag("p", below, tag("a", "the same as PDF", href="summary.pdf")),
        _contents([*(s.title for s in sections), BATCHES]),
    )
    return _document(TITLE, header, parts)


def _section(title: str, *children: str) -> Html:
    heading = tag("h2", title, id=_named(title), tabindex="-1")
    return tag("section", heading, *children, aria_label=title)


def _named(title: str) -> str:
    return title.lower().replace(" ", "-")


def _contents(titles: Sequence[str]) -> Html:
    """Link the sections from the top of the page."""
    links = [tag("li", tag("a", title, href=f"#{quote(_named(title))}")) for title in titles]
    return tag("nav", tag("ul", *links), aria_label="Sections")


def _document(title: str, header: Html, parts: Sequence[Html]) -> str:
    """Put the parts into a page that may load nothing, and run only its own script and style."""
    assets = files("metro.report.page") / "assets"
    script = "".join((assets / name).read_text(encoding="utf-8") for name in SCRIPTS)
    style = (assets / "page.css").read_text(encoding="utf-8")
    policy = f"default-src 'none'; img-src data:; script-src {_hashed(script)}; style-src {_hashed(style)}"
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", http_equiv="Content-Security-Policy", content=policy),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("title", title),
        tag("style", Html(style)),
    )
    skips = [
        tag("a", f"To the {name}", href=f"#{target}", class_="skip")
        for name, target in (("verdicts", "main"), ("batches", _named(BATCHES)))
    ]
    body = tag(
        "body",
        *skips,
        header,
        tag("main", *parts, id="main", tabindex="-1"),
        tag("script", Html(script)),
        id="top",
    )
    return f"<!DOCTYPE html>\n{tag('html', head, body, lang='en')}\n"


def _hashed(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
