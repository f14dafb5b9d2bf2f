"""Whether helical runs identify both K_Fac and K_Fae, before any of them is cut: the design's sensitivity.

The thrust of the bottom edges is N R (K_Fac s + K_Fae), with s the axial feed per tooth: a line over s. From
run to run the thrust scatters by a share that hardly depends on s, so the slope of that line has the standard
deviation scatter × thrust / (N R √Σ(s − s̄)²), or, as the thrust is nearly N R K_Fae,

    sd(K_Fac) / K_Fae = scatter / √Σ(s − s̄)².

What K_Fac / K_Fae may be is known beforehand to within ``MAY_BE``: runs must halve that.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

SCATTER = 0.01  # of the force, from run to run, as for the coefficients of the periphery
MAY_BE = 4200.0  # 1/m: rms of what K_Fac / K_Fae may be, anything up to the 7.4 per mm of [T] table 4
WIDE = 1.96
LEAST_RUNS = 4
PER_UM, PER_MM = 1e6, 1e3


def spread(axial_feeds: Sequence[float]) -> float:
    """Return √Σ(s − s̄)² of the axial feeds per tooth s of runs, in their unit."""
    middle = sum(axial_feeds) / len(axial_feeds)
    return math.sqrt(sum((feed - middle) ** 2 for feed in axial_feeds))


def told_apart(axial_feeds: Sequence[float]) -> bool:
    """Whether runs at these axial feeds per tooth, m, at least halve what is not known of K_Fac."""
    return len(axial_feeds) > 1 and spread(axial_feeds) > 2.0 * SCATTER / MAY_BE


def needed(runs: int) -> float:
    """Return how far apart, m, two axial feeds per tooth must be that share some runs equally."""
    return 4.0 * SCATTER / MAY_BE / math.sqrt(runs)


def advice(axial_feeds: Sequence[float]) -> str:
    """Say which axial feeds per tooth would determine K_Fac; "" where those given, m, one a run, do."""
    if not axial_feeds or told_apart(axial_feeds):
        return ""
    wide, count = spread(axial_feeds), max(LEAST_RUNS, len(axial_feeds))
    apart = round(PER_UM * (max(axial_feeds) - min(axial_feeds)), 3)  # no feed is known to a nanometre
    beforehand = f"± {WIDE * MAY_BE / PER_MM:.2g} times K_Fae per mm"
    if wide * MAY_BE > SCATTER:
        now = f"give it ± {_two_digits(WIDE * SCATTER / wide / PER_MM)} (beforehand: {beforehand})"
    else:
        now = f"do not determine it better than is known beforehand ({beforehand})"
    return (
        f"axial feeds at least {PER_UM * needed(count):.2g} µm per tooth apart, in {count} runs; those of "
        f"the helical runs are {_two_digits(apart)} µm apart and {now}. A steeper helix or a narrower hole "
        "has larger ones"
    )


def _two_digits(value: float) -> str:
    return f"{float(f'{value:.2g}'):g}"
