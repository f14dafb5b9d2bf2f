"""A tool whose tip yields to the cut: force and deflection in balance, over a revolution of the steady cut.

Quasi-static: the tip is displaced by q = C F (physics.md §2), C the compliance in the plane. Newton's method
solves for q at even angles, with the slope of the force along the same pieces of edge.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from metro.compiled import compiled
from metro.cutting.chip import Cut
from metro.cutting.corners import RawEdges
from metro.cutting.cutter import Cutter
from metro.cutting.displaced import Displaced, displaced
from metro.cutting.edges import HIGH, LOW, Pieces
from metro.cutting.law import EdgeLaw
from metro.cutting.passes import chip_left, chip_slope, row_of
from metro.cutting.quadrature import Points, assembled, ends, of_points, points
from metro.units import Array

ANGLES, LEAST_ANGLES = 360, 120  # of the force, and of the deflection
STEPS, SHARES = 20, (1.0, 0.5, 0.2, 0.05)  # of Newton, and what is tried of each
STEPS_ON_TRUE_PATHS = 2
TOLERANCE, ACCEPTED = 1e-6, 1e-2  # of the largest deflection: at once, and after all steps
DIFFERENCE = 1e-9  # m, of the chip thickness, for the slope of a force law
NO_CHIP, FLATTEST = 1e-6, 1e-2  # of the feed per radian


class NotBalancedError(RuntimeError):
    """Force and deflection did not reach a balance: q and C F differ by ``error`` m."""

    def __init__(self, error: float) -> None:
        super().__init__(f"the deflection is {error:.3g} m off the balance after {STEPS} steps")
        self.error = error


class Yielding(NamedTuple):
    """Force on a tool that yields per unit of each coefficient, (ANGLES, 3, 6), else as of ``force_basis``.

    ``bent``: the deflection, of :func:`deflection`. Times the coefficients of that the basis is the force in
    balance.
    """

    basis: Array
    bent: Array


def yielding(
    cutter: Cutter,
    law: EdgeLaw,
    cut: Cut,
    coefficients: Array,
    compliance: Array,
    *,
    true_path: bool = False,
    start: Array | None = None,
) -> Yielding:
    """Force and deflection of a tool that yields.

    The change of the swept path by the tip's movement (on true paths) is neglected in the balance itself: it
    is less than some hundredths of the force.

    Parameters
    ----------
    coefficients : (6,). compliance : (2, 2) m/N, feed frame, positive definite.
    start : of :func:`deflection`.

    Raises
    ------
    NotBalancedError
        As :func:`deflection`.
    """
    bent = deflection(cutter, law, cut, coefficients, compliance, true_path=true_path, start=start)
    spectrum = np.fft.rfft(bent, axis=0) * (ANGLES / len(bent))
    finer = np.fft.irfft(spectrum, ANGLES, axis=0)
    tool = displaced(cutter, cut, compliance, ANGLES, true_path, orders=len(spectrum))
    pieces, _ = tool.pieces(finer, swept=true_path)
    return Yielding(assembled(pieces, law, ANGLES), bent)


def deflection(
    cutter: Cutter,
    law: EdgeLaw,
    cut: Cut,
    coefficients: Array,
    compliance: Array,
    *,
    true_path: bool = False,
    start: Array | None = None,
) -> Array:
    """Deflection of the tip (n, 2) m, feed frame, at n even angles of tooth 0 over a revolution.

    Parameters
    ----------
    start : deflection of a tool that hardly differs in a cut that hardly does, such as for a derivative: one
        step leads from it. None: of none.

    Raises
    ------
    NotBalancedError
        If q and C F stay further apart than ``ACCEPTED`` of the largest deflection: a tool that soft is drawn
        into the work, or thrown out of it.
    """
    count = cutter.teeth * math.ceil(LEAST_ANGLES / cutter.teeth)

    def spring(true: bool) -> _Spring:
        return _Spring(displaced(cutter, cut, compliance, count, true), law, coefficients, compliance)

    if start is not None:
        return _stepped(spring(true_path), start, 1)
    bent = _balanced(spring(False))
    # Circular paths, which are quick, lead to where true ones take few steps: always as many, so that the
    # deflection is a smooth function of the compliance.
    return _stepped(spring(True), bent, STEPS_ON_TRUE_PATHS) if true_path else bent


def _stepped(spring: _Spring, bent: Array, steps: int) -> Array:
    for _ in range(steps):
        bent = bent + _step(spring, spring.balance(bent))
    return bent


@dataclass(frozen=True, eq=False)
class _Balance:
    """A deflection ``bent`` and its ``residual`` C F − q, (n, 2) m, with the cut there."""

    bent: Array
    residual: Array
    pieces: Pieces
    along: Points
    raw: RawEdges

    def within(self, share: float) -> bool:
        return bool(np.abs(self.residual).max() <= share * np.abs(self.bent + self.residual).max())


@dataclass(frozen=True, eq=False)
class _Spring:
    """A tool and what acts on it."""

    tool: Displaced
    law: EdgeLaw
    coefficients: Array
    compliance: Array

    def balance(self, bent: Array) -> _Balance:
        pieces, raw = self.tool.pieces(bent)
        along = points(pieces, self.law)
        force = of_points(pieces, along, self.law, len(bent)) @ self.coefficients
        return _Balance(bent, force[:, :2] @ self.compliance.T - bent, pieces, along, raw)


def _balanced(spring: _Spring) -> Array:
    """Follow Newton's steps from the undeflected tool, each shortened until the residual falls."""
    balance = spring.balance(np.zeros((len(spring.tool.angle), 2)))
    for _ in range(STEPS):
        if balance.within(TOLERANCE):
            return balance.bent
        step = _step(spring, balance)
        for share in SHARES:
            tried = spring.balance(balance.bent + share * step)
            if np.sum(tried.residual**2) < np.sum(balance.residual**2):
                break
        balance = tried
    if balance.within(ACCEPTED):
        return balance.bent
    raise NotBalancedError(float(np.abs(balance.residual).max()))


def _step(spring: _Spring, balance: _Balance) -> Array:
    """Newton step (n, 2) of the deflection: solve (1 − C ∂F/∂q) step = residual.

    Earlier passes count as whole mean pitches earlier: angles that are a pitch apart are a system of their
    own.
    """
    by_pass, by_edge = (spring.compliance @ part for part in _slope(spring, balance))
    teeth = spring.tool.cutter.teeth
    tooth, size = np.arange(teeth), 2 * teeth

    def by_pitch(values: Array) -> Array:
        return np.asarray(values.reshape(teeth, -1, *values.shape[1:]).swapaxes(0, 1))

    matrix = np.zeros((len(balance.residual) // teeth, teeth, teeth, 2, 2))
    matrix[:, tooth, tooth] = np.eye(2) - by_pitch(by_pass.sum(axis=1) + by_edge)
    for back in range(1, teeth + 1):
        matrix[:, tooth, (tooth - back) % teeth] += by_pitch(by_pass[:, back - 1])
    right = by_pitch(balance.residual).reshape(-1, size, 1)
    step = np.linalg.solve(matrix.swapaxes(2, 3).reshape(-1, size, size), right)
    return np.asarray(step.reshape(-1, teeth, 2).swapaxes(0, 1).reshape(-1, 2))


def _slope(spring: _Spring, balance: _Balance) -> tuple[Array, Array]:
    """∂F by how much nearer each pass is, (n, N, 2, 2), and by how much nearer raw edges are, (n, 2, 2), N/m.

    The shear force grows with the chip along the pieces; where the chip begins or ends along the feed the
    edge force sets in earlier or stops later; where a raw edge does it, dφ = dq_y / (R sin φ).
    """
    cut, along, law = balance.pieces, balance.along, spring.law
    growth = (law.shear(along.chip + DIFFERENCE) - law.shear(along.chip)) / DIFFERENCE
    at_ends, n = ends(cut), len(balance.bent)
    slopes = np.zeros((n, spring.tool.cutter.teeth, 2, 2)), np.zeros((n, 2, 2))
    waves = (
        Waves(along.sine, along.cosine, along.weights * growth),
        Waves(at_ends.sine, at_ends.cosine, law.shear(at_ends.chip)),
    )
    _add_slopes(cut, balance.raw.immersion, spring.coefficients, waves, slopes)
    return cut.depth * slopes[0], cut.depth * slopes[1]


class Waves(NamedTuple):
    """Sine and cosine of the immersion at points of pieces, and what pushes there, (pieces, points)."""

    sine: Array
    cosine: Array
    amount: Array


@compiled
def _add_slopes(
    cut: Pieces, raw: Array, coefficients: Array, waves: tuple[Waves, Waves], slopes: tuple[Array, Array]
) -> None:
    """Add to the ``slopes`` by pass and by raw edge the changes of the force in the plane, per depth.

    ``waves``: inside the pieces, where the shear grows, and at their ends, where it is whole.
    """
    angle, bounds, (by_pass, by_edge), (inside, at_ends) = cut.angle, cut.bounds, slopes, waves
    shear, edge = (coefficients[0], coefficients[1]), (coefficients[3], coefficients[4])
    for i in range(len(bounds)):
        change, row = by_pass[angle[i], cut.bounding[i]], row_of(cut.passed, i)
        length = bounds[i, HIGH] - bounds[i, LOW]
        for k in range(inside.sine.shape[1]):
            push = _push(shear, length * inside.amount[i, k], inside.sine[i, k], inside.cosine[i, k])
            _towards(change, push, inside.sine[i, k], inside.cosine[i, k])
        for end in range(2):
            sine, cosine = at_ends.sine[i, end], at_ends.cosine[i, end]
            if abs(chip_left(cut.scale, row, sine, cosine)) < NO_CHIP * cut.scale.feed:
                steep = max(abs(chip_slope(cut.scale, row, sine, cosine)), FLATTEST * cut.scale.feed)
                _towards(change, _push(edge, 1.0 / steep, sine, cosine), sine, cosine)
            if bounds[i, LOW + end] == raw[end, angle[i]]:
                turned = (1.0 if end else -1.0) / (cut.scale.radius * max(sine, FLATTEST))
                of_shear = _push(shear, at_ends.amount[i, end] * turned, sine, cosine)
                of_edge = _push(edge, turned, sine, cosine)
                by_edge[angle[i], 0, 1] += of_shear[0] + of_edge[0]
                by_edge[angle[i], 1, 1] += of_shear[1] + of_edge[1]


@compiled
def _push(
    coefficients: tuple[float, float], weight: float, sine: float, cosine: float
) -> tuple[float, float]:
    """Push along x and y of a tangential and a radial force."""
    tangential, radial = coefficients[0] * weight, coefficients[1] * weight
    return -tangential * cosine - radial * sine, tangential * sine - radial * cosine


@compiled
def _towards(change: Array, push: tuple[float, float], sine: float, cosine: float) -> None:
    """Add a push per displacement along x and y to a (2, 2): a tooth sees u · q of it."""
    change[0, 0] += push[0] * sine
    change[0, 1] += push[0] * cosine
    change[1, 0] += push[1] * sine
    change[1, 1] += push[1] * cosine
