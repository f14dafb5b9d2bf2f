"""What ``identified.json`` says of one series of poses."""

from __future__ import annotations

import math

import numpy as np

from metro.observables.quantity import quantity
from metro.robot.calibration.ceiling import ceiling
from metro.robot.calibration.effects import COMPLIANCE, Effect
from metro.robot.calibration.fit import Fit
from metro.robot.calibration.held_out import HeldOut, median
from metro.robot.calibration.model import BASE, KINDS, names
from metro.robot.calibration.performance import repeated, spread
from metro.robot.calibration.poses import Poses
from metro.robot.calibration.rounding import moved_by_rounding
from metro.robot.calibration.study import STAGES, Calibration, sizes
from metro.units import JSON, MM, Array

MRAD = 1e-3
LENGTHS = ("length", "link offset")


def series_block(found: Calibration, held: tuple[HeldOut, ...], poses: Poses, target: Array) -> JSON:
    """Return all that is said of a series; ``target`` (m,): number of the commanded pose, or NaN."""
    final, known = found.final, found.determined
    target = target[poses.point == 0]
    measured = "distances" if poses.by_distance else "positions"
    labels, head = names(final.state), final.state.head
    left = ceiling(final, poses)
    step, rounded = moved_by_rounding(final, poses.first)
    return {
        "poses": len(np.unique(poses.first.pose)),
        "measured": measured,
        "rows": len(poses.first),
        "points": int(poses.point.max()) + 1,
        "scatter": {"value": final.scale / MM, "unit": "mm"},
        "noise": _noise(poses.first, target, rounded),
        **({"rounding": _rounding(step, rounded)} if rounded else {}),
        "condition": known.condition,
        "observability": known.o1 / MM,
        "redundant": [labels[place] for place in range(head, len(labels)) if not known.kept[place]],
        "tool": _tool(final),
        **({"stations": _stations(final)} if poses.by_distance else {}),
        "corrections": _corrections(found),
        "geometry": _by_joint(found),
        "effects": _effects(found, poses),
        "tried": [
            {
                "effect": one.label,
                "code": one.code,
                **({"joint": one.joint + 1} if one.joint >= 0 else {}),
                "gain": one.gain,
                "error": one.error,
                "p_value": one.luck,
                "kept": one.kept,
            }
            for one in found.found.trials
        ],
        "rivals": [list(pair) for pair in found.found.rivals],
        "errors": {one.kind: _of_held_out(one, poses) for one in held},
        "ceiling": {
            "parts": dict(left.parts),
            "share": left.share,
            "ci95": list(left.ci95),
            "noise_share": left.noise_share,
        },
        **_repeats(found, poses.first, target),
    }


def _rounding(step: Array, rounded: float) -> JSON:
    """Return the joints whose readings are rounded, to how much, and what that moves a coordinate by."""
    joints = {str(joint + 1): float(each) / MRAD for joint, each in enumerate(step) if each > 0.0}
    return {"steps": joints, "unit": "mrad", "moves": {"value": rounded / MM, "unit": "mm"}}


def _noise(poses: Poses, target: Array, rounded: float) -> JSON | None:
    """Return what a coordinate scatters by without any cause, mm.

    The spread of repeats; or that of the instrument, as stated, and of rounded readings.
    """
    stated = float(np.sqrt(np.mean(poses.sigma**2))) if bool((poses.sigma > 0.0).all()) else 0.0
    stated = float(np.hypot(stated, rounded)) if stated else 0.0
    repeats, freedom = spread(poses, target)
    if repeats > stated:
        return {"value": repeats / MM, "unit": "mm", "source": "repeats", "freedom": freedom}
    return {"value": stated / MM, "unit": "mm", "source": "instrument"} if stated else None


def _tool(fit: Fit) -> JSON:
    first = len(BASE)
    return _place(np.atleast_2d(fit.state.tool)[0], _deviations(fit)[first : first + 3])


def _stations(fit: Fit) -> list[JSON]:
    """Return where the stations of distances are, in the base frame of the rows."""
    first = fit.state.head - fit.state.stations.size
    sd = _deviations(fit)[first : fit.state.head].reshape(-1, 3)
    return [_place(at, each) for at, each in zip(fit.state.stations, sd, strict=True)]


def _place(at: Array, sd: Array) -> JSON:
    return {axis: quantity(float(at[k]) / MM, float(sd[k]) / MM, "mm") for k, axis in enumerate("xyz")}


def _deviations(fit: Fit) -> Array:
    """Return the standard deviation of each parameter of the geometry, (head + 5 n); 0 unless free."""
    sd = np.zeros(len(fit.free))
    sd[fit.free] = np.sqrt(np.diag(fit.covariance))[: int(fit.free.sum())]
    return sd


def _changes(found: Calibration) -> tuple[np.ndarray, Array]:
    """Return the places of the corrected parameters of rows, and their corrections, rad and m."""
    free = np.flatnonzero(found.final.free)
    own = free[free >= found.final.state.head]
    change = (found.final.state.rows - found.fits[0].state.rows).ravel()
    return own, change[own - found.final.state.head]


def _corrections(found: Calibration) -> JSON:
    labels = names(found.final.state)
    places, change = _changes(found)
    sd = _deviations(found.final)[places]
    return {
        labels[place]: _corrected(labels[place], float(value), float(each))
        for place, value, each in zip(places, change, sd, strict=True)
    }


def _corrected(label: str, change: float, sd: float) -> JSON:
    unit, name = (MM, "mm") if label.endswith(LENGTHS) else (MRAD, "mrad")
    return quantity(change / unit, sd / unit, name)


def _by_joint(found: Calibration) -> list[JSON]:
    """Return how likely the corrections of each joint are by chance, all of its row at once (Wald)."""
    from scipy.stats import chi2

    places, change = _changes(found)
    end = int(found.final.free.sum())
    own = slice(end - len(places), end)
    covariance = found.final.covariance[own, own]
    joint = (places - found.final.state.head) // len(KINDS)
    entries = []
    for one in np.unique(joint):
        mine = np.flatnonzero(joint == one)
        statistic = float(change[mine] @ np.linalg.solve(covariance[np.ix_(mine, mine)], change[mine]))
        entries.append({"joint": int(one) + 1, "p_value": float(chi2.sf(statistic, len(mine)))})
    return entries


def _effects(found: Calibration, poses: Poses) -> list[JSON]:
    final = found.final
    trials = {one.label: one for one in found.found.trials}
    entries = []
    for at, size in enumerate(sizes(final, poses)):
        effect, trial = size.effect, trials[size.effect.label]
        entries.append(
            {
                "effect": effect.code,
                "title": effect.label,
                **({"joint": effect.joint + 1} if effect.joint >= 0 else {}),
                "moves": least_zero(quantity(size.moves / MM, size.sd / MM, "mm")),
                "gain": trial.gain,
                "p_value": trial.luck,
                "parameters": _of_effect(final, at),
            }
        )
    return entries


def _of_effect(fit: Fit, at: int) -> JSON:
    """Return the named parameters of an effect with their intervals."""
    effect, place = fit.effects[at], fit.place(at)
    sd = np.sqrt(np.diag(fit.covariance))[place]
    found = {}
    for label, value, each in zip(effect.names, fit.values[at], sd, strict=False):
        unit, name = _unit(effect, label, fit.state.prismatic)
        found[label] = quantity(float(value) / unit, float(each) / unit, name)
    return found


def _unit(effect: Effect, label: str, prismatic: np.ndarray) -> tuple[float, str]:
    """Return the unit of a parameter: mm where it shifts a joint or the point, mm/m of a scale, else mrad."""
    if label == "scale":
        return 1e-3, "mm/m"
    if label == COMPLIANCE:
        return MRAD, "µrad/(N m)"  # of rad/(kN m)
    shifts = bool(prismatic[effect.joint]) if effect.joint >= 0 else label in ("x", "y", "z")
    return (MM, "mm") if shifts else (MRAD, "mrad")


def _repeats(found: Calibration, poses: Poses, target: Array) -> JSON:
    """Return the block of poses that were taken several times; empty without any."""
    figures = repeated(poses, target, found.fits)
    entries = []
    for one in figures:
        rp, low, high = (each / MM for each in one.repeatability)
        entry: JSON = {"target": one.target, "repeats": one.count}
        entry |= {
            f"ap_{stage}": least_zero(quantity(value / MM, one.accuracy_sd / MM, "mm"))
            for stage, value in zip(STAGES, one.accuracy, strict=True)
        }
        entry["rp"] = {"value": rp, "ci95": [low, high], "unit": "mm"}
        entry["vap"] = {
            "value": one.directional / MM if math.isfinite(one.directional) else None,
            "unit": "mm",
        }
        entries.append(entry)
    return {"repeats": entries} if entries else {}


def least_zero(size: JSON) -> JSON:
    """Return a quantity that cannot be below 0, its interval cut there."""
    return size | {"ci95": [None if end is None else max(0.0, end) for end in size["ci95"]]}


def _of_held_out(one: HeldOut, poses: Poses) -> JSON:
    found: JSON = {"poses": len(np.unique(poses.pose[one.which]))}
    for stage, distances in zip(STAGES, one.distances, strict=True):
        value, low, high = (each / MM for each in median(distances))
        found[stage] = {
            "median": {"value": value, "ci95": [low, high], "unit": "mm"},
            "p95": {"value": float(np.percentile(distances, 95)) / MM, "unit": "mm"},
        }
    return found
