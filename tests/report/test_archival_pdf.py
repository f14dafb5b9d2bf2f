"""The PDF as an archive and a screen reader take it: PDF/A-2a and PDF/UA-1, read by a library of its own."""

import io
from itertools import pairwise

import pikepdf
import pytest
import synthetic_results as synthetic

from metro.report.batch_report import report_pdf, report_sections


def pdf_of(results):
    return report_pdf(results, report_sections(results))


@pytest.fixture(scope="module")
def pdf():
    with pikepdf.open(io.BytesIO(pdf_of(synthetic.results()))) as document:
        yield document


def objects(pdf, kind):
    """Return all indirect dictionaries of a /Type."""
    dictionaries = (o for o in pdf.objects if isinstance(o, pikepdf.Dictionary | pikepdf.Stream))
    return [o for o in dictionaries if o.get("/Type") == kind]


def structure(node):
    """Return the elements of the structure tree below a node in reading order, as (role, element)."""
    kids = node.get("/K", [])
    found = [kid for kid in (kids if isinstance(kids, pikepdf.Array) else [kids]) if "/S" in _keys(kid)]
    return [each for kid in found for each in [(str(kid.S), kid), *structure(kid)]]


def _keys(thing):
    return set(thing.keys()) if isinstance(thing, pikepdf.Dictionary) else set()


def test_the_file_is_sound(pdf):
    assert pdf.check_pdf_syntax() == []


def test_the_metadata_claim_an_archival_and_accessible_file_and_give_title_and_language(pdf):
    with pdf.open_metadata() as xmp:
        assert (xmp["pdfaid:part"], xmp["pdfaid:conformance"]) == ("2", "A")
        assert xmp["pdfuaid:part"] == "1"
        assert xmp["dc:title"] == synthetic.results().title
    assert str(pdf.Root.Lang) == "en"
    assert pdf.Root.ViewerPreferences.DisplayDocTitle
    assert len(pdf.trailer.ID) == 2


def test_colours_are_those_of_an_embedded_profile(pdf):
    (intent,) = pdf.Root.OutputIntents
    assert intent.S == "/GTS_PDFA1"
    assert intent.DestOutputProfile.read_bytes()[36:40] == b"acsp"


def test_every_font_is_embedded_and_says_what_its_signs_mean(pdf):
    described = objects(pdf, "/FontDescriptor")
    assert described
    assert [
        d.FontName for d in described if not {"/FontFile", "/FontFile2", "/FontFile3"} & set(d.keys())
    ] == []
    used = [font for font in objects(pdf, "/Font") if font.Subtype in {"/Type0", "/TrueType", "/Type1"}]
    assert len(used) >= 2
    assert [font.BaseFont for font in used if "/ToUnicode" not in font] == []


def test_nothing_runs_nothing_is_hidden_and_nothing_is_attached(pdf):
    assert not pdf.is_encrypted
    assert not {"/OpenAction", "/AA", "/AcroForm", "/OCProperties"} & _keys(pdf.Root)
    assert not {"/JavaScript", "/EmbeddedFiles"} & _keys(pdf.Root.get("/Names"))
    assert {str(o.S) for o in pdf.objects if {"/S", "/URI"} <= _keys(o)} <= {"/URI"}


def test_transparent_pages_name_the_space_they_are_blended_in(pdf):
    blended = [page for page in pdf.pages if "/Group" in page]
    assert [page.index for page in blended if "/CS" not in page.Group] == []


def test_a_screen_reader_finds_figures_in_words_tables_with_heads_and_headings_in_order(pdf):
    assert pdf.Root.MarkInfo.Marked
    found = structure(pdf.Root.StructTreeRoot)
    words = [str(element.get("/Alt", "")) for role, element in found if role == "/Figure"]
    assert len(words) >= 5
    assert [text for text in words if len(text) < 20] == []
    tables = [element for role, element in found if role == "/Table"]
    assert len(tables) >= 5
    assert all("/TH" in dict(structure(table)) for table in tables)
    levels = [int(role[2:]) for role, _ in found if role[:2] == "/H" and role[2:].isdigit()]
    assert levels[0] == 1
    assert all(later <= earlier + 1 for earlier, later in pairwise(levels))


def test_every_page_belongs_to_the_structure(pdf):
    assert [page.index for page in pdf.pages if "/StructParents" not in page] == []
