"""The regenerative cut as an integral equation over the cutting arc, collocated at Gauss points.

With the modes' impulse response ``g``, the tooth period ``T`` and a Floquet multiplier ``mu``, the
displacement along the chip thickness obeys

    h(t) = w * integral over the arc of u(t)·[g(t - s) 1(s < t) + sum_p R_p c_p exp(p (t - s))] v(s) h(s) ds,

``c_p = exp(p T) / (mu - exp(p T))`` and ``w = a (1 - 1/mu)`` for an axial depth ``a``: free flight and every
mode are exact, and the unknown lives on the arc alone, however many modes there are. Teeth that cut at the
same time are folded onto one tooth period. In matrices: ``1/w`` is an eigenvalue of ``volterra + states @
diag(c) @ drive``.

Process damping acts on the rate of the displacement along the arc, which is one more unknown there; it is not
delayed. Its force is in proportion to the depth too, so that ``1/a`` stays an eigenvalue.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from metro.dynamics.system import Cut, Structure, chip_direction
from metro.units import Array, ComplexArray

_NO_MOTION = 1e-12  # share of a mode's direction along an axis
_SQUARINGS = 18  # the norm of a map's 2^17-th power gives its largest multiplier to some 1e-4
_NEGLIGIBLE = 0.03  # share of the free vibrations below which one is left out of the reduced equation


@dataclass(frozen=True)
class Arc:
    """Collocation points of the cutting arc within one tooth period; all in fractions of that period.

    Attributes
    ----------
    time : (n,) places of the points; a point occurs once per channel (see ``chip``).
    weight : (n,) Gauss weights.
    chip : (n, 2) direction in which the unknown is measured: the chip thickness where one tooth cuts, the
        displacements in x and in y (two channels) where several do.
    force : (n, 2) force on the tool per depth and unit of the unknown, N/m²; (k, n, 2) where it is another
        one at each of k speeds.
    rate : (n,) whether the unknown is the displacement's change per tooth period, not itself.
    panels : slices of points in which everything is smooth, one per panel and channel, and the panel's
        (start, length).
    """

    time: Array
    weight: Array
    chip: Array
    force: Array
    rate: np.ndarray
    panels: tuple[tuple[slice, int, float, float], ...]

    def at(self, speeds: np.ndarray) -> Arc:
        """Return it at speeds of some indices, or under a mask; an arc of all speeds as it is."""
        return replace(self, force=self.force[speeds]) if self.force.ndim > 2 else self


@dataclass(frozen=True)
class Kernel:
    """The discretised equation at k speeds, for p poles (both of each conjugate pair) and n points.

    Attributes
    ----------
    period : (k,) tooth period, s.
    volterra : (k, n, n) response to what was cut since the period began.
    states : (k, n, p) the points' displacement per modal state at the period's begin.
    drive : (k, p, n) modal state, carried back to the period's begin, per unit of the unknown and of depth.
    decay : (k, p) exp(pole * period).
    delayed : (n,) 1 where the force depends on the unknown less what it was a period before, 0 where it
        depends on the unknown alone.
    """

    period: Array
    volterra: Array
    states: ComplexArray
    drive: ComplexArray
    decay: ComplexArray
    delayed: Array

    def take(self, speed: np.ndarray) -> Kernel:
        """Return the equation at the speeds of index ``speed``."""
        return replace(
            self,
            period=self.period[speed],
            volterra=self.volterra[speed],
            states=self.states[speed],
            drive=self.drive[speed],
            decay=self.decay[speed],
        )


def panels_of(cut: Cut) -> list[tuple[float, float, int]]:
    """Panels (start, end, teeth cutting) of a tooth period, in fractions of it."""
    arc = (cut.exit - cut.entry) / cut.pitch
    whole = math.floor(arc + 1e-9)
    fraction = max(arc - whole, 0.0)
    panels = [(0.0, fraction, whole + 1), (fraction, 1.0, whole)] if fraction > 1e-9 else [(0.0, 1.0, whole)]
    return [panel for panel in panels if panel[2] > 0]


def collocate(structure: Structure, cut: Cut, points: tuple[int, ...]) -> Arc:
    """Place ``points[i]`` Gauss points in panel i of the tooth period and evaluate the cut there."""
    flexible = np.flatnonzero(np.any(np.abs(structure.along.reshape(-1, 2)) > _NO_MOTION, axis=0))
    damping = np.asarray(cut.damping)
    time, weight, chip, force, rate, panels = [], [], [], [], [], []
    first = 0
    for (start, end, teeth), n in zip(panels_of(cut), points, strict=True):
        x, w = gauss(n)
        tau = start + (end - start) * x
        phi = cut.entry + cut.pitch * (tau[:, None] + np.arange(teeth))
        directions = chip_direction(phi)
        channels = _channels(directions, cut.force_direction(phi), flexible, False)
        if np.any(damping):
            rubs = -damping[..., None, None, None] / cut.pitch * cut.acting(phi)[0][..., None] * directions
            channels += _channels(directions, rubs, flexible, True)
        for unit, density, is_rate in channels:
            time.append(tau)
            weight.append((end - start) * w)
            chip.append(unit)
            force.append(density)
            rate.append(np.full(n, is_rate))
            panels.append((slice(first, first + n), n, start, end - start))
            first += n
    of_speeds = [np.broadcast_to(part, (*damping.shape, *part.shape[-2:])) for part in force]
    joined = [np.concatenate(part) for part in (time, weight, chip, rate)]
    return Arc(joined[0], joined[1], joined[2], np.concatenate(of_speeds, axis=-2), joined[3], tuple(panels))


def _channels(
    directions: Array, forces: Array, flexible: np.ndarray, rate: bool
) -> list[tuple[Array, Array, bool]]:
    """Directions (n, 2) of the unknowns and force (..., n, 2) per unit of each, of teeth (..., n, j, 2)."""
    n, teeth, _ = directions.shape
    if teeth == 1:
        return [(directions[:, 0], forces[..., 0, :], rate)]
    total = np.einsum("...nji,njk->...nki", forces, directions)  # (..., n, chip axis, force axis)
    return [(np.tile(np.eye(2)[axis], (n, 1)), total[..., axis, :], rate) for axis in flexible]


def kernel(structure: Structure, arc: Arc, period: Array) -> Kernel:
    """Assemble the equation at tooth periods ``period`` (k,), s."""
    across = structure.directions.swapaxes(-1, -2)
    chip, force = arc.chip @ across, arc.force @ across
    volterra = np.zeros((len(period), len(arc.time), len(arc.time)))
    for axis in np.unique(structure.axis):
        response = _volterra(structure, axis, arc, period)
        volterra += chip[..., axis, None] * response * force[..., None, :, axis]
    poles = np.concatenate([structure.poles, structure.poles.conj()], axis=-1)
    residues = np.concatenate([structure.residues, structure.residues.conj()], axis=-1)
    if structure.of_speeds:
        poles, residues = poles[:, None], residues[:, None]
    direction = np.concatenate([structure.axis, structure.axis])
    growth = np.exp(period[:, None, None] * arc.time[:, None] * poles)
    per_period = np.where(arc.rate[:, None], period[:, None, None] * poles, 1.0)
    states = chip[..., direction] * growth * per_period
    decay = np.exp(period[:, None, None] * poles)[:, 0]
    acting = residues * force[..., direction] * arc.weight[:, None] * period[:, None, None] / growth
    drive = acting.transpose(0, 2, 1)
    delayed = np.where(arc.rate, 0.0, 1.0)
    return Kernel(period, volterra, states, drive, decay, delayed)


def _volterra(structure: Structure, axis: int, arc: Arc, period: Array) -> Array:
    """(k, n, n) unknowns along ``axis`` per unit force along it, from forces since the period began."""
    result = np.zeros((len(period), len(arc.time), len(arc.time)))
    for row, n, start, length in arc.panels:
        nodes, inner = gauss(n)[0], gauss(n)[0]
        lag = length * nodes[:, None] * (1.0 - inner)
        rate = bool(arc.rate[row][0])
        own = _impulse_response(structure, axis, period[:, None, None], lag, rate)
        same = (own.transpose(1, 0, 2) @ _product_weights(n)).transpose(1, 0, 2)
        same *= length * period[:, None, None]
        for column, _, other, _ in arc.panels:
            if other == start:
                result[:, row, column] = same
            elif other < start:
                lag = arc.time[row, None] - arc.time[column]
                response = _impulse_response(structure, axis, period[:, None, None], lag, rate)
                result[:, row, column] = response * arc.weight[column] * period[:, None, None]
    return result


def _impulse_response(structure: Structure, axis: int, period: Array, lag: Array, rate: bool) -> Array:
    """Displacement (m) along ``axis`` a ``lag`` (periods, ≥ 0) after a unit impulse, or its rate.

    The rate is per ``period``.
    """
    time = period * lag
    total = np.zeros(time.shape)
    for mode in np.flatnonzero(structure.axis == axis):
        pole, residue = (part[..., mode].reshape(-1, 1, 1) for part in (structure.poles, structure.residues))
        # 1 / (2i m omega_d) is imaginary: the pair adds up to a damped sine
        decay = 2.0 * np.abs(residue) * np.exp(pole.real * time)
        sine = np.sin(pole.imag * time)
        if rate:
            total += decay * period * (pole.real * sine + pole.imag * np.cos(pole.imag * time))
        else:
            total += decay * sine
    return total


@lru_cache(maxsize=256)
def gauss(n: int) -> tuple[Array, Array]:
    """Gauss–Legendre points and weights on (0, 1)."""
    x, w = np.polynomial.legendre.leggauss(n)
    return 0.5 * (x + 1.0), 0.5 * w


@lru_cache(maxsize=64)
def _product_weights(n: int) -> Array:
    """Weights (n, n, n) of the integral of f(x_i - s) p(s) over s from 0 to x_i.

    It is sum_qj f(x_i (1 - x_q)) weights_iqj p(x_j).

    Exact for a polynomial p of degree n - 1 through the points, with f p integrated by Gauss' rule on (0,
    x_i).
    """
    x, w = gauss(n)
    degree = np.arange(n)
    at_points = np.polynomial.legendre.legvander(2.0 * x - 1.0, n - 1)
    to_coefficients = (2.0 * degree[:, None] + 1.0) * at_points.T * w
    inner = np.polynomial.legendre.legvander(2.0 * x[:, None] * x - 1.0, n - 1)
    weights: Array = (x[:, None] * w)[:, :, None] * (inner @ to_coefficients)
    return weights


def reduced(equation: Kernel, share: float = 0.6) -> Kernel:
    """Project the equation on ``share`` as many functions, or little more, that carry its large eigenvalues.

    They are the free vibrations and what the response to the cut makes of them, again and again: as that
    response is a Volterra operator, its powers fade faster than geometrically. Displacements and rates have
    functions of their own, since the force depends on their past in different ways.
    """
    rows = [np.flatnonzero(equation.delayed == kind) for kind in np.unique(equation.delayed)]
    free = equation.states[:, :, : equation.states.shape[2] // 2]
    basis = last = [_spanned(np.concatenate([free[:, at].real, free[:, at].imag], axis=2)) for at in rows]
    while any(own.shape[2] < share * len(at) for own, at in zip(basis, rows, strict=True)):
        image = np.concatenate(
            [equation.volterra[:, :, at] @ own for own, at in zip(last, rows, strict=True)], axis=2
        )
        last = [_beside(own, image[:, at]) for own, at in zip(basis, rows, strict=True)]
        basis = [
            np.concatenate(pair, axis=2)[:, :, : len(at)] for *pair, at in zip(basis, last, rows, strict=True)
        ]
    whole = np.zeros((*equation.volterra.shape[:2], sum(own.shape[2] for own in basis)))
    first = 0
    for own, at in zip(basis, rows, strict=True):
        whole[:, at, first : first + own.shape[2]] = own
        first += own.shape[2]
    onto = whole.transpose(0, 2, 1)
    delayed = np.repeat(np.unique(equation.delayed), [own.shape[2] for own in basis])
    volterra, states = onto @ equation.volterra @ whole, onto @ equation.states
    return Kernel(equation.period, volterra, states, equation.drive @ whole, equation.decay, delayed)


def _spanned(vectors: Array) -> Array:
    """Orthonormal vectors (k, n, q) that span all but a negligible part of others (k, n, p)."""
    u, s, _ = np.linalg.svd(vectors, full_matrices=False)
    spanned: Array = u[:, :, : int(np.sum(s > _NEGLIGIBLE * s[:, :1], axis=1).max())]
    return spanned


def _beside(basis: Array, vectors: Array) -> Array:
    """Orthonormal vectors for what of others (k, n, p) is orthogonal to a basis (k, n, q)."""
    for _ in range(2):  # once leaves rounding errors of the parts taken away
        vectors = vectors - basis @ (basis.transpose(0, 2, 1) @ vectors)
    beside: Array = np.linalg.qr(vectors)[0]
    return beside


def period_map(equation: Kernel, depth: Array) -> Array:
    """(k, p + n, p + n) change over a tooth period at axial depths (k,) in metres.

    It acts on the modal states at the period's begin, the real parts and then the imaginary ones of one of
    each conjugate pair, and on the displacements of the period before.
    """
    n, p = equation.states.shape[1:]
    half = p // 2
    depth = depth[:, None, None]
    solve = np.linalg.inv(np.eye(n) - depth * equation.volterra)
    one = equation.states[:, :, :half]
    from_states = solve @ np.concatenate([2.0 * one.real, -2.0 * one.imag], axis=2)
    before = np.diag(equation.delayed)
    from_before = (np.eye(n) - solve) @ before  # equals -solve @ (depth * volterra) @ before
    top = np.concatenate([from_states, from_before], axis=2)
    change = top.copy()
    change[:, :, p:] -= before
    moved = depth * (equation.drive[:, :half] @ change)
    moved[:, :, :half] += np.eye(half)
    moved[:, :, half:p] += 1j * np.eye(half)
    moved *= equation.decay[:, :half, None]
    whole: Array = np.concatenate([moved.real, moved.imag, top], axis=1)
    return whole


def multipliers(equation: Kernel, depth: Array) -> ComplexArray:
    """(k, p + n) Floquet multipliers at axial depths (k,) in metres."""
    return np.linalg.eigvals(period_map(equation, depth)).astype(complex)


def spectral_radius(equation: Kernel, depth: Array) -> Array:
    """(k,) largest modulus of the Floquet multipliers at axial depths (k,) in metres."""
    radius: Array = np.abs(multipliers(equation, depth)).max(axis=1)
    return radius


def surely_stable(equation: Kernel, depth: Array) -> np.ndarray:
    """(k,) whether some power of the period map is less than one in norm; False proves nothing.

    Such a power bounds every multiplier, and takes a tenth of the time of the multipliers themselves. It is
    found, by squaring, wherever the largest of them is less than one by a few parts in ten thousand.
    """
    power = period_map(equation, depth)
    bound = np.zeros(len(power))  # logarithm of what was divided out of the power
    stable = np.zeros(len(power), dtype=bool)
    open_ = np.arange(len(power))
    for _ in range(_SQUARINGS):
        size = np.linalg.norm(power, axis=(1, 2))
        bound = bound + np.log(size)
        stable[open_[bound < 0.0]] = True
        left = bound >= 0.0
        open_, power, bound = open_[left], power[left] / size[left, None, None], 2.0 * bound[left]
        power = power @ power
    return stable
