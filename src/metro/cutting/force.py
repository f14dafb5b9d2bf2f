"""Cutting forces over a revolution, as a linear function of the cutting coefficients."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from metro.cutting.arcs import TURN
from metro.cutting.chip import Cut, chip_thickness
from metro.cutting.corners import raw_edges
from metro.cutting.cutter import Cutter
from metro.cutting.edges import Edges, edges, pieces
from metro.cutting.floor import floor_of
from metro.cutting.general import general_basis
from metro.cutting.law import EdgeLaw
from metro.cutting.passes import ALIKE, passes
from metro.cutting.quadrature import assembled
from metro.units import Array

__all__ = [
    "ANGLES",
    "COEFFICIENTS",
    "Cut",
    "chip_thickness",
    "force_basis",
    "mean_basis",
    "mean_force",
]

COEFFICIENTS = ("ktc", "krc", "kac", "kte", "kre", "kae")
ANGLES = 720


@lru_cache(maxsize=512)
def force_basis(
    cutter: Cutter, law: EdgeLaw, cut: Cut, true_path: bool = False, angles: int = ANGLES
) -> Array:
    """Force on the tool per unit of each coefficient over one revolution, feed frame.

    The edge is integrated to 1e-9 of the largest force (laws that are not linear: 1e-7), runout and true
    paths included (metro.cutting.edges). An edge that lags by less than one angular step (no helix: none) is
    averaged over that step, so that the table of an edge that enters at once has the right mean. On true
    paths the teeth are where runout puts them about the axis of rotation, at half the depth.

    Returns
    -------
    (angles, 3, 6) array: angle of tooth 0's tip from +y, evenly from 0 to 2π; axis; coefficient in the order
    of ``COEFFICIENTS`` (shear in N per N/m², edge in N per N/m of axial depth). Read-only: it is cached.
    """
    angle = TURN * np.arange(angles) / angles
    cutter = placed(cutter, cut, true_path)
    if not cutter.cylindrical:
        return _general_table(cutter, law, cut, true_path, angles)
    before = passes(cutter, cut, true_path, angle)
    if len(before.rows) == 1 and before.rows.shape[1] == 1 and angles % cutter.teeth == 0:
        angle = angle[: angles // cutter.teeth]  # all teeth are alike: one pitch of angles
    along = edges(cutter, cut, angle, step=TURN / angles)
    raw = raw_edges(cut.engagement, cutter.radius, true_path)
    pitch = assembled(pieces(before, raw, along), law, len(angle))
    basis = np.tile(pitch, (angles // len(angle), 1, 1))
    basis.flags.writeable = False
    return basis


def _general_table(cutter: Cutter, law: EdgeLaw, cut: Cut, true_path: bool, angles: int) -> Array:
    """Table of :func:`force_basis` of a cutter that is no cylinder, with its teeth where they are."""
    even = bool(np.ptp(cutter.pitch(1)) < ALIKE and not cutter.runout_radius and not any(cutter.reach))
    count = angles // cutter.teeth if even and angles % cutter.teeth == 0 else angles
    along = edges(cutter, cut, TURN * np.arange(count) / angles, step=TURN / angles)
    pitch = general_basis(cutter, law, cut, along, true_path=true_path)
    basis = np.tile(pitch, (angles // count, 1, 1))
    if cut.pitch:
        basis += lost_at_the_floor(cutter, law, cut, true_path, angles)
    basis.flags.writeable = False
    return basis


def lost_at_the_floor(cutter: Cutter, law: EdgeLaw, cut: Cut, true_path: bool, angles: int) -> Array:
    """Return what the floor of a helix takes from the table of a cylinder: rounded ends are far below it."""
    cylinder, level = replace(cutter, corner=0.0, taper=0.0), replace(cut, pitch=0.0)
    with_floor, without = (force_basis(cylinder, law, each, true_path, angles) for each in (cut, level))
    return np.asarray(with_floor - without)


def placed(cutter: Cutter, cut: Cut, true_path: bool) -> Cutter:
    """Return the cutter with its teeth where runout puts them at half the depth: on true paths only."""
    return cutter.about_axis(0.5 * cut.axial_depth) if true_path and cutter.runout_radius else cutter


def mean_basis(cutter: Cutter, law: EdgeLaw, cut: Cut, true_path: bool = False) -> Array:
    """Mean over a revolution of the force on the tool per unit of each coefficient, (3, 6), feed frame.

    Without runout every height of the edge goes through the same arc: exact, whatever the helix. With
    runout, a corner or a taper, or on a helical path, the mean of :func:`force_basis`.
    """
    if not cutter.cylindrical or cutter.runout_radius or any(cutter.reach) or cut.pitch:
        return np.asarray(force_basis(cutter, law, cut, true_path).mean(axis=0))
    before = passes(cutter, cut, true_path, np.zeros(1))
    top = np.full((1, cutter.teeth), 1.5 * math.pi)  # in the air
    around = Edges(top, TURN, cut.axial_depth / TURN, True, floor_of(cutter, cut))
    raw = raw_edges(cut.engagement, cutter.radius, true_path)
    return np.asarray(assembled(pieces(before, raw, around), law, 1)[0])


def mean_force(cutter: Cutter, law: EdgeLaw, cut: Cut, coefficients: Array) -> Array:
    """Mean force on the tool over a revolution, (3,) N, feed frame; ``coefficients`` (6,) SI."""
    return np.asarray(mean_basis(cutter, law, cut) @ coefficients)
