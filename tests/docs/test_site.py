"""The documentation as a site: it builds strictly, fetches nothing, and its formulas are drawn."""

import os
import re
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import pypdfium2
import pytest
import yaml

ROOT = Path(__file__).parents[2]
FETCHED = re.compile(
    r"""<(?:script|img|iframe|source)[^>]*\ssrc=["']?(?:https?:)?//"""
    r"""|<link(?![^>]*rel=["']?canonical)[^>]*\shref=["']?(?:https?:)?//"""
    r"""|@import\s+["']?(?:https?:)?//|url\(["']?(?:https?:)?//"""
)


def build(folder, configuration):
    command = [
        sys.executable,
        "-m",
        "mkdocs",
        "build",
        "--strict",
        "-f",
        configuration,
        "-d",
        folder / "site",
    ]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1", "MPLCONFIGDIR": str(folder)}
    return subprocess.run(command, capture_output=True, text=True, check=False, env=environment)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    done = build(folder, ROOT / "mkdocs.yml")
    assert done.returncode == 0, done.stderr
    return folder / "site"


def test_every_page_is_there_and_none_asks_the_network_for_anything(site):
    pages = {path.stem for path in (ROOT / "docs").glob("*.md")}
    assert pages <= {path.stem for path in site.glob("*.html")}
    served = [path for path in site.rglob("*") if path.suffix in {".html", ".css"}]
    assert [path.name for path in served if FETCHED.search(path.read_text(encoding="utf-8"))] == []


def test_the_script_that_the_theme_would_fetch_comes_with_the_pages(site):
    for page in ("index.html", "404.html"):
        (source,) = re.findall(r'<script src="([^"]*iframe-worker[^"]*)"', (site / page).read_text())
        assert (site / source).is_file()


def test_formulas_are_drawings_that_say_what_they_are(site):
    page = (site / "errata.html").read_text(encoding="utf-8")
    assert 'role="img" aria-label="X_g \\leq X_a \\leq X_m"' in page
    assert "arithmatex" not in re.sub(r"<code>.*?</code>", "", page)


def test_every_page_has_one_name_on_the_first_page_and_in_the_menu():
    index = (ROOT / "docs/index.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| \[(.+?)\]\(([\w-]+\.md)\) \|", index, re.MULTILINE)
    titles = {
        path.name: path.open(encoding="utf-8").readline()[2:-1] for path in (ROOT / "docs").glob("*.md")
    }
    assert {page: name for name, page in rows} == {k: v for k, v in titles.items() if k != "index.md"}
    navigation = yaml.load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"), yaml.BaseLoader)["nav"]
    (first, *groups) = navigation
    in_menu = [page for group in groups for pages in group.values() for page in pages]
    assert (first, in_menu) == ("index.md", [page for _, page in rows])
    headings = re.findall(r"^### (.+)$", index, re.MULTILINE)
    assert headings == [name for group in groups for name in group]


def test_a_formula_keeps_its_size_in_a_narrow_cell():
    hooks = runpy.run_path(str(ROOT / "scripts/site_hooks.py"))
    for formula in (r"\frac{1}{k}", r"X_g \leq X_a \leq X_m"):
        shown = hooks["drawn"](formula, displayed=False)
        drawn = [float(each) for each in re.search(r'viewBox="0 \S+ (\d+) (\d+)"', shown).groups()]
        style = re.search(r'style="width:([\d.]+)em;height:([\d.]+)em;max-width:none;', shown).groups()
        expected = [hooks["SIZE"] * each / hooks["EM"] for each in drawn]
        assert [float(each) for each in style] == pytest.approx(expected, abs=0.01)


def test_the_picture_of_a_report_is_small_and_a_script_makes_it(tmp_path):
    own = (ROOT / "docs/figures/first-page.png").read_bytes()
    assert own.startswith(b"\x89PNG")
    assert len(own) < 150_000
    document = pypdfium2.PdfDocument.new()
    document.new_page(595, 842)
    document.save(tmp_path / "report.pdf")
    picture = runpy.run_path(str(ROOT / "scripts/first_page.py"))["picture"]
    assert 0 < picture(tmp_path / "report.pdf", tmp_path / "page.png") < len(own)


def test_a_formula_that_cannot_be_drawn_is_an_error():
    drawn = runpy.run_path(str(ROOT / "scripts/site_hooks.py"))["drawn"]
    with pytest.raises(ValueError, match="nosuchthing"):
        drawn(r"\nosuchthing{x}", displayed=True)
    assert drawn(r"\frac{1}{k}", displayed=True).startswith("<div")


def test_a_broken_link_and_a_page_outside_the_navigation_stop_the_build(tmp_path):
    for name in ("docs", "scripts"):
        shutil.copytree(ROOT / name, tmp_path / name)
    shutil.copy(ROOT / "mkdocs.yml", tmp_path)
    for page in (tmp_path / "docs").glob("*.md"):
        page.write_text(f"# {page.stem}\n")
    (tmp_path / "docs" / "stray.md").write_text("# Stray\n\n[nowhere](nowhere.md)\n")
    done = build(tmp_path, tmp_path / "mkdocs.yml")
    assert done.returncode
    assert "nowhere.md" in done.stderr
    assert re.search(r"not included in the .nav.*\n.*stray.md", done.stderr)
