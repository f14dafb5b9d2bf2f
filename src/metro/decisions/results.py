"""Which results a tolerance is a limit of: a value with its interval, for each run or position."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pandas as pd

from metro.decisions.conformity import COVERAGE, Limits, Result, conformance_probability, decision
from metro.signals.orders import order_matrix
from metro.units import DEG, JSON, Array

ANGLES = 360
UM_PER_MM = 1e3

# where the result is → its value and interval, in the unit of the tolerance
Results = Iterator[tuple[str, Result]]


def decisions(manifest: JSON, identified: JSON, orders: pd.DataFrame) -> list[JSON]:
    """Judge every result of a batch that has a tolerance.

    Parameters
    ----------
    manifest : of the batch, with ``tolerances``. identified : content of ``identified.json``.
    orders : observed table of the forces' orders; empty where no force was recorded.

    Returns
    -------
    list of JSON
        ``quantity``, ``where`` (a run, or a position), ``value``, ``ci95``, ``unit``, ``lower``, ``upper``,
        ``decision``, ``probability`` (of conformance). A tolerance of which the batch has no result has an
        entry with the decision ``undecided`` and no value.
    """
    force = (manifest.get("instruments") or {}).get("dynamometer") or {}
    relative = float(force.get("expanded_uncertainty_percent") or 0.0) / 100.0
    found: dict[str, Callable[[], Results]] = {
        "flatness_um": lambda: _flatness(identified),
        "ra_um": lambda: _texture(identified, "Ra"),
        "rz_um": lambda: _texture(identified, "Rz"),
        "force_n": lambda: peak_forces(orders, relative),
        "wall_error_um": lambda: _walls(identified),
        "stable_depth_mm": lambda: _depths(identified),
    }
    judged: list[JSON] = []
    for name, entry in (manifest.get("tolerances") or {}).items():
        if name not in found:
            continue
        quantity, _, unit = name.rpartition("_")
        head = {"quantity": quantity, "unit": {"n": "N"}.get(unit, unit)}
        limits = Limits.of(entry)
        own = [
            {**head, "where": where, **_judged(result, limits), "lower": limits.lower, "upper": limits.upper}
            for where, result in found[name]()
        ]
        nothing = {"where": None, "value": None, "ci95": None, "decision": "undecided", "probability": None}
        judged += own or [{**head, **nothing, "lower": limits.lower, "upper": limits.upper}]
    return judged


def _judged(result: Result, limits: Limits) -> JSON:
    return {
        "value": result.value,
        "ci95": [result.low, result.high],
        "decision": decision(result, limits),
        "probability": conformance_probability(result, limits),
    }


def _flatness(identified: JSON) -> Results:
    """Minimum zone of each face, without what the noise of the scanner adds where that is known."""
    for run, face in (identified.get("faces") or {}).items():
        corrected = face.get("noise_corrected") or {}
        yield from _quantity(run, corrected.get("minimum_zone") or face.get("minimum_zone"))


def _texture(identified: JSON, name: str) -> Results:
    for run, trace in (identified.get("texture") or {}).items():
        yield from _quantity(run, trace.get(name))


def _walls(identified: JSON) -> Results:
    for run, wall in ((identified.get("arm") or {}).get("walls") or {}).items():
        yield from _quantity(run, wall.get("measured"), UM_PER_MM)


def _depths(identified: JSON) -> Results:
    for lobes in identified.get("lobes") or []:
        yield from _quantity(f"position {lobes['position']}", lobes.get("lowest_mm"))


def _quantity(where: str, entry: JSON | None, factor: float = 1.0) -> Results:
    """Yield a quantity of ``identified.json``, if it has a value."""
    if not entry or entry.get("value") is None:
        return
    low, high = (None if end is None else factor * float(end) for end in entry.get("ci95") or (None, None))
    yield where, Result(factor * float(entry["value"]), low, high)


def peak_forces(orders: pd.DataFrame, relative: float) -> Results:
    """Largest force in the plane of the feed over a revolution of each run, averaged over its record.

    The uncertainty is that of the average at the angle of the peak, and that of the calibration.

    Parameters
    ----------
    orders : ``run, block, axis, order, part, force_n, variance_n2``. relative : expanded uncertainty of the
        dynamometer as a share of the reading.
    """
    for run, rows in orders.groupby("run", sort=False) if len(orders) else ():
        highest = int(rows["order"].max())
        waves = order_matrix(np.arange(ANGLES) * 360.0 / ANGLES * DEG, highest)
        blocks = int(rows["block"].nunique())
        value, variance = (_mean_of_blocks(rows, column) for column in ("force_n", "variance_n2"))
        force, spread = waves @ value, waves**2 @ (variance / blocks)
        size = np.hypot(force[:, 0], force[:, 1])
        at = int(size.argmax())
        share = force[at] / max(float(size[at]), 1e-300)
        own = COVERAGE * float(np.sqrt(share**2 @ spread[at]))
        half = float(np.hypot(own, relative * size[at]))
        yield str(run), Result(float(size[at]), float(size[at]) - half, float(size[at]) + half)


def _mean_of_blocks(rows: pd.DataFrame, column: str) -> Array:
    """Average order coefficients (2H + 1, 2) of x and y over the time blocks of a run."""
    first = rows[rows["axis"].isin(["x", "y"])]
    by_block = [part[column].to_numpy(float).reshape(2, -1) for _, part in first.groupby("block")]
    return np.asarray(np.mean(by_block, axis=0).T)
