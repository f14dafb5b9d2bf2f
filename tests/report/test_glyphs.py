"""Titles and names in any script: the PDF is made, archival, with the signs or with what they are called."""

import io
import warnings
from pathlib import Path

import pikepdf
import pypdfium2
import pytest

from metro.report import document, glyphs, readable, style
from metro.report.content import Paragraph, Section
from metro.report.document import Cover, compile_pdf

NO_FONTS = ()
TITLES = {
    "Chinese": "测量 of a slot",
    "Japanese": "フライス加工",
    "Korean": "절삭력 측정",
    "Thai": "การวัดแรงตัด",
    "Arabic": "قياس القوة",
    "Hebrew": "מדידת כוח",
    "Devanagari": "बल मापन",
    "emoji": "🚀 force 👨\u200d👩\u200d👧",
    "private": "logo \ue000",
    "marks": "q\u0308\u0323 \u202eabc\u202c",
    "long": "長" * 500,
}


@pytest.fixture(autouse=True)
def _no_fonts(monkeypatch):
    """Let this machine have no fonts, which is what a small container has."""
    monkeypatch.setattr(glyphs, "machine_fonts", lambda: NO_FONTS)
    style._drawable.cache_clear()


def made(title, run="r01"):
    section = Section("Results", [Paragraph(f"{run}: {title}")])
    return compile_pdf(Cover(title, run, "metro"), [section])


@pytest.mark.parametrize("title", TITLES.values(), ids=list(TITLES))
def test_a_report_of_any_title_is_an_archival_and_accessible_pdf_that_knows_the_title_as_written(title):
    with pikepdf.open(io.BytesIO(made(title))) as pdf, pdf.open_metadata() as xmp:
        assert (xmp["pdfaid:part"], xmp["pdfaid:conformance"], xmp["pdfuaid:part"]) == ("2", "A", "1")
        assert xmp["dc:title"] == title


def test_characters_without_a_font_are_called_by_code_point_and_symbols_by_name():
    document = pypdfium2.PdfDocument(made("测量 of a slot 🚀"))
    said = " ".join(page.get_textpage().get_text_range() for page in document)
    assert "[U+6D4B U+91CF] of a slot [rocket]" in said


def test_a_title_in_latin_letters_is_set_once_and_without_a_look_at_the_fonts_of_the_machine(monkeypatch):
    monkeypatch.setattr(document, "found_for", lambda _: pytest.fail("fonts were looked for"))
    assert made("Fräsversuch µ → ≤ Ωж") == made("Fräsversuch µ → ≤ Ωж")


def test_of_the_fonts_those_that_have_most_of_the_characters_are_taken(monkeypatch):
    has = {Path("a"): "xy", Path("b"): "yz", Path("c"): "xyz", Path("d"): "q"}
    monkeypatch.setattr(glyphs, "coverage", lambda font: frozenset(map(ord, has[font])))
    assert glyphs.fonts_with("xyz", has) == (Path("c"),)
    assert glyphs.fonts_with("xyzq!", has) == (Path("c"), Path("d"))
    assert glyphs.fonts_with("!", has) == ()


def test_a_font_of_the_machine_that_has_the_characters_is_embedded(monkeypatch):
    """DejaVu Sans, which comes with matplotlib, has the hammer and pick that the report's own fonts lack."""
    second = style._own_fonts()[1]
    monkeypatch.setattr(glyphs, "machine_fonts", lambda: (second,))
    lacking = "\u0edc\u2692\U0001d335"  # Lao, a symbol, a monospaced letter
    fonts, missing = document.found_for(frozenset(lacking))
    assert set(fonts) == {second}
    assert not missing & {chr(c) for c in glyphs.coverage(second)}


def test_many_code_points_of_one_run_are_counted_and_not_all_written():
    said = glyphs.without("長" * 500, "長")
    assert said.endswith("… 500 characters]")
    assert len(said) < 600
    assert glyphs.without("a長b]", "長]") == "a[U+9577]b[U+005D]"


def test_labels_of_a_figure_are_drawn_without_a_warning_and_no_word_pushes_the_panel_away():
    with style.style():
        figure, ((axes,),) = style.new_figure(2.0)
        names = ["測定-1", "การวัด", "🚀", "r" * 200]
        axes.barh(names, [1, 2, 3, 4], label="测量")
        axes.legend()
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            svg = style.to_svg(figure)
    assert svg.startswith(b"<?xml")
    shown = [text.get_text() for text in axes.get_yticklabels()]
    assert shown == ["[U+6E2C U+5B9A]-1", "[U+0E01 U+0E32 U+0E23 U+0E27 U+0E31 U+0E14]", "[rocket]", shown[3]]
    assert len(shown[3]) == 37


def test_the_check_names_the_texts_that_will_not_be_shown_as_written(tmp_path):
    (tmp_path / "batch.yaml").write_text("title: 测量\nwork: {material: Gußeisen}\n", encoding="utf-8")
    (tmp_path / "runs.csv").write_text("run,plate\nr1,鋼\n", encoding="utf-8")
    title, plate = map(str, readable.readable_findings(tmp_path))
    assert title.startswith('batch.yaml: title: no font on this machine has the characters "测量"')
    assert "[U+6D4B U+91CF]" in title
    assert plate.startswith("runs.csv: column plate: no font on this machine has")
