"""Lobes of the cuts of a batch, with their band, and the probability that each run was unstable."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.cutting.cutter import Cutter
from metro.dynamics.by_depth import boundary_of_edge, depths_anew
from metro.dynamics.lobes import Boundary
from metro.dynamics.system import Cut, Edge, RawFace, immersion
from metro.dynamics.teeth import equal_teeth, mean_directional_factors
from metro.observables.cut import conditions as cutting_force
from metro.observables.problem import Refusal
from metro.observables.stability.chatter import LABELS
from metro.observables.stability.positions import Tip
from metro.units import DEG, JSON, MM, N_MM2, Array

SPEEDS = 80  # of a diagram
ORBIT_DIRECTIONS = 4  # of feed, over the half turn after which the cut repeats
_STEPS = 17  # of a tooth period, at which cuts are compared
SAMPLES = 600
ANEW, ANEW_EVERY = (
    6,
    8,
)  # number of samples solved anew, and the step between their speeds, to check the first-order solution
# Standard deviations of logarithms: of the depth, for influences that the model omits (helix, process
# damping, runout, the operator's threshold); of a coefficient without an interval.
MODEL_SD = 0.15
COEFFICIENT_SD = 0.03
LABEL_ERROR = 0.005  # probability that a label is wrong, at any depth


@dataclass(frozen=True)
class Cutting:
    """Tool and cutting coefficients of a batch.

    Attributes
    ----------
    ktc, krc : N/m²; the radial one is that in the plane, of an end that is not flat its mean over the height.
    sd : (2,) standard deviations of their logarithms.
    tool : the cutter with its teeth.
    edge : of an end that is not flat.
    """

    ktc: float
    krc: float
    sd: Array
    tool: Cutter
    edge: Edge | None = None


@dataclass(frozen=True)
class Lobes:
    """Lowest boundary over the directions in which a cut is fed, and its uncertainty.

    Attributes
    ----------
    tip, cuts, turns : structure; the cut in each direction of feed, and these directions (rad).
    boundary : at k speeds.
    which : (k,) index of the least stable cut.
    samples : (s, k) m, lowest depths under the uncertainty of modes and coefficients.
    anew : (r, j) ratio of some of the samples, at some speeds, to their exact solutions; NaN without a limit.
    """

    tip: Tip
    cuts: tuple[Cut, ...]
    turns: tuple[float, ...]
    boundary: Boundary
    which: np.ndarray
    samples: Array
    anew: Array = field(default_factory=lambda: np.ones((0, 0)))


def cutting(batch: Batch, identified: JSON) -> Cutting | Refusal:
    """Return the tool and the coefficients, declared or identified from the batch's forces."""
    tool = cutting_force.cutter(batch)
    if isinstance(tool, Refusal):
        return tool
    values = cutting_force.coefficients(batch, identified)
    if isinstance(values, Refusal):
        return values
    waveform = (identified.get("force") or {}).get("waveform") or {}
    sd = []
    for name in ("ktc", "krc"):
        interval = [end for end in (waveform.get(name) or {}).get("ci95") or () if end is not None]
        known = len(interval) == 2 and values[name] != 0
        sd.append((interval[1] - interval[0]) / (2 * 1.96 * abs(values[name])) if known else COEFFICIENT_SD)
    radial, edge = values["krc"] * N_MM2, None
    if not tool.cylindrical:
        edge = Edge(tool, radial, values["kac"] * N_MM2)
        radial = edge.radial(_usual_depth(batch))
    return Cutting(values["ktc"] * N_MM2, radial, np.array(sd), tool, edge)


def _usual_depth(batch: Batch) -> float:
    """Geometric mean of the axial depths of a batch's runs, m."""
    depths = batch.runs["axial_depth_mm"].to_numpy(float)
    return float(np.exp(np.mean(np.log(depths[depths > 0.0])))) * MM


def assumptions(batch: Batch) -> list[str]:
    """Return the assumptions of the prediction, for the report."""
    notes = [
        f"the probability allows for a model error of {100 * MODEL_SD:.0f} % of depth (one sd): "
        "zero helix, linear regeneration, no process damping, no runout"
    ]
    notes += _of_the_end(batch)
    if (batch.runs["operation"] == "helical").any():
        notes.append(
            "helical runs: slots whose feed direction turns; the lowest boundary over the directions counts, "
            "and the delay is the tooth period"
        )
    undirected = _undirected(batch.runs)
    if undirected.any():
        named = ", ".join(map(str, batch.runs.index[undirected]))
        notes.append(f"runs.csv: direction (up, down or slot) of {named} is blank: left out")
    return notes


def _of_the_end(batch: Batch) -> list[str]:
    """Say what the prediction takes of the tool's end."""
    tool = cutting_force.cutter(batch)
    if isinstance(tool, Refusal):
        return []
    if tool.cylindrical:
        return [] if cutting_force.end_declared(batch) else ["a flat end of the tool is assumed"]
    return [
        "corner, ball end and taper: the radial coefficient is K_rc sin κ - K_ac cos κ (κ: edge angle) with "
        "the means over the height of the cut at each depth of the boundary; in side cuts of up to the "
        "radius the raw face is met at each height by the radius there, in deeper ones by the full radius, "
        f"as in other methods and islands, which take the means at {_usual_depth(batch) / MM:.2g} mm"
    ]


def same_cut(runs: pd.DataFrame) -> list[pd.DataFrame]:
    """Group the runs that share one diagram: operation, direction, radial depth, feed direction.

    Runs of which nobody says in which direction they were cut have none.
    """
    keys = ["operation", "direction", "radial_depth_mm", "feed_direction_deg"]
    return [rows for _, rows in runs[~_undirected(runs)].groupby(keys, sort=False, dropna=False)]


def _undirected(runs: pd.DataFrame) -> pd.Series:
    """Return which runs have no direction; a hole needs none."""
    nobody_says = runs["direction"].isna() | (runs["direction"] == "")
    return nobody_says & (runs["operation"] != "helical")


def _directions(first: pd.Series) -> tuple[float, ...]:
    """Directions of feed in the frame of the modes, rad; several for a helix."""
    if first["operation"] == "helical":
        return tuple(np.arange(ORBIT_DIRECTIONS) * np.pi / ORBIT_DIRECTIONS)
    return (0.0 if pd.isna(first["feed_direction_deg"]) else float(first["feed_direction_deg"]) * DEG,)


def _cut(first: pd.Series, cutting: Cutting, turn: float) -> Cut:
    """Cut in the frame of the modes: its immersion is turned by the direction of feed."""
    direction = "slot" if first["operation"] == "helical" else str(first["direction"])
    diameter = 2 * cutting.tool.radius
    radial = diameter if pd.isna(first["radial_depth_mm"]) else first["radial_depth_mm"] * MM
    entry, leave = immersion(direction, radial, diameter)
    teeth, distance = len(cutting.tool.tooth_angles), 0.5 * diameter - radial
    face = None
    if direction != "slot" and distance > 0.0:
        face = RawFace(distance, (entry if direction == "up" else leave) - turn)
    return Cut(teeth, entry - turn, leave - turn, cutting.ktc, cutting.krc, edge=cutting.edge, face=face)


def _distinct(turned: list[tuple[float, Cut]]) -> tuple[tuple[float, ...], tuple[Cut, ...]]:
    """Drop directions with the effect of an earlier one: for a slot with four teeth all are the same."""
    kept: list[tuple[float, Cut]] = []
    known: list[Array] = []
    for turn, cut in turned:
        factors, _ = mean_directional_factors(equal_teeth(cut), np.zeros(1), _STEPS)
        if not any(np.allclose(factors, other, atol=1e-9 * np.abs(factors).max()) for other in known):
            kept.append((turn, cut))
            known.append(factors)
    turns, cuts = zip(*kept, strict=True)
    return turns, cuts


def cuts_of(first: pd.Series, cutting: Cutting) -> tuple[tuple[float, ...], tuple[Cut, ...]]:
    """Directions of feed, rad, that act differently on the modes, and the cut in each as set in ``first``."""
    return _distinct([(turn, _cut(first, cutting, turn)) for turn in _directions(first)])


def speeds_of(runs: pd.DataFrame, *, whole: bool) -> Array:
    """Speeds of the runs, rev/min; with the range about them for a ``whole`` diagram.

    This range is a tenth wider than that of the runs; for a single speed it is from a quarter of it to a
    quarter above it.
    """
    speeds = runs["spindle_rpm"].to_numpy(float)
    low, high = speeds.min(), speeds.max()
    margin = 0.1 * (high - low)
    ends = (low - margin, high + margin) if high > low else (0.25 * low, 1.25 * low)
    between = np.linspace(*ends, SPEEDS if whole else 0)
    return np.unique(np.concatenate([between, speeds]))


def solve(tip: Tip, cutting: Cutting, first: pd.Series, rpm: Array, *, check: bool) -> Lobes:
    """Lowest boundary over the directions of feed of a cut with the settings of ``first``.

    ``check``: also solve some of the samples exactly.
    """
    turns, cuts = cuts_of(first, cutting)
    sd = np.concatenate([tip.sd, cutting.sd])
    deviations = np.random.default_rng(1).normal(size=(SAMPLES, len(sd))) * np.where(np.isfinite(sd), sd, 0.0)
    found = [boundary_of_edge(tip.structure, cut, rpm) for cut in cuts]
    boundaries = [one.boundary() for one in found]
    samples = [one.samples(tip.structure, deviations) for one in found]
    which = np.argmin([one.depth for one in boundaries], axis=0)
    lobes = Lobes(tip, cuts, turns, _lowest(boundaries, which), which, np.min(samples, axis=0))
    if not check:
        return lobes
    some = slice(ANEW_EVERY // 2, None, ANEW_EVERY)
    solved = [depths_anew(tip.structure, cut, rpm[some], deviations[:ANEW]) for cut in cuts]
    exact, near = np.min(solved, axis=0), lobes.samples[:ANEW, some]
    limited = np.isfinite(exact) & np.isfinite(near) & (exact > 0.0) & (near > 0.0)
    return replace(lobes, anew=np.divide(near, exact, out=np.full(near.shape, np.nan), where=limited))


def _lowest(boundaries: list[Boundary], which: np.ndarray) -> Boundary:
    """Return the boundary that has, at each speed, the values of the one with index ``which``."""
    depth, chatter, error = (
        np.choose(which, [getattr(one, name) for one in boundaries])
        for name in ("depth", "chatter_hz", "error")
    )
    kind = np.array([one.kind for one in boundaries])[which, np.arange(len(which))]
    return replace(boundaries[0], depth=depth, chatter_hz=chatter, error=error, kind=kind)


def diagram(lobes: Lobes) -> pd.DataFrame:
    """Boundary with its bands: of modes and coefficients (5 to 95 %), and with the model's error (95 %)."""
    boundary = lobes.boundary
    scatter = np.random.default_rng(2).normal(size=(SAMPLES, 1)) * MODEL_SD
    band = np.quantile(lobes.samples * np.exp(scatter), [0.025, 0.975], axis=0, method="nearest")
    inner = np.quantile(lobes.samples, [0.05, 0.95], axis=0, method="nearest")
    finite = np.isfinite(boundary.depth)
    return pd.DataFrame(
        {
            "position": lobes.tip.position,
            "rpm": boundary.rpm,
            "depth_mm": boundary.depth / MM,
            "depth_lo_mm": np.minimum(band[0], boundary.depth) / MM,
            "depth_hi_mm": np.maximum(band[1], boundary.depth) / MM,
            "depth_p05_mm": inner[0] / MM,
            "depth_p95_mm": inner[1] / MM,
            "chatter_hz": boundary.chatter_hz,
            "kind": boundary.kind.astype(str),
            "error_mm": boundary.error / MM,
            "interpolated": lobes.tip.interpolated,
        }
    ).loc[finite]


def deepest(lobes: Lobes, runs: pd.DataFrame) -> float:
    """Depth (m) down to which all changes of stability are sought: about the range of the diagram."""
    depth = lobes.boundary.depth[np.isfinite(lobes.boundary.depth)]
    tested = float(runs["axial_depth_mm"].max()) * MM
    return min(max(2.5 * float(depth.min()), float(np.median(depth)), tested), 4.0 * float(depth.min()))


def worth(solved: list[Lobes]) -> list[str]:
    """Return a note on the error of the bands: samples to first order against their exact solutions."""
    ratios = [np.abs(np.log(one.anew[np.isfinite(one.anew)])) for one in solved]
    every = np.concatenate([*ratios, np.zeros(0)])
    if not len(every):
        return []
    median, most = 100.0 * np.quantile(every, [0.5, 0.95])
    return [
        f"the bands are of {SAMPLES} samples to first order in the parameters; {len(every)} depths solved "
        f"anew differ from theirs by {median:.2g} % in the median, by less than {most:.2g} % in 95 of 100"
    ]


def run_probabilities(batch: Batch, lobes: Lobes, runs: pd.DataFrame, measured: pd.DataFrame) -> pd.DataFrame:
    """Boundary and probability of chatter at each of the runs, whose speeds are among the boundary's.

    ``own_modes``: the modes are those of the run's pose. ``unstable`` is 1 or 0. With own modes it comes from
    the run's record if that is decided (``measured``, by run), else from the operator; −1 if neither says.
    """
    speeds = runs["spindle_rpm"].to_numpy(float)
    at = np.searchsorted(lobes.boundary.rpm, speeds)
    depth = runs["axial_depth_mm"].to_numpy(float) * MM
    labels = batch.runs.loc[runs.index, "stable"].astype(str).map(LABELS)
    here = runs["pose"].astype(str).isin(["", "nan", "None", lobes.tip.pose])
    unstable = measured["unstable"].reindex(runs.index).where(here).fillna(labels)
    return pd.DataFrame(
        {
            "run": runs.index.astype(str),
            "position": lobes.tip.position,
            "own_modes": here.to_numpy(),
            "rpm": speeds,
            "depth_mm": depth / MM,
            "boundary_mm": lobes.boundary.depth[at] / MM,
            "predicted_hz": lobes.boundary.chatter_hz[at],
            "unstable": unstable.fillna(-1).astype(int).to_numpy(),
            "probability_unstable": probability_unstable(depth, lobes.samples[:, at]),
        }
    )


def probability_unstable(depth: Array, boundary_samples: Array) -> Array:
    """Probability (k,) that depths (k,) are unstable, given samples (s, k) of the boundary."""
    from scipy.stats import norm

    distance = np.log(depth) - np.log(boundary_samples)
    probability: Array = norm.cdf(distance / MODEL_SD).mean(axis=0)
    return LABEL_ERROR + (1.0 - 2.0 * LABEL_ERROR) * probability
