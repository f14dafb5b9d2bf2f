"""The judgements as a page that reloads itself: the newest on top, readable on a telephone."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path

from metro.batch.writing import write_atomically
from metro.watch.judgement import Judgement

FILE = "watch.html"
RELOAD_S = 2
SHOWN = 50
COLOUR = {"as predicted": "#1a7f37", "differs": "#b35900", "error": "#b3261e", "checked": "#57606a"}
STYLE = """
:root { color-scheme: light dark; --ink: #1f2328; --soft: #57606a; --page: #f6f8fa; --card: #fff; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e6edf3; --soft: #9198a1; --page: #0d1117; --card: #161b22; }
}
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 720px; padding: 12px; background: var(--page); color: var(--ink);
  font: 16px/1.45 system-ui, sans-serif; overflow-wrap: anywhere; }
h1 { font-size: 1.05rem; margin: 0 0 12px; }
article { background: var(--card); border-left: 6px solid var(--status); border-radius: 6px;
  margin: 0 0 12px; padding: 10px 12px; }
article:first-of-type .headline { font-size: 1.2rem; }
p { margin: 4px 0; }
.file, .soft { color: var(--soft); font-size: .85rem; }
.headline { font-weight: 600; }
.advice { font-weight: 600; color: var(--status); }
"""


def write_page(folder: Path, batch: str, judgements: Sequence[Judgement]) -> Path:
    """Write the page into the folder of the batch's reports; return its path."""
    path = folder / FILE
    text = page(batch, judgements)
    write_atomically(path, lambda stream: stream.write(text.encode()))
    return path


def page(batch: str, judgements: Sequence[Judgement]) -> str:
    """Return the page of judgements that are given with the oldest first."""
    shown = list(reversed(judgements))[:SHOWN]
    articles = "\n".join(map(_article, shown)) or '<p class="soft">No new file yet.</p>'
    older = len(judgements) - len(shown)
    more = f'<p class="soft">{older} older judgements are in watch.json.</p>' if older else ""
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">\n'
        f'<meta http-equiv="refresh" content="{RELOAD_S}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(batch)}: new files</title>\n<style>{STYLE}</style></head>\n"
        f"<body><h1>{escape(batch)}: new files, the newest first</h1>\n<main>{articles}</main>\n{more}"
        "</body></html>\n"
    )


def _article(one: Judgement) -> str:
    clock = one.at[11:19]
    place = " · ".join(filter(None, [escape(one.file), escape(one.run), f"<time>{clock}</time>"]))
    reasons = "".join(f"<p>{escape(reason)}</p>" for reason in one.reasons)
    advice = f'<p class="advice">{escape(one.advice)}</p>' if one.advice else ""
    return (
        f'<article style="--status: {COLOUR[one.status]}"><p class="file">{place}</p>'
        f'<p class="headline">{escape(one.headline)}.</p>{advice}{reasons}</article>'
    )
