"""Tables to the terminal and to Markdown; the confusion and the calibration as a figure."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console
from rich.table import Table as RichTable

from proof.score import Score
from proof.statistics import binned
from proof.tables import Table, confusion

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def printed(tables: Sequence[Table], console: Console) -> None:
    """Print the tables."""
    for table in tables:
        drawn = RichTable(title=table.title, caption=table.note or None, title_justify="left")
        for name in table.header:
            drawn.add_column(name)
        for row in table.rows:
            drawn.add_row(*row, style="bold red" if row[-1] == "NO" else None)
        console.print(drawn)


def markdown(heading: str, tables: Sequence[Table]) -> str:
    """Return the tables as a page."""
    parts = [heading]
    for table in tables:
        lines = [table.header, ("---",) * len(table.header), *table.rows]
        body = "\n".join("| " + " | ".join(row) + " |" for row in lines)
        parts.append(f"## {table.title}\n\n" + (f"{table.note}\n\n" if table.note else "") + body)
    return "\n\n".join(parts) + "\n"


def draw(scores: Sequence[Score], path: Path) -> None:
    """Draw the confusion matrix and the stated probabilities against what came true."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    mpl.rcParams["svg.hashsalt"] = "proof"
    figure, (left, right) = plt.subplots(
        1, 2, figsize=(14.0, 6.5), width_ratios=(1.7, 1.0), layout="constrained"
    )
    _confusion(left, confusion(scores))
    _calibration(right, [pair for s in scores for pair in (*s.stated, *s.rejected)])
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


def _confusion(axes: Axes, table: Table) -> None:
    counts = np.array(
        [[0 if cell == "·" else int(cell) for cell in row[1:]] for row in table.rows], dtype=float
    )
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1.0)
    axes.imshow(share, cmap="Blues", vmin=0.0, vmax=1.3, aspect="auto")
    for (row, column), count in np.ndenumerate(counts):
        if count:
            axes.text(column, row, f"{count:.0f}", ha="center", va="center")
    axes.set_xticks(range(len(table.header) - 1), table.header[1:], rotation=40, ha="right")
    axes.set_yticks(range(len(table.rows)), [row[0] for row in table.rows])
    axes.set(xlabel="named", ylabel="hidden", title="Batches by what was hidden and what was named")


def _calibration(axes: Axes, stated: Sequence[tuple[float, bool]]) -> None:
    axes.plot([0.0, 1.0], [0.0, 1.0], color="0.6", linewidth=1.0, label="calibrated")
    for one in binned(stated):
        rate, low, high = one.came_true.value, one.came_true.low, one.came_true.high
        axes.errorbar(one.stated, rate, [[rate - low], [high - rate]], fmt="o", color="C0", capsize=3)
        axes.annotate(str(one.count), (one.stated, rate), textcoords="offset points", xytext=(7, -3))
    axes.set(xlim=(-0.03, 1.08), ylim=(-0.03, 1.03), aspect="equal")
    axes.set(
        xlabel="stated probability", ylabel="frequency right", title="Calibration (number of effects beside)"
    )
    axes.legend(frameon=False, loc="upper left")
