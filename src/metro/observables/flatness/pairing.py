"""Each predicted face and its scan: indices at the same points, under the same footprint."""

from __future__ import annotations

import math

import numpy as np

from metro.observables.problem import BaseFit, Block, Problem
from metro.observables.quantity import quantity
from metro.surface.pairing import INDICES, about_plane, indices_of, relative_deviation, similarity
from metro.units import JSON, MM, UM, Array

DRAWS = 400
PERCENT = 0.01


def paired(task: Problem, fit: BaseFit) -> dict[str, JSON]:
    """Return, by run, the predicted X_m, X_a, X_g at the compared points, and their agreement with the scan.

    ``pairing`` of a face: ``points``; ``rms`` of measured less predicted, each about its own plane;
    ``slope`` and ``correlation`` of measured over predicted deviations; ``relative_deviation``: median |D_r|
    of the points by both conventions; by index ``measured`` (less the contribution of the scanner's noise),
    ``relative_deviation`` by both conventions and ``similarity``.
    """
    return {
        block.run: _face(task, fit, block)
        for block in task.role("identify", "validate")
        if block.run in fit.nuisance
    }


def _face(task: Problem, fit: BaseFit, block: Block) -> JSON:
    design, offset = task.base.design(block, fit.nuisance[block.run], fit.beta)
    x, y = block.coordinates["x_mm"] * MM, block.coordinates["y_mm"] * MM
    rng = np.random.default_rng(0)
    simulated = about_plane(x, y, offset + design @ fit.beta)
    off = about_plane(x, y, _drawn(rng, fit.covariance, DRAWS) @ design.T)
    noise = about_plane(x, y, block.sigma * rng.standard_normal((DRAWS, len(block.sigma))))
    measured = about_plane(x, y, block.measured)
    own = indices_of(simulated)
    by_model, by_noise = indices_of(simulated + off), indices_of(simulated + noise)
    read = indices_of(measured) - (by_noise.mean(axis=0) - own)
    entry: JSON = {
        f"{name}_predicted": quantity(value / UM, sd / UM, "um", fit.dof)
        for name, value, sd in zip(INDICES, own, by_model.std(axis=0), strict=True)
    }
    pairing = _points(measured, simulated)
    for place, name in enumerate(INDICES):
        drawn = read[place] + by_noise[:, place] - by_noise[:, place].mean()
        sd = float(by_noise[:, place].std())
        pairing[name] = _index(read[place], sd, own[place], drawn, by_model[:, place])
    return entry | {"pairing": pairing}


def _drawn(rng: np.random.Generator, covariance: Array, count: int) -> Array:
    """Draws (count, p) of the coefficients' error; its covariance may be singular."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(
        (rng.standard_normal((count, len(values))) * np.sqrt(np.maximum(values, 0))) @ vectors.T
    )


def _points(measured: Array, simulated: Array) -> JSON:
    spread = float(simulated @ simulated)
    size = math.sqrt(spread * float(measured @ measured))
    known = spread > 0
    median = [float(np.nanmedian(np.abs(part))) for part in relative_deviation(measured, simulated)]
    return {
        "points": len(measured),
        "rms": quantity(float(np.sqrt(np.mean((measured - simulated) ** 2))) / UM, math.nan, "um"),
        "slope": float(measured @ simulated) / spread if known else None,
        "correlation": float(measured @ simulated) / size if known and size > 0 else None,
        "relative_deviation": _both(*(median if known else (math.nan, math.nan))),
    }


def _index(read: float, sd: float, own: float, drawn: Array, by_model: Array) -> JSON:
    alike = similarity(drawn, by_model) / PERCENT
    of_measured, of_simulated = relative_deviation(np.array([read]), np.array([own]))
    value = float(similarity(np.array([read]), np.array([own]))[0]) / PERCENT
    return {
        "measured": quantity(read / UM, sd / UM, "um"),
        "relative_deviation": _both(float(of_measured[0]), float(of_simulated[0])),
        "similarity": {
            "value": value if math.isfinite(value) else None,
            "ci95": [float(v) if math.isfinite(v) else None for v in np.quantile(alike, [0.025, 0.975])],
            "unit": "%",
        },
    }


def _both(of_measured: float, of_simulated: float) -> JSON:
    """D_r by both conventions, %: equation 8, and tables 6 and 7, of Iglesias et al. 2025."""
    pair = {"of_measured": of_measured, "of_simulated": of_simulated}
    return {name: value / PERCENT if math.isfinite(value) else None for name, value in pair.items()}
