"""A batch's report as a page: all that is in the PDF, its figures too, for the browser."""

from __future__ import annotations

from collections.abc import Sequence

from metro import __version__
from metro.report.content import Section
from metro.report.page.frame import contents, document, section
from metro.report.page.markup import items_of, tag
from metro.report.results import Results


def report_page(results: Results, sections: Sequence[Section]) -> str:
    """Return the report of a batch as one HTML file that needs no other file."""
    name = results.batch.name
    header = tag(
        "header",
        tag("h1", results.title),
        tag("p", f"{name} · metro {__version__} · ", tag("a", "the same as PDF", href="report.pdf")),
        contents([each.title for each in sections]),
    )
    parts = [section(each.title, items_of(each.items, {})) for each in sections]
    return document(results.title, header, parts, {"report": "main"})
