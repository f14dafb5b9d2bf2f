"""From sections to a PDF: content as JSON and SVG for a Typst template, set as PDF/A-2a and PDF/UA-1."""

from __future__ import annotations

import json
import re
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType

from metro.batch.writing import writing
from metro.report import glyphs
from metro.report.content import Abreast, Bullets, Item, Paragraph, Picture, Section
from metro.units import JSON

TEMPLATE, CONTENT = "report.typ", "content.json"
FEW_LINES = 250.0  # a last page that ends above is nearly empty, points
# The space between a number and its unit, at which no line may end.
UNIT = re.compile(r"(?<=\d) (?=(?:%|[mµ]?m|[km]?N|k?Hz|rpm|m?s|kg|N/\w+)(?![^\W\d]))")
HEIGHT = re.compile(rb"""<svg\b[^>]*?\bheight=['"]([\d.]+)pt""")
HEADER = 90  # characters of a title that fit beside the subtitle at the head of a page
# Sets each of some characters alone, as the report would.
PROBE = """#set document(title: "probe")
#set text(font: "Libertinus Serif", lang: "en")
#for character in json("content.json") [#text(character) #parbreak()]
"""
NO_LINKS: Mapping[str, str] = MappingProxyType({})


@dataclass(frozen=True)
class Cover:
    """Texts at the head and the foot of a report."""

    title: str
    subtitle: str
    footer: str


def compile_pdf(cover: Cover, sections: Sequence[Section], links: Mapping[str, str] = NO_LINKS) -> bytes:
    """Set the sections in the report's template; ``links``: the targets of names in a column ``batch``.

    The bytes depend only on the arguments and the installed versions: fonts are those of the Typst package,
    and the time stamp is fixed.
    """
    import typst

    with tempfile.TemporaryDirectory() as name, writing(Path(name) / TEMPLATE):
        folder = Path(name)
        content = {
            "cover": asdict(cover),
            "header": _cut(cover.title),
            "links": dict(links),
            "floats": True,
            "tight": False,
            "sections": [_section(s, i, folder) for i, s in enumerate(sections)],
        }
        text = UNIT.sub("\u00a0", json.dumps(content, ensure_ascii=False))
        (folder / "title.txt").write_text(cover.title, encoding="utf-8")
        (folder / TEMPLATE).write_bytes((files("metro.report") / "templates" / TEMPLATE).read_bytes())
        text = _filled(folder, text)
        try:
            return _compiled(folder, text)
        except typst.TypstError:
            fonts, missing = found_for(frozenset(text))
            if fonts or missing:
                return _compiled(folder, glyphs.without(text, missing), fonts)
            # Typst cannot tag every float that falls into a list or a table: figures stay in their places
            return _compiled(folder, _with(text, floats=False))


def _with(content: str, **settings: bool) -> str:
    """Return the content of a report with other settings of its template."""
    return json.dumps({**json.loads(content), **settings}, ensure_ascii=False)


def _filled(folder: Path, content: str) -> str:
    """Set all a little closer where the last page holds a few lines and can be saved by that."""
    tight = _with(content, tight=True)
    pages, end = _end(folder, content)
    return tight if end < FEW_LINES and _end(folder, tight)[0] < pages else content


def _end(folder: Path, content: str) -> tuple[int, float]:
    """Return on which page a report ends, and how far below its upper edge, points."""
    import typst

    (folder / CONTENT).write_text(content, encoding="utf-8")
    found = typst.query(
        str(folder / TEMPLATE),
        "<end>",
        field="value",
        one=True,
        root=str(folder),
        ignore_system_fonts=True,
    )
    page, end = json.loads(found)
    return int(page), float(end)


def _compiled(folder: Path, content: str, fonts: Sequence[Path] = ()) -> bytes:
    """Set the template in a folder with its content, a JSON text, and further fonts.

    Raises
    ------
    typst.TypstError
        Some characters are in no font, for example.
    """
    import typst

    (folder / CONTENT).write_text(content, encoding="utf-8")
    further = folder / "fonts"
    further.mkdir(exist_ok=True)
    for place, font in enumerate(fonts):
        shutil.copyfile(font, further / f"{place}{font.suffix}")
    pdf: bytes = typst.compile(
        str(folder / TEMPLATE),
        root=str(folder),
        font_paths=[str(further)],
        pdf_standards=["a-2a", "ua-1"],
        timestamp=0,
        ignore_system_fonts=True,
    )
    return pdf


def found_for(characters: frozenset[str]) -> tuple[tuple[Path, ...], frozenset[str]]:
    """Find fonts of this machine for characters that the report's own lack, and the characters that none has.

    A font is used only where the report, set with it, is an archival PDF still.
    """
    lacked = _not_set(characters, ())
    fonts: tuple[Path, ...] = ()
    for font in glyphs.fonts_with(lacked):
        if not _not_set(frozenset("metro"), (*fonts, font)):
            fonts = (*fonts, font)
    return fonts, _not_set(lacked, fonts)


def _not_set(characters: frozenset[str], fonts: Sequence[Path]) -> frozenset[str]:
    """Return those of some characters that cannot be set with the own and further fonts, by halving."""
    import typst

    if not characters:
        return frozenset()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / TEMPLATE).write_text(PROBE, encoding="utf-8")
        try:
            _compiled(folder, json.dumps(sorted(characters)), fonts)
        except typst.TypstError:
            if len(characters) == 1:
                return characters
        else:
            return frozenset()
    some = sorted(characters)
    halves = some[: len(some) // 2], some[len(some) // 2 :]
    return frozenset[str]().union(*(_not_set(frozenset(half), fonts) for half in halves))


def _cut(title: str) -> str:
    """Return a title as it fits into one line at the head of a page."""
    return title if len(title) <= HEADER else f"{title[:HEADER]} …"


def svg_height(svg: bytes) -> float:
    """Return the height of a figure, points.

    Raises
    ------
    ValueError
        The figure does not state it in points.
    """
    found = HEIGHT.search(svg)
    if found is None:
        raise ValueError("found an SVG without a height in points; expected a figure of matplotlib")
    return float(found[1])


def _section(section: Section, place: int, folder: Path) -> JSON:
    items = [_item(item, f"figure-{place}-{i}.svg", folder) for i, item in enumerate(section.items)]
    return {"title": section.title, "page": section.page, "items": items}


def _item(item: Item, name: str, folder: Path) -> JSON:
    kind = type(item).__name__.lower()
    if isinstance(item, Abreast):
        parts = [_item(part, f"{k}-{name}", folder) for k, part in enumerate(item.items)]
        return {"kind": kind, "items": parts}
    if isinstance(item, Picture):
        (folder / name).write_bytes(item.svg)
        described = {"caption": item.caption, "alt": item.alt}
        return {"kind": kind, "file": name, "height": svg_height(item.svg), **described}
    if isinstance(item, Paragraph):
        return {"kind": kind, "text": _whole(item.text), "look": item.look}
    if isinstance(item, Bullets):
        return {"kind": kind, "items": [_whole(text) for text in item.items], "small": item.small}
    return {"kind": kind, **asdict(item)}


def _whole(text: str) -> str:
    """Keep a value on one line with its interval; a narrow cell of a table has no room for that."""
    return text.replace(" ± ", "\u00a0±\u00a0")
