"""The report as a page: all that the PDF says, in one file that loads nothing; drawn without complaint."""

import html
import re
import shutil
from dataclasses import replace

import pytest
import synthetic_results as synthetic

from metro.report.batch_report import report_sections
from metro.report.content import Abreast, Paragraph, Picture, Table
from metro.report.page.report_page import report_page

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
EVIL = "<script>alert(1)</script>"


@pytest.fixture(scope="module")
def sections():
    return report_sections(synthetic.results())


@pytest.fixture(scope="module")
def page(sections):
    return report_page(synthetic.results(), sections)


def parts(sections, kind):
    items = [item for section in sections for item in section.items]
    flat = [part for item in items for part in (item.items if isinstance(item, Abreast) else [item])]
    return [part for part in flat if isinstance(part, kind)]


def test_every_paragraph_table_and_figure_of_the_pdf_is_there(sections, page):
    text = html.unescape(page).replace("\u00a0", " ")
    for section in sections:
        assert f"<h2 id={section.title.lower().replace(' ', '-')!r}".replace("'", '"') in page
    for paragraph in parts(sections, Paragraph):
        assert paragraph.text.replace("\u00a0", " ") in text
    for table in parts(sections, Table):
        assert table.caption.replace("\u00a0", " ") in text
    assert page.count("<img ") == len(parts(sections, Picture)) > 5
    assert page.count("<table") == len(parts(sections, Table))


def test_a_figure_is_drawn_once_for_both(sections):
    picture = parts(sections, Picture)[0]
    assert picture.svg is picture.svg


def test_nothing_is_loaded_or_run_and_names_are_text(sections):
    results = synthetic.results()
    manifest = {**results.batch.manifest, "title": EVIL}
    page = report_page(replace(results, batch=replace(results.batch, manifest=manifest)), sections)
    assert "<script" not in page
    assert html.escape(EVIL) in page
    assert "default-src 'none'; img-src data:; style-src" in html.unescape(page)
    assert set(re.findall(r'(?:src|href)="(?!data:|#)([^"]*)"', page)) == {"report.pdf"}


@pytest.mark.skipif(BROWSER is None, reason="no Chromium is installed")
def test_a_browser_draws_every_figure_and_has_nothing_to_complain_of(page, tmp_path):
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    file = tmp_path / "report.html"
    file.write_text(page, encoding="utf-8")
    said = []
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        opened = chromium.new_page(viewport={"width": 420, "height": 900})
        opened.on("console", lambda message: said.append(message.text))
        opened.on("pageerror", lambda error: said.append(str(error)))
        opened.goto(file.as_uri())
        widths = opened.evaluate("[...document.images].map(i => [i.naturalWidth, i.clientWidth])")
        scrolled = opened.evaluate("document.documentElement.scrollWidth")
        chromium.close()
    assert all(natural > 0 and 0 < shown <= 420 for natural, shown in widths)
    assert scrolled <= 420  # only tables scroll, each by itself
    assert said == []
