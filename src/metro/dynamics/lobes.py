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
from metro.dynamics.crossings import Candidates
from metro.dynamics.system import Cut, Structure
from metro.units import Array, ComplexArray

# Points per radian of the fastest vibration, further points per panel, and multiplier angles of the scan.
# Gauss points resolve an oscillation from 1/2 per radian on and converge exponentially beyond.
# The later efforts are for speeds at which the first one missed a crossing: peaks of the lobes, mostly.
_EFFORTS = ((0.65, 5, 14), (0.75, 8, 40), (0.9, 12, 120))
_EXTRA_POINTS = 6  # of the second resolution, which gives the result and, by its difference, the error


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

    Zero helix, linear regeneration: edge forces and process damping are not in it.
    """
    rpm = np.asarray(rpm, dtype=float)
    result = _nothing(rpm)
    if not collocation.panels_of(cut) or not len(structure.omega):
        return result
    parts: list[Candidates] = []
    for members in groups(structure, cut, rpm):
        group = members
        for effort in _EFFORTS:
            part = _solve(structure, cut, rpm[group], effort)
            again = _unstable_below(structure, cut, rpm[group], part.depth, effort)
            for name in ("depth", "chatter_hz", "kind", "error"):
                getattr(result, name)[group] = getattr(part, name)
            last = effort is _EFFORTS[-1]
            done = part.crossings.take(~again[part.crossings.speed] | last)
            parts.append(Candidates(group[done.speed], done.theta, done.inverse))
            group = group[again]
            if not len(group):
                break
    return replace(result, crossings=Candidates.join(parts))


def spectral_radius(structure: Structure, cut: Cut, rpm: Array, depth: Array) -> Array:
    """Largest modulus of the Floquet multipliers at speeds (k,) rev/min and axial depths (k,) m."""
    rpm, depth = np.broadcast_arrays(np.asarray(rpm, dtype=float), np.asarray(depth, dtype=float))
    arc = _arc(structure, cut, rpm, 2.0, _EXTRA_POINTS)
    return collocation.spectral_radius(_kernel(structure, cut, arc, rpm), depth)


def groups(structure: Structure, cut: Cut, rpm: Array) -> Iterator[np.ndarray]:
    """Yield indices of speeds that are solved as one stack: about as many points, at most 32 speeds."""
    need = np.ceil(_cycles(structure, cut, rpm) / 3.0)
    for value in np.unique(need):
        members = np.flatnonzero(need == value)
        yield from np.array_split(members, math.ceil(len(members) / 32))


def _cycles(structure: Structure, cut: Cut, rpm: Array) -> Array:
    """Highest angular frequency times tooth period: radians of vibration to resolve in a period."""
    radians: Array = structure.omega.max() * cut.tooth_period(rpm)
    return radians


def _arc(structure: Structure, cut: Cut, rpm: Array, per_radian: float, extra: int) -> Arc:
    """Points for the slowest of ``rpm``: ``per_radian`` of the fastest vibration, ``extra`` per panel."""
    radians = float(_cycles(structure, cut, rpm).max())
    points = [
        math.ceil(per_radian * radians * (end - start)) + extra
        for start, end, _ in collocation.panels_of(cut)
    ]
    return collocation.collocate(structure, cut, tuple(points))


def _kernel(structure: Structure, cut: Cut, arc: Arc, rpm: Array) -> Kernel:
    return collocation.kernel(structure, arc, cut.tooth_period(rpm))


def fine_kernel(structure: Structure, cut: Cut, rpm: Array) -> Kernel:
    """Discretise at the resolution of the boundary's first effort, for speeds of one group."""
    share, extra, _ = _EFFORTS[0]
    return _kernel(structure, cut, _arc(structure, cut, rpm, share, extra + _EXTRA_POINTS), rpm)


def _solve(structure: Structure, cut: Cut, rpm: Array, effort: tuple[float, int, int]) -> Boundary:
    """Scan at one resolution, refine there and at a second one, take the lowest."""
    share, extra, count = effort
    arcs = [_arc(structure, cut, rpm, share, points) for points in (extra, extra + _EXTRA_POINTS)]
    middle, fine = (_kernel(structure, cut, arc, rpm) for arc in arcs)
    first, _, good = crossings.refine(middle, crossings.scan(structure, middle, count), 4)
    last, shapes, converged = crossings.refine(fine, first, 3)
    converged &= good
    order = np.argsort(last.inverse)
    order = order[converged[order]]
    winner = np.full(len(rpm), -1)
    winner[last.speed[order]] = order  # the largest 1/depth of each speed is written last
    found, best = winner >= 0, winner[winner >= 0]
    result = replace(_nothing(rpm), crossings=last.take(order).distinct())
    result.depth[found] = 1.0 / last.inverse[best]
    result.error[found] = np.abs(1.0 / last.inverse[best] - 1.0 / first.inverse[best])
    theta = last.theta[best]
    result.kind[found] = np.where(np.abs(theta - np.pi) < 1e-6, "flip", "hopf")
    result.chatter_hz[found] = _chatter_hz(structure, arcs[1], fine.period[found], theta, shapes[best])
    return result


def _nothing(rpm: Array) -> Boundary:
    k, none = len(rpm), np.zeros(0)
    empty = Candidates(none.astype(int), none, none)
    return Boundary(
        rpm, np.full(k, np.inf), np.full(k, np.nan), np.full(k, "none", dtype=object), np.zeros(k), empty
    )


def _chatter_hz(structure: Structure, arc: Arc, period: Array, theta: Array, shape: ComplexArray) -> Array:
    """Frequency (k,) of the largest of the vibration's lines (theta + 2 pi j) / period, j integer."""
    if not len(theta):
        return theta
    highest = math.ceil(1.5 * structure.omega.max() * period.max() / (2.0 * np.pi)) + 1
    lines = theta[:, None] + 2.0 * np.pi * np.arange(-highest, highest + 1)
    force = np.exp(-1j * lines[:, :, None] * arc.time) @ ((shape * arc.weight)[:, :, None] * arc.force)
    omega = lines / period[:, None]
    amplitude = np.linalg.norm(structure.receptance(omega) * force, axis=2)
    strongest = np.take_along_axis(omega, amplitude.argmax(axis=1)[:, None], axis=1)[:, 0]
    return np.abs(strongest) / (2.0 * np.pi)


def _unstable_below(
    structure: Structure, cut: Cut, rpm: Array, depth: Array, effort: tuple[float, int, int]
) -> np.ndarray:
    """(k,) whether the cut is unstable a little below the boundary: then a crossing was missed."""
    # where nothing was found: at this depth the cut is as stiff as the structure
    stiff = structure.stiffness.min() / max(abs(cut.ktc), abs(cut.krc))
    below = np.where(np.isfinite(depth), 0.995 * depth, stiff)
    arc = _arc(structure, cut, rpm, effort[0], effort[1] + _EXTRA_POINTS)
    return collocation.spectral_radius(_kernel(structure, cut, arc, rpm), below) > 1.0 + 1e-6
