"""How the arm's tip moves while it cuts: M(P) Ẍ + C(P) Ẋ + K(P) X = F(t), propagated exactly.

The way of the tool is cut into segments in which M, C and K are constant; the tip's place and speed go on
from one to the next. Within a segment the force is linear between samples, and of such a force the motion of
each mode is known in closed form: nothing is integrated numerically, so no time step has to be chosen for
accuracy. The damping is proportional (C = a0 M + a1 K, or one ratio of all modes), so that the undamped modes
part it. The tip starts from rest; passes are not taken to be periodic.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import Array


@dataclass(frozen=True, eq=False)
class TipModes:
    """Modes of the tip in each of s segments.

    Attributes
    ----------
    frequency : (s, 3) undamped, rad/s, rising.
    shape : (s, 3, 3) mass-normalised, a column each.
    inverse : (s, 3, 3) what turns a displacement into modal coordinates, shapeᵀ M.
    """

    frequency: Array
    shape: Array
    inverse: Array


def tip_modes(mass: Array, stiffness: Array) -> TipModes:
    """Return the modes of ``mass`` (s, 3, 3) kg, or one for all, and ``stiffness`` (s, 3, 3) N/m.

    Raises
    ------
    numpy.linalg.LinAlgError
        If a mass is not positive definite. ValueError if a stiffness is not.
    """
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    square, vectors = np.linalg.eigh(inverse @ stiffness @ inverse.swapaxes(-1, -2))
    if square.min() <= 0:
        raise ValueError("a stiffness matrix of the tip is not positive definite")
    shape = inverse.swapaxes(-1, -2) @ vectors
    return TipModes(np.sqrt(square), shape, shape.swapaxes(-1, -2) @ mass)


def respond(modes: TipModes, ratio: Array, force: Array, step: float) -> Array:
    """Height of the tip at the m samples of each segment, (s, m) m, from rest at the first one.

    Parameters
    ----------
    ratio : damping ratio of each mode, (s, 3), or one that broadcasts to it.
    force : (s, m + 1, 3) N on the tip, linear between samples; a segment's last one is the next one's first.
    step : s, between samples.
    """
    ratio = np.broadcast_to(ratio, modes.frequency.shape)
    once = _transition(modes.frequency, ratio, step)
    own = _from_rest(modes.frequency, ratio, once, (force @ modes.shape).swapaxes(0, 1), step)
    free = _powers(once, force.shape[1] - 1)
    begin = _begins(modes, own[-1], free[-1])
    modal = own[:-1, 0] + free[:-1, 0, 0] * begin[0] + free[:-1, 0, 1] * begin[1]
    return np.asarray((modal * modes.shape[:, 2]).sum(axis=2).T)


def swing(frequency: float, ratio: float, force: Array, step: float) -> Array:
    """Return the motion (n, k) under forces (n, k), linear between samples, of an oscillator at rest.

    It is in the unit of the force: the static motion is the force itself. ``frequency`` in rad/s.
    """
    every = np.full((1, force.shape[1]), frequency)
    share = np.full_like(every, ratio)
    once = _transition(every, share, step)
    return np.asarray(_from_rest(every, share, once, frequency**2 * force[:, None], step)[:, 0, 0])


def _from_rest(frequency: Array, ratio: Array, once: Array, push: Array, step: float) -> Array:
    """Modal place and speed (m + 1, 2, s, 3) in each segment, were it entered at rest in the origin.

    Of a push (m + 1, s, 3) that grows by r per second, q = p/ω² − 2 ζ r/ω³ is a motion; what it lacks of the
    true one goes as a free motion, ``once`` from sample to sample.
    """
    square = frequency**2
    speed = np.diff(push, axis=0) / (step * square)
    late = 2 * ratio / frequency * speed
    start, end = (np.stack([at / square - late, speed], axis=1) for at in (push[:-1], push[1:]))
    added = end - once[:, 0] * start[:, :1] - once[:, 1] * start[:, 1:]
    state = np.zeros((len(push), *start.shape[1:]))
    for number, gained in enumerate(added):
        before = state[number]
        state[number + 1] = once[:, 0] * before[0] + once[:, 1] * before[1] + gained
    return state


def _transition(frequency: Array, ratio: Array, time: float) -> Array:
    """Map of a mode's place and speed over ``time``: (2, 2, s, 3), whatever the damping."""
    decay = ratio * frequency
    turn = frequency * np.sqrt(ratio**2 - 1 + 0j)
    plus, minus = np.exp((turn - decay) * time), np.exp((-turn - decay) * time)
    apart = np.abs(turn) * time > 1e-7  # else critically damped
    sine = np.where(apart, (plus - minus) / np.where(apart, 2 * turn, 1.0), time * plus).real
    cosine = 0.5 * (plus + minus).real
    return np.array(
        [[cosine + decay * sine, sine], [-(frequency**2) * sine, cosine - decay * sine]], dtype=np.float64
    )


def _powers(once: Array, most: int) -> Array:
    """Return the maps over 0, 1, … ``most`` steps, (most + 1, 2, 2, s, 3)."""
    powers = np.empty((most + 1, *once.shape))
    powers[0] = np.eye(2)[:, :, None, None]
    for number in range(most):
        before = powers[number]
        powers[number + 1] = once[:, :1] * before[:1] + once[:, 1:] * before[1:]
    return powers


def _begins(modes: TipModes, own: Array, free: Array) -> Array:
    """Modal place and speed (2, s, 3) at the start of each segment; what moves on is the tip, not the mode.

    ``own`` (2, s, 3): state at the end of a segment entered at rest; ``free`` (2, 2, s, 3): map over it.
    """
    across = modes.inverse[1:] @ modes.shape[:-1]  # from the modes of a segment to those of the next
    change = np.einsum("sij,xysj->sxiyj", across, free[:, :, :-1]).reshape(-1, 6, 6)
    added = np.einsum("sij,xsj->sxi", across, own[:, :-1]).reshape(-1, 6)
    begin = np.zeros((len(modes.shape), 6))
    for number, (turn, push) in enumerate(zip(change, added, strict=True)):
        begin[number + 1] = turn @ begin[number] + push
    return np.asarray(begin.reshape(-1, 2, 3).swapaxes(0, 1))


def disc_weights(radius: float, step: float) -> Array:
    """Weights of samples ``step`` apart in the mean over a disc of ``radius`` (same unit) that moves along.

    The chord at a distance x from the middle weighs √(radius² − x²). The function that is averaged is taken
    as linear between samples.
    """
    reach = int(np.ceil(radius / step))
    angle = (np.arange(512) + 0.5) * np.pi / 512  # Gauss-Chebyshev of the second kind, all but exact
    place, weight = radius * np.cos(angle) / step, np.sin(angle) ** 2
    hats = np.maximum(1 - np.abs(place[:, None] - np.arange(-reach, reach + 1)), 0.0)
    return np.asarray(weight @ hats / weight.sum())
