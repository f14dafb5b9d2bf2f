"""Cutting forces over a revolution, as a linear function of the cutting coefficients."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from metro.cutting.arcs import arcs
from metro.cutting.chip import Cut, chip_thickness
from metro.cutting.corners import corners
from metro.cutting.cutter import Cutter
from metro.cutting.edges import TURN, Pieces, integrated, pieces
from metro.cutting.engagement import Engagement
from metro.cutting.general import general_basis
from metro.cutting.law import EdgeLaw
from metro.cutting.nearby import Edges, edges, nearby
from metro.cutting.passes import ALIKE, Passes, passes
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
def force_basis(cutter: Cutter, law: EdgeLaw, cut: Cut, true_path: bool = False) -> Array:
    """Force on the tool per unit of each coefficient over one revolution, feed frame.

    The edge is integrated to 1e-9 of the largest force (laws that are not linear: 1e-7), runout and true
    paths included (metro.cutting.edges). An edge that lags by less than one angular step (no helix: none) is
    averaged over that step, so that the table of an edge that enters at once has the right mean. On true
    paths the teeth are where runout puts them about the axis of rotation, at half the depth.

    Returns
    -------
    (ANGLES, 3, 6) array: angle of tooth 0's tip from +y, evenly from 0 to 2π; axis; coefficient in the order
    of ``COEFFICIENTS`` (shear in N per N/m², edge in N per N/m of axial depth). Read-only: it is cached.
    """
    angle = TURN * np.arange(ANGLES) / ANGLES
    cutter = placed(cutter, cut, true_path)
    if not cutter.cylindrical:
        return _general_table(cutter, law, cut, true_path)
    before = passes(cutter, cut, true_path, angle)
    if before.sine[0].size == 1 and ANGLES % cutter.teeth == 0:  # all teeth are alike: one pitch of angles
        angle = angle[: ANGLES // cutter.teeth]
    along = edges(cutter, cut, angle, step=TURN / ANGLES)
    pitch = assembled(engaged(before, cut.engagement, along), law, len(angle))
    basis = np.tile(pitch, (ANGLES // len(angle), 1, 1))
    basis.flags.writeable = False
    return basis


def _general_table(cutter: Cutter, law: EdgeLaw, cut: Cut, true_path: bool) -> Array:
    """Table of :func:`force_basis` of a cutter that is no cylinder, with its teeth where they are."""
    even = bool(np.ptp(cutter.pitch(1)) < ALIKE and not cutter.runout_radius and not any(cutter.reach))
    count = ANGLES // cutter.teeth if even and ANGLES % cutter.teeth == 0 else ANGLES
    along = edges(cutter, cut, TURN * np.arange(count) / ANGLES, step=TURN / ANGLES)
    pitch = general_basis(cutter, law, cut, along, true_path=true_path)
    basis = np.tile(pitch, (ANGLES // count, 1, 1))
    basis.flags.writeable = False
    return basis


def placed(cutter: Cutter, cut: Cut, true_path: bool) -> Cutter:
    """Return the cutter with its teeth where runout puts them at half the depth: on true paths only."""
    return cutter.about_axis(0.5 * cut.axial_depth) if true_path and cutter.runout_radius else cutter


def engaged(before: Passes, engagement: Engagement, along: Edges, aside: Array | float = 0.0) -> Pieces:
    """Return the engaged pieces of edges; ``aside`` (angles, 1) m displaces a tool on true paths along y."""
    near = nearby(along, before.sine.shape[1:])
    cut = corners(before, engagement, near, aside) if before.true_path else ()
    return pieces(before, arcs(before, engagement, along, cut), along, cut)


def mean_basis(cutter: Cutter, law: EdgeLaw, cut: Cut, true_path: bool = False) -> Array:
    """Mean over a revolution of the force on the tool per unit of each coefficient, (3, 6), feed frame.

    Without runout every height of the edge goes through the same arc: exact, whatever the helix. With
    runout, or a corner or a taper, the mean of :func:`force_basis`.
    """
    if not cutter.cylindrical:
        return np.asarray(force_basis(cutter, law, cut, true_path).mean(axis=0))
    before = passes(cutter, cut, true_path, np.zeros(1))
    if before.off_sine.any() or before.off_cosine.any():
        return np.asarray(force_basis(cutter, law, cut, true_path).mean(axis=0))
    top = np.full((1, cutter.teeth), 1.5 * math.pi)  # in the air
    around = Edges(top, TURN, cut.axial_depth / TURN)
    return np.asarray(assembled(engaged(before, cut.engagement, around), law, 1)[0])


def mean_force(cutter: Cutter, law: EdgeLaw, cut: Cut, coefficients: Array) -> Array:
    """Mean force on the tool over a revolution, (3,) N, feed frame; ``coefficients`` (6,) SI."""
    return np.asarray(mean_basis(cutter, law, cut) @ coefficients)


def assembled(cut: Pieces, law: EdgeLaw, angles: int) -> Array:
    """Force on the tool per unit of each coefficient, (angles, 3, 6), of pieces of edges (physics.md §2)."""
    integrals = integrated(cut, law, angles)
    basis = np.zeros((angles, 3, 6))
    for column in (0, 3):
        along_sine, along_cosine, whole = integrals[:, column : column + 3].T
        basis[:, 0, column], basis[:, 1, column] = -along_cosine, along_sine
        basis[:, 0, column + 1], basis[:, 1, column + 1] = -along_sine, -along_cosine
        basis[:, 2, column + 2] = whole
    return basis
