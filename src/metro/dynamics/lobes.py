"""Stability lobes of milling: the lowest axial depth at which the cut chatters, against spindle speed.

All modes of both directions are solved together. The boundary at each speed is the lowest of all crossings
(:mod:`metro.dynamics.crossings`) of the collocated equation (:mod:`metro.dynamics.collocation`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from metro.dynamics import collocation, crossings
from metro.dynamics.collocation import Arc, Kernel
from metro.dynamics.crossings import Candidates, Refined
from metro.dynamics.system import Cut, Structure
from metro.units import Array, ComplexArray

# Points per radian of the fastest vibration, further points per panel, multiplier angles of the scan, and
# functions of its reduced equation per point.
# Gauss points resolve an oscillation from 1/2 per radian on and converge exponentially beyond.
# The later efforts are for speeds at which those before missed a crossing: peaks of the lobes, mostly. The
# second does not scan: it follows the multipliers that were found outside the unit circle.
_EFFORTS = ((0.65, 4, 5, 0.5), (0.65, 4, 0, 0.6), (0.75, 9, 30, 0.6), (0.9, 12, 120, 0.6))
_Effort = tuple[float, int, int, float]
_EXTRA_POINTS = 5  # from one resolution to the next; the difference is the error
_RESOLUTIONS, _TOLERANCE = 3, 1e-4  # at most, and the relative error that is good enough
_BELOW = (0.999, 0.88, 0.5)  # shares of a boundary at which the cut must be stable
_ASIDE = 0.1  # rad beside a multiplier's angle
_KEEP = 1.5  # crossings deeper than this many times the lowest cannot become it


@dataclass(frozen=True)
class Boundary:
    """Lowest stability boundary at k spindle speeds.

    Attributes
    ----------
    rpm : (k,) spindle speeds, rev/min.
    depth : (k,) axial depth, m; infinite where no depth is unstable.
    chatter_hz : (k,) frequency of the largest vibration at the boundary, Hz; NaN where there is none.
    kind : (k,) "hopf", "flip" or "none".
    error : (k,) change of ``depth`` between two resolutions, m: a bound on the discretisation's error.
    crossings : the lowest crossings of each speed and those little deeper, which a small change could make
        the lowest.
    """

    rpm: Array
    depth: Array
    chatter_hz: Array
    kind: np.ndarray
    error: Array
    crossings: Candidates


def stability_boundary(structure: Structure, cut: Cut, rpm: Array) -> Boundary:
    """Find the lowest axial depth at which the cut is unstable, at spindle speeds ``rpm`` (k,), rev/min.

    The structure may have modes of its own at each of them, and the process a damping.

    Zero helix, linear regeneration: edge forces are not in it.
    """
    rpm = np.asarray(rpm, dtype=float)
    result = _nothing(rpm)
    if not collocation.panels_of(cut) or not len(structure.axis):
        return result
    parts: list[Candidates] = []
    for members in groups(structure, cut, rpm):
        group, hints = members, result.crossings
        for effort in _EFFORTS:
            part, missed, hints = _solve(structure.at(group), cut.at(group), rpm[group], effort, hints)
            _enter(result, group, part)
            last = effort is _EFFORTS[-1]
            done = part.crossings.take(~missed[part.crossings.speed] | last)
            parts.append(replace(done, speed=group[done.speed]))
            group = group[missed]
            if not len(group):
                break
    return replace(result, crossings=Candidates.join(parts))


def spectral_radius(structure: Structure, cut: Cut, rpm: Array, depth: Array) -> Array:
    """Largest modulus of the Floquet multipliers at speeds (k,) rev/min and axial depths (k,) m."""
    rpm, depth = np.broadcast_arrays(np.asarray(rpm, dtype=float), np.asarray(depth, dtype=float))
    return collocation.spectral_radius(discretised(structure, cut, rpm, 2.0, _EXTRA_POINTS)[1], depth)


def groups(structure: Structure, cut: Cut, rpm: Array) -> Iterator[np.ndarray]:
    """Yield indices of speeds that are solved as one stack: about as many points, at most 64 speeds."""
    need = np.ceil(_cycles(structure, cut, rpm) / 3.0)
    for value in np.unique(need):
        members = np.flatnonzero(need == value)
        yield from np.array_split(members, math.ceil(len(members) / 64))


def _cycles(structure: Structure, cut: Cut, rpm: Array) -> Array:
    """Highest angular frequency times tooth period: radians of vibration to resolve in a period."""
    radians: Array = structure.omega.max(axis=-1) * cut.tooth_period(rpm)
    return radians


def discretised(
    structure: Structure, cut: Cut, rpm: Array, per_radian: float, extra: int
) -> tuple[Arc, Kernel]:
    """Discretise for the slowest of ``rpm``: points per radian of the fastest vibration, and per panel."""
    radians = float(_cycles(structure, cut, rpm).max())
    points = [
        math.ceil(per_radian * radians * (end - start)) + extra
        for start, end, _ in collocation.panels_of(cut)
    ]
    arc = collocation.collocate(structure, cut, tuple(points))
    return arc, collocation.kernel(structure, arc, cut.tooth_period(rpm))


def finely_discretised(structure: Structure, cut: Cut, rpm: Array) -> tuple[Arc, Kernel]:
    """Discretise at the second resolution of the boundary's first effort, for speeds of one group."""
    share, extra, *_ = _EFFORTS[0]
    return discretised(structure, cut, rpm, share, extra + _EXTRA_POINTS)


def _solve(
    structure: Structure, cut: Cut, rpm: Array, effort: _Effort, hints: Candidates
) -> tuple[Boundary, np.ndarray, Candidates]:
    """Scan at a low resolution, refine each speed at rising ones until two agree, take the lowest crossings.

    ``hints``: crossings that may be near, to be refined with those of the scan. What is returned beside the
    boundary is that of :func:`_missed`.
    """
    extra = effort[1]
    result, missed = _nothing(rpm), np.zeros(len(rpm), dtype=bool)
    near, outside = [result.crossings], [result.crossings]
    before = _roughly(structure, cut, rpm, effort, hints)
    speeds = np.arange(len(rpm))
    for resolution in range(_RESOLUTIONS):
        before = before.take(before.inverse > 0.0)
        before = before.take(before.distinct())
        extra += _EXTRA_POINTS
        here = structure.at(speeds)
        arc, equation = discretised(here, cut.at(speeds), rpm[speeds], effort[0], extra)
        refined = crossings.refine(equation, before, 2)
        part = _lowest(here, (arc, equation), rpm[speeds], refined, before)
        settled = (part.error <= _TOLERANCE * part.depth) | (resolution == _RESOLUTIONS - 1)
        missed[speeds], hints = _missed(equation, part, settled)
        _enter(result, speeds, part)
        done = part.crossings.take(settled[part.crossings.speed])
        near.append(replace(done, speed=speeds[done.speed]))
        outside.append(replace(hints, speed=speeds[hints.speed]))
        before, speeds = refined.at.among(np.flatnonzero(~settled)), speeds[~settled]
        if not len(speeds):
            break
    result = replace(result, crossings=Candidates.join(near))
    hints = Candidates.join([*near, *outside]).among(np.flatnonzero(missed))
    return result, missed, hints


def _roughly(structure: Structure, cut: Cut, rpm: Array, effort: _Effort, hints: Candidates) -> Candidates:
    """Crossings at the lowest resolution: those that the scan finds and those that ``hints`` lead to."""
    share, extra, count, functions = effort
    _, equation = discretised(structure, cut, rpm, share, extra)
    start = hints
    if count:
        cheap = collocation.reduced(equation, functions)
        scanned = crossings.scan(structure, cheap, count).near_lowest(_KEEP)
        start = Candidates.join([scanned.take(scanned.distinct()), hints])
    return crossings.refine(equation, start, 5).at


def _lowest(
    structure: Structure, discrete: tuple[Arc, Kernel], rpm: Array, refined: Refined, before: Candidates
) -> Boundary:
    """Boundary of the lowest crossing of each speed; its error is the change from ``before``."""
    arc, equation = discrete
    rising = _rising(refined)
    winner = np.full(len(rpm), -1)
    winner[refined.at.speed[rising]] = rising  # the largest 1/depth of each speed is written last
    hit, best = winner >= 0, winner[winner >= 0]
    result = replace(_nothing(rpm), crossings=refined.at.take(rising))
    theta = refined.at.theta[best]
    result.depth[hit] = 1.0 / refined.at.inverse[best]
    result.error[hit] = np.abs(refined.at.inverse[best] / before.inverse[best] - 1.0) * result.depth[hit]
    result.kind[hit] = kind(theta)
    result.chatter_hz[hit] = chatter_hz(
        structure.at(hit), arc.at(hit), equation.period[hit], theta, refined.shape[best]
    )
    return result


def _enter(whole: Boundary, speeds: np.ndarray, part: Boundary) -> None:
    """Write what is known of some speeds, but for the crossings, into the boundary of all."""
    for name in ("depth", "chatter_hz", "kind", "error"):
        getattr(whole, name)[speeds] = getattr(part, name)


def _rising(refined: Refined) -> np.ndarray:
    """Return the indices of the crossings at which Newton's method converged, by rising 1/depth."""
    order = np.argsort(refined.at.inverse)
    rising: np.ndarray = order[refined.converged[order]]
    return rising


def _nothing(rpm: Array) -> Boundary:
    k, none = len(rpm), np.zeros(0)
    empty = Candidates(none.astype(int), none, none)
    return Boundary(
        rpm, np.full(k, np.inf), np.full(k, np.nan), np.full(k, "none", dtype=object), np.zeros(k), empty
    )


def kind(theta: Array) -> np.ndarray:
    """Return "flip" where a multiplier of angle ``theta`` is -1, else "hopf"."""
    return np.where(np.abs(theta - np.pi) < 1e-6, "flip", "hopf")


def chatter_hz(structure: Structure, arc: Arc, period: Array, theta: Array, shape: ComplexArray) -> Array:
    """Frequency (k,) of the largest of the vibration's lines (theta + 2 pi j) / period, j integer."""
    if not len(theta):
        return theta
    highest = math.ceil(1.5 * structure.omega.max() * period.max() / (2.0 * np.pi)) + 1
    lines = theta[:, None] + 2.0 * np.pi * np.arange(-highest, highest + 1)
    acting = shape * (1.0 - np.where(arc.rate, 0.0, np.exp(-1j * theta)[:, None])) * arc.weight
    force = np.exp(-1j * lines[:, :, None] * arc.time) @ (acting[:, :, None] * arc.force)
    omega = lines / period[:, None]
    amplitude = np.linalg.norm((structure.receptance(omega) @ force[..., None])[..., 0], axis=2)
    strongest = np.take_along_axis(omega, amplitude.argmax(axis=1)[:, None], axis=1)[:, 0]
    return np.abs(strongest) / (2.0 * np.pi)


def _missed(equation: Kernel, boundary: Boundary, asked: np.ndarray) -> tuple[np.ndarray, Candidates]:
    """Return where a crossing was missed: where there is none, or the cut is unstable below it.

    Only speeds under the mask ``asked`` are looked at.

    Returns
    -------
    (k,) whether, and the multipliers that are outside the unit circle: the crossing is not far from them.
    """
    known = np.isfinite(boundary.depth)
    missed = asked & ~known
    # where nothing was found, the cut may be unstable at the depths of other speeds
    tried = np.where(known, boundary.depth, boundary.depth[known].max(initial=0.0))
    speeds = np.tile(np.flatnonzero(asked), len(_BELOW))
    depth = np.repeat(_BELOW, np.count_nonzero(asked)) * tried[speeds]
    doubt = ~collocation.surely_stable(equation.take(speeds), depth)
    speeds, depth = speeds[doubt], depth[doubt]
    multipliers = collocation.multipliers(equation.take(speeds), depth)
    largest = multipliers[np.arange(len(multipliers)), np.abs(multipliers).argmax(axis=1)]
    beyond = np.abs(largest) > 1.0 + 1e-6
    speeds, theta, inverse = speeds[beyond], np.abs(np.angle(largest[beyond])), 1.0 / depth[beyond]
    missed[speeds] = True
    # to either side too: an island starts with one crossing and ends with another
    asides = (-_ASIDE, 0.0, _ASIDE)
    return missed, Candidates.join([Candidates(speeds, theta + aside, inverse) for aside in asides])
