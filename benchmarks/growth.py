"""Seconds against samples of the forward simulation and of the identification, drawn with their exponents.

``python benchmarks/growth.py docs/figures/growth.svg``. An exponent of one is linear growth; below the
samples that it is fitted from, what does not grow (tables of the edge, the fit of the order averages) rules.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from bench_forces import ours, seconds
from bench_identification import RATE, RUNS, batch_of, identified

FORWARD = (10_000, 30_000, 100_000, 300_000, 1_000_000, 3_000_000)
RECORDS = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0)
LAST = 3  # counts that the exponent is fitted to


@dataclass(frozen=True)
class Series:
    """What was timed: ``samples`` (n,) and the best ``spent`` (n,), s."""

    label: str
    samples: np.ndarray
    spent: np.ndarray

    @property
    def exponent(self):
        """Slope on logarithmic axes, over the last counts."""
        return np.polyfit(np.log(self.samples[-LAST:]), np.log(self.spent[-LAST:]), 1)[0]

    @property
    def legend(self):
        """Words for the legend."""
        return f"{self.label}: exponent {self.exponent:.2f} from {self.samples[-LAST]:,} samples on"


def measured():
    """Time forward simulation and identification for growing numbers of samples."""
    ours(10)  # imports
    forward = [seconds(ours, count) for count in FORWARD]
    identified(*batch_of(RECORDS[0]))
    identification = [seconds(identified, *batch_of(length), repeats=3) for length in RECORDS]
    samples = (RUNS * RATE * np.array(RECORDS)).round().astype(int)
    return [
        Series("force of one run (N 4, helix 40°, runout)", np.array(FORWARD), np.array(forward)),
        Series(f"identification of {RUNS} runs", samples, np.array(identification)),
    ]


def draw(series, path):
    """Draw on logarithmic axes; the same figures give the same file."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    mpl.rcParams["svg.hashsalt"] = "growth"
    figure, axes = plt.subplots(figsize=(7.2, 5.0), layout="constrained")
    for one in series:
        (line,) = axes.loglog(one.samples, one.spent, "o-", label=one.legend)
        last = one.spent[-1] * one.samples / one.samples[-1]
        axes.loglog(one.samples, last, ":", color=line.get_color(), linewidth=1.0)
    axes.plot([], [], ":", color="0.4", linewidth=1.0, label="linear")
    axes.set(xlabel="samples (three channels each)", ylabel="CPU time, s")
    axes.grid(visible=True, which="major", color="0.9")
    figure.legend(loc="outside upper left", frameon=False)
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


if __name__ == "__main__":
    found = measured()
    for one in found:
        print(one.legend)
        for count, spent in zip(one.samples, one.spent, strict=True):
            print(f"{count:12,d} {spent:9.4f} s {1e6 * spent / count:9.3f} us/sample")
    out = Path(sys.argv[1])
    out.parent.mkdir(parents=True, exist_ok=True)
    draw(found, out)
