"""A machine that yields to the cut: the chip that a tooth meets depends on where the tip was in earlier passes.

Quasi-static regeneration ([T] eq. 10, 11, figure 6; physics.md §2): the tip is displaced by q = K⁻¹ F, and the
chip gains q(t) − q(t − T) towards the tooth. Within one tooth passing the surfaces met are all in the past, so
its angles are solved at once: at each the force on a two-dimensional spring, linear while the teeth stay in cut.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.cutting.cutter import Cutter
from metro.cutting.force import COEFFICIENTS, Cut
from metro.cutting.law import EdgeLaw
from metro.observables import cutting_force
from metro.observables.force import recorded
from metro.observables.problem import Refusal
from metro.robot import stations as tabulated
from metro.robot.kinematics import rotation
from metro.units import DEG, JSON, MM, N_UM, Array

ANGLES = 720
SLICES_PER_RADIAN = 60
TOLERANCE = 1e-6  # of the largest rigid force: [T]'s allowed difference e
LIMIT = 200  # iterations per tooth passing
HALVINGS = 30
# The edge force sets in over this share of the feed per tooth. With a jump there would be no balance where the
# edge force alone pushes a tooth out of the cut that it needs for that force.
CONTACT = 0.01
DIFFERENCE = 1e-9  # m, of the chip thickness, for the slope of a force law
REVOLUTIONS = 6
HELIX_DIRECTIONS = (0.0, 45.0, 90.0, 135.0)

Scheme = Literal["newton", "fixed_point"]
Response = Callable[[Array], tuple[Array, Array]]
Solution = tuple[Array, int, float]


class NotConvergedError(RuntimeError):
    """Force and deflection found no balance: ``iterations`` made, ``residual`` max|F′ − F| left, N."""

    def __init__(self, scheme: str, iterations: int, residual: float) -> None:
        super().__init__(f"{scheme}: force and deflection differ by {residual:.3g} N after {iterations} iterations")
        self.iterations = iterations
        self.residual = residual


@dataclass(frozen=True, eq=False)
class Yielding:
    """A converged cut from first contact on; the tip was at rest in the passes before.

    Attributes
    ----------
    force : (revolutions × ANGLES, 3) N on the tool, feed frame. rigid : the same of a tool that does not yield.
    deflection : (revolutions × ANGLES, 2) m.
    iterations : most that one tooth passing took. residual : largest max|F′ − F| left, N.
    """

    force: Array
    rigid: Array
    deflection: Array
    iterations: int
    residual: float


@dataclass(frozen=True, eq=False)
class _Edges:
    """Elements of the edges at some angles: sine and cosine of immersion, and engaged depth, each (B, H, N)."""

    law: EdgeLaw
    coefficients: Array
    contact: float
    sine: Array
    cosine: Array
    depth: Array

    def at(self, index: slice) -> _Edges:
        """Return those of some angles."""
        parts = self.sine[index], self.cosine[index], self.depth[index]
        return _Edges(self.law, self.coefficients, self.contact, *parts)

    def towards(self, deflection: Array) -> Array:
        """Displacement (B, H, N) of each element outwards, of a tip displaced by (B, 2)."""
        return self.sine * deflection[:, 0, None, None] + self.cosine * deflection[:, 1, None, None]

    def force(self, thickness: Array) -> Array:
        """Force (B, 3) on the tool for chip thicknesses (B, H, N)."""
        tangential, radial, axial = self._per_direction(thickness)
        along = -tangential * self.cosine - radial * self.sine
        across = tangential * self.sine - radial * self.cosine
        return np.stack([along.sum((1, 2)), across.sum((1, 2)), axial.sum((1, 2))], axis=1)

    def slope(self, thickness: Array) -> Array:
        """Derivative (B, 2, 2) of the force in the plane by the displacement of the tip."""
        ahead, here = self._per_direction(thickness + DIFFERENCE), self._per_direction(thickness)
        tangential, radial, _ = (ahead - here) / DIFFERENCE
        push = np.stack([-tangential * self.cosine - radial * self.sine, tangential * self.sine - radial * self.cosine])
        return np.einsum("ibhn,jbhn->bij", push, np.stack([self.sine, self.cosine]))

    def _per_direction(self, thickness: Array) -> Array:
        """Tangential, radial and axial force of each element, (3, B, H, N)."""
        shear = self.law.shear(np.maximum(thickness, 0.0)) * self.depth
        edge = np.clip(thickness / self.contact, 0.0, 1.0) * self.depth
        return np.multiply.outer(self.coefficients[:3], shear) + np.multiply.outer(self.coefficients[3:], edge)


def yielding_force(
    cutter: Cutter,
    law: EdgeLaw,
    cut: Cut,
    coefficients: Array,
    stiffness: Array,
    revolutions: int = REVOLUTIONS,
    scheme: Scheme = "newton",
) -> Yielding:
    """Force of the peripheral edges on a tool whose tip yields, from first contact on.

    A tooth meets the surface that all earlier passes left, so one that was pushed out of the cut leaves its chip
    to the next. The work is as a rigid tool left it, the chip full at the first angle.

    Parameters
    ----------
    coefficients : (6,) SI, in the order of ``COEFFICIENTS``. stiffness : (2, 2) N/m, feed frame.
    scheme : ``newton``, with halved steps where a tooth leaves the cut, or ``fixed_point`` ([T] figure 6): the
        force at a deflection gives the next deflection.

    Raises
    ------
    NotConvergedError
        If in some tooth passing max|F′ − F| does not fall below ``TOLERANCE`` of the largest rigid force.
    """
    edges, reach = _edges(cutter, law, cut, coefficients)
    travel = cut.feed_per_tooth * cutter.teeth / (2.0 * math.pi)
    steps = cutter.pitch(1) * ANGLES / (2.0 * math.pi)
    # surface left by each tooth at each angle, as a radius about the axis of rotation; the first revolution is rigid
    left = np.concatenate([_rigid_surface(cutter, edges, reach, travel), np.empty((revolutions * ANGLES, *reach.shape))])
    rigid = edges.force(reach - _met(left[:ANGLES], np.arange(ANGLES), steps, edges, travel))
    compliance, tolerance = np.linalg.inv(stiffness), TOLERANCE * float(np.abs(rigid).max())
    solve = {"newton": _newton, "fixed_point": _fixed_point}[scheme]
    force, deflection = np.empty((revolutions * ANGLES, 3)), np.empty((revolutions * ANGLES, 2))
    block, most, residual = math.floor(steps.min() + 1e-9), 0, 0.0
    for start in range(0, len(force), block):
        at = np.arange(start, min(start + block, len(force)))
        here = edges.at(at % ANGLES)
        met = _met(left, at + ANGLES, steps, here, travel)
        response = _response(here, reach - met, compliance)
        plane, iterations, error = solve(response, rigid[at % ANGLES, :2], tolerance)
        if error > tolerance:
            raise NotConvergedError(scheme, iterations, error)
        deflection[at] = plane @ compliance.T
        reached = reach + here.towards(deflection[at])
        force[at], left[at + ANGLES] = here.force(reached - met), np.maximum(met, reached)
        most, residual = max(most, iterations), max(residual, error)
    return Yielding(force, np.tile(rigid, (revolutions, 1)), deflection, most, residual)


def ratios(cutter: Cutter, law: EdgeLaw, cut: Cut, coefficients: Array, stiffness: Array) -> tuple[float, float]:
    """Factors by which errors of the fixed-point scheme grow per iteration, and entry transients per tooth.

    With G = ∂F/∂q K⁻¹ at the rigid force the scheme maps an error e to G e: it diverges where an eigenvalue of G
    exceeds one. A tooth passing maps a difference to the steady force to −(I − G)⁻¹ G of itself. The largest over
    a revolution of each; exact for a law linear in the chip, equal pitch and teeth that stay in cut.
    """
    edges, reach = _edges(cutter, law, cut, coefficients)
    travel = cut.feed_per_tooth * cutter.teeth / (2.0 * math.pi)
    left = _rigid_surface(cutter, edges, reach, travel)
    met = _met(left, np.arange(ANGLES), cutter.pitch(1) * ANGLES / (2.0 * math.pi), edges, travel)
    # past the onset of the edge force, which is of no weight in steady cutting
    gain = edges.slope(np.where(reach > met, reach - met + cut.feed_per_tooth, -1.0)) @ np.linalg.inv(stiffness)
    eigenvalues = np.linalg.eigvals(gain)
    return float(np.abs(eigenvalues).max()), float(np.abs(eigenvalues / (1.0 - eigenvalues)).max())


def _edges(cutter: Cutter, law: EdgeLaw, cut: Cut, coefficients: Array) -> tuple[_Edges, Array]:
    """Elements of the edges over a revolution, and how far each reaches beyond the radius, (H, N) m."""
    lag = cutter.lag_per_depth * cut.axial_depth
    slices = max(4, math.ceil(SLICES_PER_RADIAN * lag))
    height = (np.arange(slices) + 0.5) * cut.axial_depth / slices
    angle = 2.0 * math.pi * np.arange(ANGLES)[:, None, None] / ANGLES
    immersion = angle - cutter.lag_per_depth * height[:, None] + np.asarray(cutter.tooth_angles)
    middle, half = (cut.engagement.exit + cut.engagement.entry) / 2, (cut.engagement.exit - cut.engagement.entry) / 2
    # an element stands for a window, of its helix or of the angular step, of which some share is engaged
    window = max(2.0 * math.pi / ANGLES, lag / slices)
    offset = np.mod(immersion - middle + math.pi, 2.0 * math.pi) - math.pi
    low, high = np.maximum(offset - window / 2, -half), np.minimum(offset + window / 2, half)
    share = np.maximum(high - low, 0.0) / window
    immersion = np.where(share > 0.0, middle + 0.5 * (low + high), immersion)
    depth = share * cut.axial_depth / slices
    contact = CONTACT * cut.feed_per_tooth
    edges = _Edges(law, coefficients, contact, np.sin(immersion), np.cos(immersion), depth)
    return edges, cutter.radius_deviation(height).T


def _rigid_surface(cutter: Cutter, edges: _Edges, reach: Array, travel: float) -> Array:
    """Surface that each tooth of a rigid tool leaves behind: the farthest that it and the N − 1 before reached."""
    passes = [
        np.roll(reach, -m, axis=1) - travel * cutter.pitch(m) * edges.sine for m in range(1, cutter.teeth)
    ]
    return np.max(np.stack([np.broadcast_to(reach, edges.sine.shape), *passes]), axis=0)


def _met(left: Array, at: np.ndarray, steps: Array, edges: _Edges, travel: float) -> Array:
    """Surface (B, H, N) that each tooth meets: what the tooth before it left a pitch ago, less the feed since.

    ``steps`` (N,) is the pitch to that tooth in angular steps. Angles before the first are those of a revolution
    later: of a rigid tool all revolutions are alike.
    """
    before = at[:, None] - steps
    low = np.floor(before + 1e-9).astype(int)
    share = np.maximum(before - low, 0.0)[:, None, :]
    tooth = np.roll(np.arange(len(steps)), -1)
    early, late = (left[index, :, tooth].transpose(0, 2, 1) for index in (low, np.where(share[:, 0] > 0.0, low + 1, low)))
    feed: Array = travel * steps * 2.0 * math.pi / ANGLES
    return np.asarray(early * (1.0 - share) + late * share - feed * edges.sine)


def _response(edges: _Edges, clear: Array, compliance: Array) -> Response:
    """Map from a force in the plane (B, 2) to the force at its deflection, F′, and ∂F′/∂F (B, 2, 2)."""

    def response(force: Array) -> tuple[Array, Array]:
        thickness = clear + edges.towards(force @ compliance.T)
        return edges.force(thickness)[:, :2], edges.slope(thickness) @ compliance

    return response


def _fixed_point(response: Response, force: Array, tolerance: float) -> Solution:
    for iteration in range(LIMIT + 1):
        following, _ = response(force)
        error = float(np.abs(following - force).max())
        if error <= tolerance or iteration == LIMIT:
            break
        force = following
    return force, iteration, error


def _newton(response: Response, force: Array, tolerance: float) -> Solution:
    """Solve F′(F) = F at every angle; a step is halved until it brings the two closer."""
    following, slope = response(force)
    for iteration in range(LIMIT + 1):
        difference = following - force
        error = float(np.abs(difference).max())
        if error <= tolerance or iteration == LIMIT:
            break
        step = np.linalg.solve(np.eye(2) - slope, difference[:, :, None])[:, :, 0]
        share, size = np.ones(len(force)), np.linalg.norm(difference, axis=1)
        for _ in range(HALVINGS):
            trial = force + share[:, None] * step
            following, slope = response(trial)
            worse = np.linalg.norm(following - trial, axis=1) > (1.0 - 1e-4 * share) * size + 0.1 * tolerance
            if not worse.any():
                break
            share = np.where(worse, 0.5 * share, share)
        force = trial
    return force, iteration, error
