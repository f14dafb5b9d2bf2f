"""A tool whose tip yields to the cut: force and deflection in balance, over a revolution of the steady cut.

Quasi-static: the tip is displaced by q = C F (physics.md §2), C the compliance in the plane. Newton's method
solves for q at even angles, with the slope of the force along the same pieces of edge.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter
from metro.cutting.displaced import Displaced, displaced
from metro.cutting.edges import Pieces, points
from metro.cutting.force import assembled
from metro.cutting.law import EdgeLaw
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


def yielding_basis(
    cutter: Cutter, law: EdgeLaw, cut: Cut, coefficients: Array, compliance: Array, *, true_path: bool = False
) -> Array:
    """Force on a tool that yields per unit of each coefficient, (ANGLES, 3, 6), else as of ``force_basis``.

    The tool is displaced as it is with ``coefficients`` (6,): times these the basis is the force in balance.
    The change of the swept path by the tip's movement (on true paths) is neglected in the balance itself: it
    is less than some hundredths of the force.

    Parameters
    ----------
    compliance : (2, 2) m/N, feed frame, positive definite.

    Raises
    ------
    NotBalancedError
        As :func:`deflection`.
    """
    coarse = deflection(cutter, law, cut, coefficients, compliance, true_path=true_path)
    spectrum = np.fft.rfft(coarse, axis=0) * (ANGLES / len(coarse))
    bent = np.fft.irfft(spectrum, ANGLES, axis=0)
    pieces, _ = displaced(cutter, cut, compliance, ANGLES, true_path).pieces(bent, swept=true_path)
    return assembled(pieces, law, ANGLES)


def deflection(
    cutter: Cutter, law: EdgeLaw, cut: Cut, coefficients: Array, compliance: Array, *, true_path: bool = False
) -> Array:
    """Deflection of the tip (n, 2) m, feed frame, at n even angles of tooth 0 over a revolution.

    Raises
    ------
    NotBalancedError
        If q and C F stay further apart than ``ACCEPTED`` of the largest deflection: a tool that soft is drawn
        into the work, or thrown out of it.
    """
    count = cutter.teeth * math.ceil(LEAST_ANGLES / cutter.teeth)
    circular = _Spring(displaced(cutter, cut, compliance, count, False), law, coefficients, compliance)
    bent = _balanced(circular)
    if not true_path:
        return bent
    # Circular paths, which are quick, lead to where true ones take few steps: always as many, so that the
    # deflection is a smooth function of the compliance.
    true = _Spring(displaced(cutter, cut, compliance, count, True), law, coefficients, compliance)
    for _ in range(STEPS_ON_TRUE_PATHS):
        bent = bent + _step(true, true.balance(bent))
    return bent


@dataclass(frozen=True, eq=False)
class _Balance:
    """A deflection ``bent`` and its ``residual`` C F − q, (n, 2) m, with the cut's pieces and raw edges."""

    bent: Array
    residual: Array
    pieces: Pieces
    raw: Array

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
        force = assembled(pieces, self.law, len(bent)) @ self.coefficients
        return _Balance(bent, force[:, :2] @ self.compliance.T - bent, pieces, raw)


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
    pieces, n, teeth = balance.pieces, len(balance.bent), spring.tool.cutter.teeth
    by_pass = _by_chip(spring, pieces)
    by_edge = _by_raw_edge(spring, pieces, balance.raw)
    place = pieces.angle * teeth + pieces.bounding
    summed = [np.bincount(place, part, n * teeth) for part in by_pass.reshape(4, -1)]
    across = [np.bincount(pieces.angle, part, n) for part in by_edge]
    none = np.zeros(n)
    edges = np.stack([none, across[0], none, across[1]], axis=1).reshape(n, 2, 2)
    passes = np.stack(summed, axis=1).reshape(n, teeth, 2, 2)
    return np.asarray(pieces.depth * passes), np.asarray(pieces.depth * edges)


def _by_chip(spring: _Spring, pieces: Pieces) -> Array:
    """Change (2, 2, pieces) of the force in the plane, per depth, with how much nearer the pass is."""
    law, before = spring.law, pieces.before
    phi, weights = points(pieces, law)
    sine, cosine = np.sin(phi), np.cos(phi)
    chip = np.maximum(before.chip(sine, cosine), 0.0)
    growth = (law.shear(chip + DIFFERENCE) - law.shear(chip)) / DIFFERENCE
    along = weights[:, None] * (pieces.high - pieces.low) * growth
    inside = _towards(_push(spring.coefficients[:2], along, sine, cosine), sine, cosine)
    sine, cosine = _ends(pieces)
    steepness = np.maximum(np.abs(before.slope(sine, cosine)), FLATTEST * before.feed)
    begins = (np.abs(before.chip(sine, cosine)) < NO_CHIP * before.feed) / steepness
    return inside + _towards(_push(spring.coefficients[3:5], begins, sine, cosine), sine, cosine)


def _by_raw_edge(spring: _Spring, pieces: Pieces, raw: Array) -> Array:
    """Change (2, pieces) of the force in the plane, per depth, with the displacement across the feed."""
    sine, cosine = _ends(pieces)
    sign = np.array([[-1.0], [1.0]])
    turned = sign * (np.stack([pieces.low, pieces.high]) == raw[:, pieces.angle])
    turned /= spring.tool.cutter.radius * np.maximum(sine, FLATTEST)
    full = spring.law.shear(np.maximum(pieces.before.chip(sine, cosine), 0.0))
    shear = _push(spring.coefficients[:2], full * turned, sine, cosine)
    return np.asarray((shear + _push(spring.coefficients[3:5], turned, sine, cosine)).sum(axis=1))


def _ends(pieces: Pieces) -> tuple[Array, Array]:
    """Sine and cosine (2, pieces) of where pieces begin and end."""
    ends = np.stack([pieces.low, pieces.high])
    return np.sin(ends), np.cos(ends)


def _push(coefficients: Array, weight: Array, sine: Array, cosine: Array) -> Array:
    """Push along x and y, (2, …), of a tangential and a radial force."""
    tangential, radial = coefficients
    return np.stack([-tangential * cosine - radial * sine, tangential * sine - radial * cosine]) * weight


def _towards(push: Array, sine: Array, cosine: Array) -> Array:
    """Sum (2, 2, pieces) over points of a push, per displacement along x and y: a tooth sees u · q of it."""
    return np.stack([(push * sine).sum(axis=1), (push * cosine).sum(axis=1)], axis=1)
