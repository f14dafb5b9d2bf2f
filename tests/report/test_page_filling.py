"""No page of a report but the last is more than a third empty, whatever the report holds."""

import random
from pathlib import Path

import pytest
import synthetic_results as synthetic
from page_filling import empty_shares, least_letters

from metro.report.batch_report import report_pdf, report_sections
from metro.report.content import Abreast, Bullets, Heading, Paragraph, Picture, Section, Table
from metro.report.document import Cover, compile_pdf, svg_height

MOST = 1 / 3  # of a page that may be empty
WORDS = "A sentence of the report says what was found in the runs that were held out. "
MADE = sorted((Path(__file__).parents[2] / "reports").glob("*/report.pdf"))


def drawn(width, height):
    """Return a figure of some size."""
    figure = Picture(None, WORDS, "a box")
    box = f'<rect x="1" y="1" width="{width - 2}" height="{height - 2}" fill="#cde"/>'
    size = f'width="{width}pt" height="{height}pt" viewBox="0 0 {width} {height}"'
    figure.__dict__["svg"] = f'<svg xmlns="http://www.w3.org/2000/svg" {size}>{box}</svg>'.encode()
    return figure


def some_items(rng):
    """Return one of the things that reports consist of, with a heading where reports have one."""
    rows = [["x", WORDS * rng.randint(1, 3), "1.0"] for _ in range(rng.randint(1, 30))]
    half = [drawn(234, rng.randint(90, 150)) for _ in range(2)]
    return rng.choice(
        [
            [Paragraph(WORDS * rng.randint(1, 6), rng.choice(["plain", "verdict", "note", "warning"]))],
            [Bullets([WORDS * rng.randint(1, 3)] * rng.randint(1, 5))],
            [Table(["a", "b", "c"], rows, "A table.", [1, 3, 1], small=rng.random() < 0.5)],
            [Heading("Two figures"), Abreast(half)],
            [Heading("A figure"), drawn(482, rng.randint(90, 500))],
            [drawn(482, rng.randint(90, 500))],
        ]
    )


def some_sections(seed):
    rng = random.Random(seed)
    end = Section("Provenance", [Bullets([WORDS * 2] * 40)])  # as reports end: with text
    parts = [[item for _ in range(rng.randint(3, 8)) for item in some_items(rng)] for _ in range(6)]
    return [*(Section(f"Section {i}", items) for i, items in enumerate(parts)), end]


@pytest.mark.parametrize("seed", range(12))
def test_whatever_a_report_holds_its_pages_are_full(seed):
    pdf = compile_pdf(Cover("A title", "batch", "metro"), some_sections(seed))
    *pages, _ = empty_shares(pdf)
    assert pages
    assert max(pages) < MOST


def test_a_page_that_is_left_after_two_lines_counts_as_empty():
    pdf = compile_pdf(
        Cover("A title", "batch", "metro"),
        [Section("First", [Paragraph(WORDS)]), Section("Second", [Paragraph(WORDS)], page=True)],
    )
    assert min(empty_shares(pdf)) > 0.8


def test_a_last_page_of_a_few_lines_is_saved_by_setting_all_a_little_closer():
    def pages(count):
        return len(empty_shares(compile_pdf(Cover("A title", "batch", "metro"), [section(count)])))

    def section(count):
        return Section("First", [Paragraph(WORDS * 2) for _ in range(count)])

    two = next(count for count in range(10, 80) if pages(count) == 2)
    *_, last = empty_shares(compile_pdf(Cover("A title", "batch", "metro"), [section(two)]))
    assert last < 0.9  # what is beyond one page is not a few lines


def test_the_letters_of_a_report_have_eight_points_at_least():
    results = synthetic.results()
    pdf = report_pdf(results, report_sections(results))
    assert max(empty_shares(pdf)[:-1]) < MOST
    assert least_letters(pdf) >= 7.99


@pytest.mark.skipif(not MADE, reason="no report was made in this checkout")
def test_the_reports_of_this_checkout_have_full_pages_and_letters_of_eight_points():
    wanting = {
        path.parent.name: [
            f"page {i + 1}: {share:.2f}" for i, share in enumerate(shares[:-1]) if share >= MOST
        ]
        for path in MADE
        if (shares := empty_shares(path))
        and (max(shares[:-1], default=0) >= MOST or least_letters(path) < 7.99)
    }
    assert wanting == {}


def test_a_figure_states_its_height():
    assert svg_height(drawn(482, 144).svg) == 144.0
    with pytest.raises(ValueError, match="height in points"):
        svg_height(b'<svg height="10px"/>')
