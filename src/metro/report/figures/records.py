"""Raw records at a glance: force records with the parts in the air and in use, and a hammer's hits."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pandas as pd

from metro.report import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FEW = 8  # most records that are drawn in four columns; more are drawn in six
FAINTEST = -40.0  # dB, end of the axis


def strongest(records: pd.DataFrame) -> str:
    """Return the axis along which the records have the largest span."""
    span = records.groupby("axis")["high_n"].max() - records.groupby("axis")["low_n"].min()
    return str(span.idxmax())


def force(records: pd.DataFrame, spindle: pd.DataFrame | None) -> Figure:
    """Draw the span of the force along each record, a small panel per run, along the strongest axis.

    Parameters
    ----------
    records : ``run, t_s, axis, low_n, high_n``.
    spindle : ``run, steady_from_s, steady_to_s, zero_at_s, air_s`` of the runs that were used; or None.
    """
    axis = strongest(records)
    panels = list(records[records["axis"] == axis].groupby("run", sort=False))
    used = {} if spindle is None else spindle.set_index("run").to_dict("index")
    columns = min(4 if len(panels) <= FEW else 6, len(panels))
    rows = -(-len(panels) // columns)
    with style.style():
        figure, grid = style.new_figure(0.75 + 0.7 * rows, rows, columns, sharey=True)
        flat = [axes for row in grid for axes in row]
        for axes, (run, part) in zip(flat, panels, strict=False):
            axes.fill_between(
                *(part["t_s"], part["low_n"], part["high_n"]),
                color=style.GREY,
                lw=0,
                label="span of the force",
            )
            if run in used:
                cut = used[run]
                axes.axvspan(
                    *(cut["steady_from_s"], cut["steady_to_s"]),
                    color=style.SKY,
                    alpha=0.35,
                    lw=0,
                    zorder=0,
                    label="steady cut, used",
                )
                if cut["air_s"] > 0:
                    axes.axvline(
                        cut["zero_at_s"], color=style.BEFORE, lw=1.0, ls="--", label="zero, from the air"
                    )
            axes.set_title(str(run), loc="left", fontsize=8, pad=2)
            axes.tick_params(labelsize=8)
            axes.margins(x=0)
        for axes in flat[len(panels) :]:
            axes.set_visible(False)
        for axes in flat[max(0, len(panels) - columns) : len(panels)]:
            axes.set_xlabel("time (s)", fontsize=8)
        figure.supylabel(f"force along {axis} (N)", fontsize=9)
        first_used = next(
            (axes for axes, (run, _) in zip(flat, panels, strict=False) if run in used), flat[0]
        )
        style.legend_above(figure, first_used)
    return figure


def hits(records: pd.DataFrame, band: tuple[float, float] | None) -> Figure:
    """Draw the force of every hit over time, and its spectrum with the band of the modal fit.

    Parameters
    ----------
    records : ``hit, part, x, value``: ``pulse`` in ms and N, ``spectrum`` in Hz and dB.
    band : Hz; None if nothing was fitted.
    """
    with style.style():
        figure, ((left, right),) = style.new_figure(1.8, 1, 2)
        for _, hit in records.groupby("hit", sort=False):
            pulse, spectrum = (hit[hit["part"] == part] for part in ("pulse", "spectrum"))
            left.plot(pulse["x"], pulse["value"], color=style.MEASURED, lw=0.7, alpha=0.7)
            right.plot(spectrum["x"], spectrum["value"], color=style.MEASURED, lw=0.6, alpha=0.7)
        if band is not None:
            right.set_xlim(0.0, min(2.0 * band[1], right.get_xlim()[1]))
            right.axvspan(*band, color=style.SKY, alpha=0.35, lw=0, zorder=0, label="band of the modes")
            right.legend(loc="lower left")
        left.set(xlabel="time from the peak (ms)", ylabel="force of the hammer (N)")
        right.set(xlabel="frequency (Hz)", ylabel="spectrum of the hit (dB)")
        right.set_ylim(bottom=max(FAINTEST, right.get_ylim()[0]))
        right.margins(x=0)
    return figure
