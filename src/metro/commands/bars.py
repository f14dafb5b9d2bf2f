"""Errors on held-out runs as bars of characters, with their numbers beside them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from metro.report.numbers import number, percent
from metro.report.sections.verdict import change, error_text
from metro.units import JSON, printed

if TYPE_CHECKING:
    from rich.console import RenderableType

LABELS, COLOURS = ("base model", "with effects"), ("yellow", "cyan")
WIDEST, NARROWEST = 40, 13  # characters of a bar; the label of the noise floor fits into the narrowest


def error_bars(entry: JSON, width: int) -> Iterator[RenderableType]:
    """Yield the errors of a verdict as bars on one scale; a mark shows the noise floor.

    Parameters
    ----------
    entry : verdict on an observable. width : of the terminal, in characters; the bars use the part of it that
        their numbers do not need.
    """
    from rich.table import Table
    from rich.text import Text

    floor = entry.get("noise_floor")
    errors = [entry.get("before") or {}, entry.get("after") or {}]
    sizes = [float(error["rms"]) for error in errors if error.get("rms") is not None]
    top = max((size for size in [*sizes, floor or 0.0] if math.isfinite(size)), default=0.0)
    if top <= 0 or len(sizes) < len(errors):
        return
    captions = _captions(entry, errors)
    left = width - max(map(len, LABELS)) - max(map(len, captions)) - 2
    room = min(max(left, NARROWEST), WIDEST)
    table = Table.grid(padding=(0, 1))
    table.add_column(no_wrap=True)
    table.add_column(no_wrap=True, width=room)  # otherwise rich shortens the bars for a long caption
    for label, size, colour, caption in zip(LABELS, sizes, COLOURS, captions, strict=True):
        table.add_row(Text(label), Text(bar(size, top, room, floor), style=colour), Text(caption))
    if floor is not None:
        table.add_row(
            "", Text("│ noise floor", style="dim"), Text(f"{number(floor)} {printed(entry.get('unit'))}")
        )
    yield table


def bar(size: float, top: float, width: int, mark: float | None = None) -> str:
    """Return a bar of ``size``, to an eighth of a character; ``width`` characters represent ``top``.

    ``mark`` is a value at which a line is drawn, over the bar or behind its end.
    """
    eighths = round(8 * width * min(max(size / top, 0.0), 1.0))
    text = ("█" * (eighths // 8) + " ▏▎▍▌▋▊▉"[eighths % 8]).ljust(width)[:width]
    if mark is None:
        return text
    at = min(int(width * min(max(mark / top, 0.0), 1.0)), width - 1)
    return f"{text[:at]}│{text[at + 1 :]}"


def _captions(entry: JSON, errors: list[JSON]) -> list[str]:
    """Write each error with its interval and, where it is known, its share of the signal."""
    texts = [error_text(error, entry.get("unit")) for error in errors]
    relative = change("", entry)
    if relative is None:
        return texts
    shares = (relative.before, relative.after)
    return [
        f"{text} ({percent(share / 100)} of the signal)" for text, share in zip(texts, shares, strict=True)
    ]
