"""A machine that yields to the cut: the chip of a tooth depends on the tip's position in earlier passes.

Quasi-static regeneration ([T] eq. 10, 11, figure 6; physics.md §2): the tip is displaced by q = K⁻¹ F, and
the chip gains q(t) − q(t − T) towards the tooth. Within one tooth passing the surfaces met are all in the
past, so its angles are solved at once: at each a two-dimensional spring under a force that is linear in its
deflection while the teeth stay in cut.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from metro.cutting.cutter import Cutter
from metro.cutting.force import Cut
from metro.cutting.law import EdgeLaw
from metro.units import Array

ANGLES = 720
SLICES_PER_RADIAN = 60
TOLERANCE = 1e-6  # of the largest rigid force: [T]'s allowed difference e
LIMIT = 200  # iterations per tooth passing
DIFFERENCE = 1e-9  # m, of the chip thickness, for the slope of a force law
REVOLUTIONS = 6

Scheme = Literal["newton", "fixed_point"]
Response = Callable[[Array], tuple[Array, Array]]
Solution = tuple[Array, int, float]


class NotConvergedError(RuntimeError):
    """Force and deflection did not converge: number of ``iterations``, ``residual`` max|F′ − F|, N."""

    def __init__(self, scheme: str, iterations: int, residual: float) -> None:
        super().__init__(
            f"{scheme}: force and deflection differ by {residual:.3g} N after {iterations} iterations"
        )
        self.iterations = iterations
        self.residual = residual


@dataclass(frozen=True, eq=False)
class Yielding:
    """A converged cut from first contact on; the tip was not deflected in the passes before.

    Attributes
    ----------
    force : (revolutions × ANGLES, 3) N on the tool, feed frame.
    rigid : the force on a tool that does not yield.
    deflection : (revolutions × ANGLES, 2) m.
    iterations : largest number for one tooth passing. residual : largest remaining max|F′ − F|, N.
    """

    force: Array
    rigid: Array
    deflection: Array
    iterations: int
    residual: float


@dataclass(frozen=True, eq=False)
class _Edges:
    """Elements of the edges at some angles: sine and cosine of immersion, engaged depth, each (B, H, N).

    ``reach`` (H, N) is the distance of each element from the axis of rotation, less the radius, m.
    ``rubbing`` is the depth on which the edge force acts: that on which a rigid tool cuts. If the edge force
    began with the yielding tool's own chip, it would jump, and a tooth that it lifts off would have no
    equilibrium or two.
    """

    law: EdgeLaw
    coefficients: Array
    reach: Array
    sine: Array
    cosine: Array
    depth: Array
    rubbing: Array

    def at(self, index: np.ndarray) -> _Edges:
        """Return the elements at some of the angles."""
        parts = self.sine[index], self.cosine[index], self.depth[index], self.rubbing[index]
        return _Edges(self.law, self.coefficients, self.reach, *parts)

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
        """Differentiate the force in the plane by the displacement of the tip, (B, 2, 2) N/m."""
        ahead, here = self._per_direction(thickness + DIFFERENCE), self._per_direction(thickness)
        tangential, radial, _ = (ahead - here) / DIFFERENCE
        push = np.stack(
            [-tangential * self.cosine - radial * self.sine, tangential * self.sine - radial * self.cosine]
        )
        return np.asarray(np.einsum("ibhn,jbhn->bij", push, np.stack([self.sine, self.cosine])))

    def _per_direction(self, thickness: Array) -> Array:
        """Tangential, radial and axial force of each element, (3, B, H, N)."""
        shear = self.law.shear(np.maximum(thickness, 0.0)) * self.depth
        return np.multiply.outer(self.coefficients[:3], shear) + np.multiply.outer(
            self.coefficients[3:], self.rubbing
        )


def yielding_force(
    cutter: Cutter,
    law: EdgeLaw,
    cut: Cut,
    coefficients: Array,
    stiffness: Array,
    *,
    revolutions: int = REVOLUTIONS,
    scheme: Scheme = "newton",
) -> Yielding:
    """Force of the peripheral edges on a tool whose tip yields, from first contact on.

    A tooth meets the surface that all earlier passes left, so a tooth that was pushed out of the cut leaves
    its chip to the next. At the start the work is as a rigid tool leaves it, with a full chip.

    Parameters
    ----------
    coefficients : (6,) SI, shear, then edge, tangential, radial, axial. stiffness : (2, 2) N/m, feed frame.
    scheme : ``newton`` (semi-smooth: teeth may leave the cut) or ``fixed_point`` ([T] figure 6): the force at
        a deflection gives the next deflection.

    Raises
    ------
    NotConvergedError
        If in some tooth passing max|F′ − F| does not fall below ``TOLERANCE`` of the largest rigid force.
    """
    edges, clear = _rigid(cutter, law, cut, coefficients)
    rigid, reach = edges.force(clear), edges.reach
    # Surface that each tooth leaves at each angle, about the axis of rotation; the first revolution is rigid.
    surfaces = np.empty(((1 + revolutions) * ANGLES, *clear.shape[1:]))
    surfaces[:ANGLES] = reach - np.minimum(clear, 0.0)
    compliance: Array = np.asarray(np.linalg.inv(stiffness), dtype=float)
    tolerance = TOLERANCE * float(np.abs(rigid).max())
    solve = {"newton": _newton, "fixed_point": _fixed_point}[scheme]
    force, deflection = np.empty((revolutions * ANGLES, 3)), np.empty((revolutions * ANGLES, 2))
    block, most, residual = math.floor(_steps(cutter).min() + 1e-9), 0, 0.0
    for start in range(0, len(force), block):
        at = np.arange(start, min(start + block, len(force)))
        here = edges.at(at % ANGLES)
        met = _met(cutter, cut, surfaces, at + ANGLES, here)
        response = _response(here, reach, met, compliance)
        plane, iterations, error = solve(response, rigid[at % ANGLES, :2], tolerance)
        if error > tolerance:
            raise NotConvergedError(scheme, iterations, error)
        deflection[at] = plane @ compliance.T
        reached = reach + here.towards(deflection[at])
        force[at], surfaces[at + ANGLES] = here.force(reached - met), np.maximum(met, reached)
        most, residual = max(most, iterations), max(residual, error)
    return Yielding(force, np.tile(rigid, (revolutions, 1)), deflection, most, residual)


def ratios(
    cutter: Cutter, law: EdgeLaw, cut: Cut, coefficients: Array, stiffness: Array
) -> tuple[float, float]:
    """Factors by which errors of the fixed-point scheme grow per iteration, and entry transients per tooth.

    With G = ∂F/∂q K⁻¹ at the rigid force the scheme maps an error e to G e: it diverges if an eigenvalue of
    G exceeds one. A tooth passing maps a difference d from the steady force to −(I − G)⁻¹ G d. Each factor is
    the largest over a revolution. They are exact for a law that is linear in the chip and equal teeth that
    stay in cut.
    """
    edges, clear = _rigid(cutter, law, cut, coefficients)
    eigenvalues = np.linalg.eigvals(edges.slope(clear) @ np.linalg.inv(stiffness))
    return float(np.abs(eigenvalues).max()), float(np.abs(eigenvalues / (1.0 - eigenvalues)).max())


def _rigid(cutter: Cutter, law: EdgeLaw, cut: Cut, coefficients: Array) -> tuple[_Edges, Array]:
    """Elements of the edges over a revolution, and the chip thickness (ANGLES, H, N) of a rigid tool."""
    lag = cutter.lag_per_depth * cut.axial_depth
    slices = max(4, math.ceil(SLICES_PER_RADIAN * lag))
    height = (np.arange(slices) + 0.5) * cut.axial_depth / slices
    angle = 2.0 * math.pi * np.arange(ANGLES)[:, None, None] / ANGLES
    immersion = angle - cutter.lag_per_depth * height[:, None] + np.asarray(cutter.tooth_angles)
    # An element represents a window, of its helix or of the angular step, and a share of it is engaged.
    window = max(2.0 * math.pi / ANGLES, lag / slices)
    middle, half = (
        0.5 * (cut.engagement.entry + cut.engagement.exit),
        0.5 * (cut.engagement.exit - cut.engagement.entry),
    )
    offset = np.mod(immersion - middle + math.pi, 2.0 * math.pi) - math.pi
    low, high = np.maximum(offset - window / 2, -half), np.minimum(offset + window / 2, half)
    engaged = high > low
    immersion = np.where(engaged, middle + 0.5 * (low + high), immersion)
    depth = np.where(engaged, (high - low) / window * cut.axial_depth / slices, 0.0)
    sine, reach = np.sin(immersion), cutter.radius_deviation(height).T
    travel = cut.feed_per_tooth * cutter.teeth / (2.0 * math.pi)
    passes = [
        travel * cutter.pitch(m) * sine + reach - np.roll(reach, -m, axis=1)
        for m in range(1, cutter.teeth + 1)
    ]
    clear = np.min(passes, axis=0)
    return _Edges(
        law, coefficients, reach, sine, np.cos(immersion), depth, np.where(clear > 0.0, depth, 0.0)
    ), clear


def _steps(cutter: Cutter) -> Array:
    """Pitch from each tooth to the one that cut before it, (N,) angular steps."""
    return cutter.pitch(1) * ANGLES / (2.0 * math.pi)


def _met(cutter: Cutter, cut: Cut, surfaces: Array, at: np.ndarray, edges: _Edges) -> Array:
    """Surface (B, H, N) that each tooth meets: that of the tooth a pitch before, less the feed since.

    The surface is interpolated linearly between the angles at which it is stored.
    """
    steps = _steps(cutter)
    before = at[:, None] - steps
    low = np.floor(before + 1e-9).astype(int)
    share = np.maximum(before - low, 0.0)
    tooth = np.roll(np.arange(cutter.teeth), -1)
    early, late = (
        surfaces[index, :, tooth].transpose(0, 2, 1) for index in (low, np.where(share > 0.0, low + 1, low))
    )
    surface = early + share[:, None, :] * (late - early)
    return np.asarray(surface - cut.feed_per_tooth * cutter.teeth * steps / ANGLES * edges.sine)


def _response(edges: _Edges, reach: Array, met: Array, compliance: Array) -> Response:
    """Map from a force in the plane (B, 2) to the force at its deflection, F′, and ∂F′/∂F (B, 2, 2)."""

    def response(force: Array) -> tuple[Array, Array]:
        thickness = reach + edges.towards(force @ compliance.T) - met
        return edges.force(thickness)[:, :2], edges.slope(thickness) @ compliance

    return response


def _fixed_point(response: Response, force: Array, tolerance: float) -> Solution:
    """Take the force at the deflection as the next force."""
    for iteration in range(LIMIT + 1):
        following, _ = response(force)
        error = float(np.abs(following - force).max())
        if error <= tolerance or iteration == LIMIT:
            break
        force = following
    return force, iteration, error


def _newton(response: Response, force: Array, tolerance: float) -> Solution:
    """Solve F′(F) = F at every angle, with the slope of the side of a kink that each element is on."""
    for iteration in range(LIMIT + 1):
        following, slope = response(force)
        error = float(np.abs(following - force).max())
        if error <= tolerance or iteration == LIMIT:
            break
        force = force + np.linalg.solve(np.eye(2) - slope, (following - force)[:, :, None])[:, :, 0]
    return force, iteration, error
