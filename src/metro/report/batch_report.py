"""The report of one batch: its sections in their order, and the PDF of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from metro import __version__
from metro.report.content import Item, Paragraph, Picture, Section
from metro.report.document import Cover, compile_pdf
from metro.report.results import Results
from metro.report.sections.areal import areal
from metro.report.sections.calibration import calibration
from metro.report.sections.causes import upstream, with_causes
from metro.report.sections.comparison import comparison
from metro.report.sections.contradictions import with_contradictions
from metro.report.sections.decisions import decisions, with_decisions
from metro.report.sections.identification import identification
from metro.report.sections.levelling import levelling
from metro.report.sections.loop import loop
from metro.report.sections.poses import poses
from metro.report.sections.provenance import provenance
from metro.report.sections.published import published
from metro.report.sections.quality import quality, with_flags
from metro.report.sections.robot import robot
from metro.report.sections.setup import setup
from metro.report.sections.study import study
from metro.report.sections.summary import summary
from metro.report.sections.surface import flatness
from metro.report.sections.terms import terms
from metro.report.sections.texture import texture


def report_pdf(results: Results, sections: Sequence[Section]) -> bytes:
    """Return the report as a PDF; the same bytes for the same results."""
    cover = Cover(results.title, results.batch.name, f"metro {__version__}")
    return compile_pdf(cover, sections)


def report_sections(results: Results) -> list[Section]:
    """Return the sections that a batch's report has."""
    first = with_causes(with_decisions(summary(results), results), results)
    sections = [
        with_contradictions(with_flags(first, results), results),
        decisions(results),
        setup(results),
        quality(results),
        published(results),
        calibration(results),
        identification(results),
        flatness(results),
        levelling(results),
        texture(results),
        areal(results),
        poses(results),
        robot(results),
        study(results),
        comparison(results),
        upstream(results),
        loop(results),
        terms(results),
        provenance(results),
    ]
    return drawn_once([section for section in sections if section is not None])


def drawn_once(sections: Sequence[Section]) -> list[Section]:
    """Replace each figure that an earlier section has already by a word on where it is."""
    first: dict[bytes, str] = {}

    def shown(item: Item, title: str) -> Item:
        if not isinstance(item, Picture) or first.setdefault(item.svg, title) == title:
            return item
        return Paragraph(f"Drawn in section “{first[item.svg]}”: {item.caption}", "note")

    return [replace(one, items=[shown(item, one.title) for item in one.items]) for one in sections]
