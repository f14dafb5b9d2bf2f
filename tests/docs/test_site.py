"""The documentation as a site: it builds strictly, fetches nothing, and its formulas are drawn."""

import os
import re
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

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


def test_a_formula_that_cannot_be_drawn_is_an_error():
    drawn = runpy.run_path(str(ROOT / "scripts/site_hooks.py"))["drawn"]
    with pytest.raises(ValueError, match="nosuchthing"):
        drawn(r"\nosuchthing{x}", displayed=True)
    assert drawn(r"\frac{1}{k}", displayed=True).startswith("<div")


def test_a_broken_link_and_a_page_outside_the_navigation_stop_the_build(tmp_path):
    for name in ("docs", "scripts"):
        shutil.copytree(ROOT / name, tmp_path / name)
    shutil.copy(ROOT / "mkdocs.yml", tmp_path)
    (tmp_path / "docs" / "stray.md").write_text("# Stray\n\n[nowhere](nowhere.md)\n")
    done = build(tmp_path, tmp_path / "mkdocs.yml")
    assert done.returncode
    assert "nowhere.md" in done.stderr
    assert re.search(r"not included in the .nav.*\n.*stray.md", done.stderr)
