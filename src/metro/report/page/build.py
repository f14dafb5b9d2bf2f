"""The page: the content of the campaign's PDF, then each batch in a section that unfolds, with its plots."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from urllib.parse import quote

from metro import __version__
from metro.batch.capabilities import plural
from metro.report.campaign import TITLE
from metro.report.content import Section
from metro.report.page.batch import anchor, batch_section
from metro.report.page.compare import compare_section, quantities
from metro.report.page.frame import contents, document, named, section
from metro.report.page.markup import items_of, tag
from metro.report.results import Results

SCRIPTS = (
    *("kit.js", "saving.js", "panel.js", "beside.js", "chart.js", "face.js", "cutting.js", "trial.js"),
    *("tables.js", "compare.js", "trends.js", "search.js", "page.js"),
)
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
    summary = [section(s.title, items_of(s.items, anchors)) for s in sections]
    unfolding, compared = [], []
    for results in batches:
        unfolding.append(batch_section(results, links[results.batch.name], budget))
        compared.append((results.batch, quantities(results)))
    comparing = compare_section(compared)
    buttons = [
        tag("button", "Unfold all", type="button", data_fold="open"),
        tag("button", "Fold all", type="button", data_fold="close"),
    ]
    without = tag("noscript", tag("p", "The plots need JavaScript; all else is here without it."))
    head = tag("p", *buttons, class_="tools")
    parts = [*summary, *(part for _, part in comparing), section(BATCHES, head, without, *unfolding)]
    below = f"{plural(len(links), 'batch')} · metro {__version__} · "
    header = tag(
        "header",
        tag("h1", TITLE),
        tag("p", below, tag("a", "the same as PDF", href="summary.pdf")),
        contents([*(s.title for s in sections), *(name for name, _ in comparing), BATCHES]),
    )
    skips = {"verdicts": "main", "batches": named(BATCHES)}
    return document(TITLE, header, parts, skips, SCRIPTS)
