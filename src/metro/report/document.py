"""From sections to a PDF: content as JSON and SVG beside a Typst template, set as PDF/A-2a and PDF/UA-1."""

from __future__ import annotations

import json
import re
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType

from metro.batch.writing import writing
from metro.report.content import Abreast, Item, Picture, Section
from metro.report.style import to_svg
from metro.units import JSON

TEMPLATE = "report.typ"
# the space between a number and its unit, at which no line is to end
UNIT = re.compile(r"(?<=\d) (?=(?:%|[mµ]?m|[km]?N|k?Hz|rpm|m?s|kg|N/\w+)(?![^\W\d]))")
NO_LINKS: Mapping[str, str] = MappingProxyType({})


@dataclass(frozen=True)
class Cover:
    """What stands at the head and the foot of a report."""

    title: str
    subtitle: str
    footer: str


def compile_pdf(cover: Cover, sections: Sequence[Section], links: Mapping[str, str] = NO_LINKS) -> bytes:
    """Set the sections in the report's template; ``links``: where a name in a column ``batch`` leads to.

    The bytes depend on nothing but the arguments and the installed versions: fonts are those of the Typst
    package, and the time stamp is fixed.
    """
    import typst

    with tempfile.TemporaryDirectory() as name, writing(Path(name) / TEMPLATE):
        folder = Path(name)
        template = folder / TEMPLATE
        template.write_bytes((files("metro.report") / "templates" / TEMPLATE).read_bytes())
        content = {
            "cover": asdict(cover),
            "links": dict(links),
            "sections": [_section(s, i, folder) for i, s in enumerate(sections)],
        }
        told = UNIT.sub("\u00a0", json.dumps(content, ensure_ascii=False))
        (folder / "content.json").write_text(told, encoding="utf-8")
        pdf: bytes = typst.compile(
            str(template),
            root=str(folder),
            pdf_standards=["a-2a", "ua-1"],
            timestamp=0,
            ignore_system_fonts=True,
        )
    return pdf


def _section(section: Section, place: int, folder: Path) -> JSON:
    items = [_item(item, f"figure-{place}-{i}.svg", folder) for i, item in enumerate(section.items)]
    return {"title": section.title, "page": section.page, "items": items}


def _item(item: Item, name: str, folder: Path) -> JSON:
    kind = type(item).__name__.lower()
    if isinstance(item, Abreast):
        parts = [_item(part, f"{k}-{name}", folder) for k, part in enumerate(item.items)]
        return {"kind": kind, "items": parts}
    if isinstance(item, Picture):
        (folder / name).write_bytes(to_svg(item.figure))
        return {"kind": kind, "file": name, "caption": item.caption, "alt": item.alt}
    return {"kind": kind, **asdict(item)}
