"""The stiffness that the modes add up to, against the static one of the machine's table."""

from __future__ import annotations

import math
from collections.abc import Iterable

import pandas as pd

from metro.slips.slip import Slip
from metro.units import JSON

OBSERVABLES = ("lobes",)
# The modes that were measured make up most of the static compliance of a tip, and a static test and a hammer
# differ by preload and clearance. All gains that the table below holds are beyond this factor.
APART = 4.0
GAINS = {
    9.80665: "the response in g (response_unit: g in impacts.csv)",
    1000.0: "the response in mm/s² (write m/s²), or a hammer in kN (write N)",
    10.0: "the sensitivity of the accelerometer or the hammer, wrong by a factor of 10",
    100.0: "the sensitivity of the accelerometer or the hammer, wrong by a factor of 100",
    4.44822: "the hammer's force in lbf (write N)",
}
NEAR = 1.25  # factor within which a gain of the list is named as the likely one


def stiffness_slips(stations: pd.DataFrame, modes: Iterable[JSON]) -> tuple[Slip, ...]:
    """Compare 1 / Σ 1/k of the modes at each position and direction with the table of stations."""
    static = {
        (str(row["position"]), axis): 1e6 * float(row[f"k{axis}_n_um"])
        for row in stations.to_dict("records")
        for axis in "xyz"
    }
    compliance: dict[tuple[str, str], float] = {}
    for mode in modes:
        if (mode.get("stiffness") or {}).get("value"):  # a mode of no driving point has none
            key = str(mode["position"]).split("/")[0], str(mode["direction"])
            compliance[key] = compliance.get(key, 0.0) + 1.0 / float(mode["stiffness"]["value"])
    ratios = {
        key: 1.0 / (value * static[key])
        for key, value in compliance.items()
        if static.get(key, 0.0) > 0.0 and math.isfinite(static[key]) and value > 0.0
    }
    off = {key: ratio for key, ratio in ratios.items() if not 1.0 / APART <= ratio <= APART}
    if not off:
        return ()
    (position, axis), ratio = next(iter(off.items()))
    found = (
        f"position {position}, direction {axis}: the modes add up to a stiffness of "
        f"{1e-6 / compliance[position, axis]:.3g} N/µm, and the table of stations says "
        f"{1e-6 * static[position, axis]:.3g} N/µm; their ratio is {ratio:.3g}"
    )
    more = f", and alike in {len(off) - 1} more" if len(off) > 1 else ""
    return (Slip(OBSERVABLES, found + more, likely_gain(ratio), "impacts.csv", "response_unit"),)


def likely_gain(ratio: float) -> str:
    """Name the slips that make a receptance or a stiffness wrong by a factor, or what else to check."""
    factor = max(ratio, 1.0 / ratio)
    near = sorted(GAINS, key=lambda gain: abs(math.log(gain / factor)))
    named = [GAINS[gain] for gain in near if max(gain / factor, factor / gain) < NEAR]
    if not named:
        return "Check the sensitivities of hammer and accelerometer, and the unit of the table of stations"
    return f"Likely: {' or '.join(named[:2])}"
