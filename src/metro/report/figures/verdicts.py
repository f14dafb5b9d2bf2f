"""Errors before and after, of observables, batches and runs; and the signature of the residual."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from metro.report import style
from metro.units import JSON, printed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PATTERNS, LONGEST = 8, 30  # most bars, and most characters of a bar's label
SMALLEST = 0.1  # end of the axis if the residual is zero, % of the signal
ABREAST = 1.6  # inches, of one of two figures side by side
LETTER = 0.065  # inches, of a name that is written upwards
HATCHES = ("", "/////", "xxxxx", "....", "-----", "+++++")  # axes in grey print
MOST_NAMED = 18  # runs along an axis of half the width
LABEL_ROOM = 36  # characters that fit side by side under a figure of half the width


@dataclass(frozen=True)
class Change:
    """An error before and after, with 95 % intervals (low, high) or None, and the floor that noise sets."""

    label: str
    before: float
    after: float
    before_ci95: tuple[float, float] | None
    after_ci95: tuple[float, float] | None
    floor: float | None


def changes(rows: Sequence[Change], xlabel: str) -> Figure:
    """Draw a line from before to after for each row, with intervals and the noise floor."""
    with style.style():
        figure, ((axes,),) = style.new_figure(0.9 + 0.24 * len(rows))
        y = np.arange(len(rows))[::-1]
        for at, row in zip(y, rows, strict=True):
            axes.plot([row.before, row.after], [at, at], color=style.GREY, lw=1.4, zorder=1)
            if row.floor is not None:
                axes.plot(
                    [row.floor] * 2, [at - 0.32, at + 0.32], color=style.MEASURED, lw=1.1, label="noise floor"
                )
            _whisker(axes, at + 0.12, row.before_ci95, style.BEFORE)
            _whisker(axes, at - 0.12, row.after_ci95, style.AFTER)
        axes.scatter(
            [r.before for r in rows], y + 0.12, c=style.BEFORE, marker="D", s=22, zorder=3, label="base model"
        )
        axes.scatter(
            [r.after for r in rows], y - 0.12, c=style.AFTER, s=26, zorder=3, label="with effects found"
        )
        axes.set_yticks(y, [row.label for row in rows])
        axes.set(xlabel=xlabel, ylim=(-0.6, len(rows) - 0.4), title="Held-out error, before and after")
        axes.set_xlim(left=0)
        axes.grid(visible=False, axis="y")
        handles, labels = axes.get_legend_handles_labels()
        unique = dict(zip(labels, handles, strict=True))
        figure.legend(unique.values(), unique.keys(), loc="outside upper center", ncols=3)
    return figure


def _whisker(axes: Axes, at: float, ci95: tuple[float, float] | None, colour: str) -> None:
    if ci95 is not None:
        axes.plot(ci95, [at, at], color=colour, lw=1.2, solid_capstyle="butt", zorder=2)


def runs(blocks: Sequence[JSON], unit: str, floor: float | None) -> Figure:
    """Draw each run's residual before and after: held-out runs are filled, identification runs hollow.

    Parameters
    ----------
    blocks : ``{"run", "role", "order", "rms_before", "rms_after"}`` of ``loop.json``.
    """
    rows = [
        b for b in blocks if b.get("role") in {"identify", "validate"} and b.get("rms_before") is not None
    ]
    rows = sorted(rows, key=lambda b: b.get("order") or 0)
    x, size = np.arange(1, len(rows) + 1), 22 if len(rows) <= MOST_NAMED else 8
    step = -(-len(rows) // MOST_NAMED)
    names = [str(b["run"]) for b in rows][::step]
    upwards = sum(len(name) + 2 for name in names) > LABEL_ROOM
    room = LETTER * max(map(len, names)) if upwards else 0.0
    with style.style():
        figure, ((axes,),) = style.new_figure(ABREAST + room, width=style.HALF)
        changed = any(b.get("rms_after") not in {None, b["rms_before"]} for b in rows)
        series = [
            ("rms_before", style.BEFORE, "D", "base model"),
            ("rms_after", style.AFTER, "o", "with effects"),
        ]
        for role, filled, words in (("identify", False, "identification"), ("validate", True, "held out")):
            at = [i for i, b in enumerate(rows) if b["role"] == role]
            for key, colour, mark, name in series[: 1 + changed] if at else []:
                value = [float(v) if (v := rows[i].get(key)) is not None else np.nan for i in at]
                face, label = (colour if filled else "white"), f"{name}, {words}"
                drawn = axes.scatter(x[at], value, marker=mark, s=size, fc=face, ec=colour, label=label)
                drawn.set_clip_on(False)  # the mark of a run without residual is on the axis
        if floor is not None:
            axes.axhline(floor, color=style.MEASURED, lw=0.8, ls=":", label="noise floor")
        axes.margins(y=0.12)
        axes.set_ylim(bottom=0)
        axes.set(
            ylabel=f"rms residual ({printed(unit)})" if printed(unit) else "rms residual",
            xlabel="run, in the order of cutting",
        )
        axes.set_xticks(x[::step], names, rotation=90 if upwards else 0)
        handles, labels = axes.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=2)
    return figure


def _largest(entries: Sequence[JSON]) -> list[str]:
    """Labels of the largest entries, in their natural order (order 2 before order 10)."""
    size: dict[str, tuple[float, float]] = {}
    for entry in entries:
        label, own = str(entry["label"]), (_share(entry), float(entry.get("amplitude") or 0.0))
        size[label] = max(size.get(label, own), own)
    chosen = sorted(size, key=lambda label: size[label], reverse=True)[:PATTERNS]
    return sorted(
        chosen, key=lambda label: [int(x) if x.isdigit() else -1 for x in re.split(r"(\d+)", label)]
    )


def _share(entry: JSON) -> float:
    return 100.0 * float(entry.get("relative") or 0.0)


def signature(entries: Sequence[JSON]) -> Figure:
    """Draw the residual beyond the noise after the effects, by pattern and axis; full bars are significant.

    It is drawn as a share of the axis's signal, because the amplitudes of patterns that sum over different
    numbers of values cannot be compared.

    Parameters
    ----------
    entries : ``{"axis", "label", "amplitude", "relative", "significant"}`` of ``loop.json``.
    """
    names = list(dict.fromkeys(str(e.get("axis") or "") for e in entries))
    labels = _largest(entries)
    with style.style():
        figure, ((axes,),) = style.new_figure(ABREAST, width=style.HALF)
        thick = 0.8 / len(names)
        for k, name in enumerate(names):
            colour, hatch = style.SERIES[k % len(style.SERIES)], HATCHES[k % len(HATCHES)]
            axes.barh(0, 0, color="white", edgecolor=colour, hatch=hatch, label=name)
            for entry in entries:
                if str(entry.get("axis") or "") == name and str(entry["label"]) in labels:
                    at = thick * ((len(names) - 1) / 2 - k) - labels.index(str(entry["label"]))
                    face = colour if entry.get("significant") else "white"
                    (bar,) = axes.barh(at, _share(entry), 0.9 * thick, color=face, lw=0.7)
                    bar.set(edgecolor=colour, hatch=hatch)
        axes.set_yticks([-i for i in range(len(labels))], [_shown(label) for label in labels], fontsize=8)
        axes.set(ylim=(0.4 - len(labels), 0.6), xlabel="residual less the mean noise\n(% of the signal)")
        axes.set_xlim(0, 1.05 * max(SMALLEST, *map(_share, entries)))
        axes.grid(visible=False, axis="y")
        if len(names) > 1:
            figure.legend(loc="outside upper center", ncols=3)
    return figure


def _shown(label: str) -> str:
    name = {"all": "throughout", "mean": "constant"}.get(label, label)
    return name if len(name) <= LONGEST else name[: LONGEST - 1] + "…"
