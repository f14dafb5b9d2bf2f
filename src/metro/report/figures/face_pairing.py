"""Parity of predicted faces: X_m of each face, before and after the loop, over that of its scan."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pandas as pd

from metro.report import style
from metro.report.figures.comparison import AFTER, BEFORE

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def parity(faces: pd.DataFrame, unit: str) -> Figure:
    """Draw predicted over measured X_m of held-out faces, and the similarity of each face.

    Parameters
    ----------
    faces : a row per run: ``run``, and by ``measured``, ``before``, ``after`` X_m; ``similar_before``,
        ``similar_after`` in per cent.
    unit : of X_m.
    """
    ends = [0.0, 1.08 * float(faces[["measured", "before", "after"]].to_numpy().max())]
    with style.style():
        figure, ((left, right),) = style.new_figure(2.4, 1, 2)
        left.plot(ends, ends, color=style.GREY, lw=0.8)
        for kind in (BEFORE, AFTER):
            left.plot(
                *(faces["measured"], faces[kind.column]),
                color=kind.colour,
                marker=kind.mark,
                ls="",
                label=kind.label,
                clip_on=False,
            )
            right.plot(
                *(range(len(faces)), faces[f"similar_{kind.column}"]),
                color=kind.colour,
                marker=kind.mark,
                ls="",
                clip_on=False,
            )
        left.set(xlim=ends, ylim=ends, aspect="equal", xlabel=f"X_m measured ({unit})")
        left.set_ylabel(f"predicted ({unit})")
        left.set_title("Parity", loc="left")
        right.axhline(100, color=style.GREY, lw=0.8)
        right.set_xticks(range(len(faces)), faces["run"].astype(str), rotation=90 if len(faces) > 8 else 0)
        right.set_ylabel("similarity of X_m (%)")
        right.set_title("Similarity, 100 − |D_r|", loc="left")
        style.legend_above(figure, left)
    return figure
