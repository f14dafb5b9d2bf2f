"""Lobes of the cuts that a batch made, with their band, and the probability that each run was unstable."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.dynamics.band import depth_samples
from metro.dynamics.lobes import Boundary, stability_boundary
from metro.dynamics.system import Cut, Structure, immersion
from metro.observables import cutting_force
from metro.observables.problem import Refusal
from metro.units import DEG, JSON, MM, N_MM2, Array

SPEEDS = 80  # of a diagram
ORBIT_DIRECTIONS = 4  # of feed, over the half turn after which the cut repeats itself
SAMPLES = 400
# Standard deviations of logarithms: of the depth, for what the model leaves out (helix, process damping,
# runout, the operator's threshold); of a coefficient that comes without its interval.
MODEL_SD = 0.15
COEFFICIENT_SD = 0.03
LABEL_ERROR = 0.005  # probability that a label is wrong whatever the depth


@dataclass(frozen=True)
class Tip:
    """Structure at a position; ``sd`` (3 m,) of the logarithms of omega, zeta, stiffness."""

    position: str
    structure: Structure
    sd: Array


@dataclass(frozen=True)
class Cutting:
    """Tool and cutting coefficients of a batch.

    Attributes
    ----------
    ktc, krc : N/m².
    sd : (2,) standard deviations of their logarithms.
    teeth : number of teeth.
    diameter : m.
    """

    ktc: float
    krc: float
    sd: Array
    teeth: int
    diameter: float


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
    return Cutting(
        values["ktc"] * N_MM2, values["krc"] * N_MM2, np.array(sd), len(tool.tooth_angles), 2 * tool.radius
    )


def tips(modes: pd.DataFrame, notes: list[str]) -> list[Tip]:
    """Structures of the positions: x and y of the tool; with modes in x and z alone, z stands for y."""
    tips = []
    for position, rows in modes[modes["used"].astype(bool)].groupby("position", sort=False):
        letters = [str(d).lstrip("+-") for d in rows["direction"]]
        second = "y" if "y" in letters or "z" not in letters else "z"
        if second == "z":
            notes.append(
                f"position {position}: modes in x and z: z is taken as the second direction of cutting"
            )
        notes += [
            f"position {position}: no modes in {d}: rigid there" for d in ("x", second) if d not in letters
        ]
        inside = np.isin(letters, ["x", second])
        kept = rows[inside]
        if kept.empty:
            continue
        axis = np.array([0 if letter == "x" else 1 for letter in np.array(letters)[inside]])
        omega = 2 * np.pi * kept["frequency_hz"].to_numpy(float)
        zeta, stiffness = kept["damping"].to_numpy(float), kept["stiffness_n_m"].to_numpy(float)
        relative = [
            kept["frequency_sd_hz"] / kept["frequency_hz"],
            kept["damping_sd"] / kept["damping"],
            kept["stiffness_sd"] / kept["stiffness_n_m"],
        ]
        tips.append(Tip(str(position), Structure(axis, omega, zeta, stiffness), np.concatenate(relative)))
    return tips


def assumptions(batch: Batch) -> list[str]:
    """Return what the prediction takes for granted, for the report."""
    notes = [
        f"the probability allows for a model error of {100 * MODEL_SD:.0f} % of depth (one sd): "
        "zero helix, linear regeneration, no process damping, no runout"
    ]
    if (batch.runs["operation"] == "helical").any():
        notes.append(
            "helical runs: slots whose feed direction turns; the lowest boundary over the directions counts, "
            "and the delay is the tooth period"
        )
    return notes


def pairs(batch: Batch, tips: list[Tip], notes: list[str]) -> list[tuple[pd.DataFrame, Tip]]:
    """Pair the runs of each pose with its structure; one structure alone serves every pose."""
    runs = batch.runs[(batch.runs["axial_depth_mm"] > 0) & (batch.runs["spindle_rpm"] > 0)]
    if len(tips) == 1:
        tip = tips[0]
        away = [
            str(p) for p in runs["pose"].unique() if str(p) not in ("", "nan", tip.position.split("/")[0])
        ]
        if away:
            notes.append(f"the modes of position {tip.position} are used at pose {', '.join(away)} too")
        return [(runs, tip)] if len(runs) else []
    pairs = [(runs[runs["pose"].astype(str) == tip.position.split("/")[0]], tip) for tip in tips]
    return [(rows, tip) for rows, tip in pairs if len(rows)]


def same_cut(runs: pd.DataFrame) -> list[pd.DataFrame]:
    """Group the runs that share one diagram: operation, direction, radial depth, feed direction."""
    keys = ["operation", "direction", "radial_depth_mm", "feed_direction_deg"]
    return [rows for _, rows in runs.groupby(keys, sort=False, dropna=False)]


def _cuts(first: pd.Series, cutting: Cutting) -> list[Cut]:
    """Cuts in the frame of the modes, turned by the feed direction; several for a helix."""
    helical = first["operation"] == "helical"
    direction = "slot" if helical else str(first["direction"])
    radial = cutting.diameter if pd.isna(first["radial_depth_mm"]) else first["radial_depth_mm"] * MM
    entry, leave = immersion(direction, radial, cutting.diameter)
    feed = 0.0 if pd.isna(first["feed_direction_deg"]) else float(first["feed_direction_deg"])
    turns = np.arange(ORBIT_DIRECTIONS) * np.pi / ORBIT_DIRECTIONS if helical else np.array([feed * DEG])
    return [
        Cut(cutting.teeth, entry - float(turn), leave - float(turn), cutting.ktc, cutting.krc)
        for turn in turns
    ]


def diagram(
    batch: Batch, found: Cutting, tip: Tip, runs: pd.DataFrame, *, whole: bool
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Lobes over the range of the runs' speeds, or at those speeds alone, and the probability of each run."""
    speeds = runs["spindle_rpm"].to_numpy(float)
    low, high = speeds.min(), speeds.max()
    margin = 0.1 * (high - low) if high > low else 0.2 * low
    between = np.linspace(low - margin, high + margin, SPEEDS if whole else 0)
    rpm = np.unique(np.concatenate([between, speeds]))
    cuts = _cuts(runs.iloc[0], found)
    boundary, samples = _lowest_over(tip, cuts, rpm, found.sd)
    scatter = np.random.default_rng(2).normal(size=(SAMPLES, 1)) * MODEL_SD
    band = np.quantile(samples * np.exp(scatter), [0.025, 0.975], axis=0, method="nearest")
    diagram = pd.DataFrame(
        {
            "position": tip.position,
            "rpm": rpm,
            "depth_mm": boundary.depth / MM,
            "depth_lo_mm": np.minimum(band[0], boundary.depth) / MM,
            "depth_hi_mm": np.maximum(band[1], boundary.depth) / MM,
            "chatter_hz": boundary.chatter_hz,
            "kind": boundary.kind.astype(str),
        }
    )
    at = np.searchsorted(rpm, speeds)
    depth = runs["axial_depth_mm"].to_numpy(float) * MM
    labels = batch.runs.loc[runs.index, "stable"].astype(str)
    rows = pd.DataFrame(
        {
            "run": runs.index.astype(str),
            "position": tip.position,
            "rpm": speeds,
            "depth_mm": depth / MM,
            "boundary_mm": boundary.depth[at] / MM,
            "unstable": labels.map({"no": 1, "yes": 0}).fillna(-1).astype(int).to_numpy(),
            "probability_unstable": probability_unstable(depth, samples[:, at]),
        }
    )
    return diagram[np.isfinite(diagram["depth_mm"])], rows


def probability_unstable(depth: Array, boundary_samples: Array) -> Array:
    """Probability (k,) that depths (k,) are unstable, given samples (s, k) of the boundary."""
    from scipy.stats import norm

    distance = np.log(depth) - np.log(boundary_samples)
    probability: Array = norm.cdf(distance / MODEL_SD).mean(axis=0)
    return LABEL_ERROR + (1.0 - 2.0 * LABEL_ERROR) * probability


def _lowest_over(tip: Tip, cuts: list[Cut], rpm: Array, coefficient_sd: Array) -> tuple[Boundary, Array]:
    """Lowest boundary over the cuts, and samples (s, k) of it under the given uncertainty."""
    sd = np.concatenate([tip.sd, coefficient_sd])
    deviations = np.random.default_rng(1).normal(size=(SAMPLES, len(sd))) * np.where(np.isfinite(sd), sd, 0.0)
    lowest, samples = None, np.full((SAMPLES, len(rpm)), np.inf)
    for cut in cuts:
        boundary = stability_boundary(tip.structure, cut, rpm)
        samples = np.minimum(samples, depth_samples(tip.structure, cut, boundary, deviations))
        lowest = boundary if lowest is None else _lower(lowest, boundary)
    assert lowest is not None  # there is at least one cut
    return lowest, samples


def _lower(a: Boundary, b: Boundary) -> Boundary:
    deeper = a.depth > b.depth
    chosen = {
        name: np.where(deeper, getattr(b, name), getattr(a, name))
        for name in ("depth", "chatter_hz", "kind", "error")
    }
    return replace(a, **chosen)
