"""The reliability curve: of effects to which a probability was given, how often they were there."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from metro.units import JSON


def drawn(programs: Mapping[str, JSON], path: Path) -> None:
    """Draw the curve of each program that states probabilities, by their rows of the log."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    mpl.rcParams["svg.hashsalt"] = "protocol"
    figure, axes = plt.subplots(figsize=(5.2, 5.0), layout="constrained")
    axes.plot([0.0, 1.0], [0.0, 1.0], color="0.6", linewidth=1.0, label="calibrated")
    stating = [(name, row["tried"]["bins"]) for name, row in programs.items() if row["tried"]["bins"]]
    for place, (name, bins) in enumerate(stating):
        stated, rate = [one["stated"] for one in bins], [one["came_true"] for one in bins]
        below = [one["came_true"] - one["ci95"][0] for one in bins]
        above = [one["ci95"][1] - one["came_true"] for one in bins]
        axes.errorbar(stated, rate, [below, above], fmt="os^Dv"[place % 5], capsize=3, label=name)
        for one in bins if place == 0 else ():
            axes.annotate(
                str(one["count"]),
                (one["stated"], one["came_true"]),
                textcoords="offset points",
                xytext=(7, -3),
            )
    axes.set(xlim=(-0.03, 1.08), ylim=(-0.03, 1.03), aspect="equal")
    axes.set(xlabel="stated probability", ylabel="came true (number of effects beside)")
    axes.legend(frameon=False, loc="upper left")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)
