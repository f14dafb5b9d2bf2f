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

from metro.compiled import compiled_with_arrays
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
    across = modes.inverse[1:] @ modes.shape[:-1]  # from the modes of a segment to those of the next
    modal = _carried(_followed(modes.frequency, ratio, step), once, across, force @ modes.shape)
    return np.asarray((modal * modes.shape[:, None, 2]).sum(axis=2))


def swing(frequency: float, ratio: float, force: Array, step: float) -> Array:
    """Return the motion of an oscillator at rest under forces (n + 1, k), linear between samples: (n, k).

    It is that at all but the last sample, in the unit of the force: the static motion is the force itself.
    ``frequency`` in rad/s.
    """
    every = np.full((1, force.shape[1]), frequency)
    share = np.full_like(every, ratio)
    once, alone = _transition(every, share, step), np.zeros((0, *2 * every.shape[1:]))
    return np.asarray(_carried(_followed(every, share, step), once, alone, frequency**2 * force[None])[0])


def _followed(frequency: Array, ratio: Array, step: float) -> Array:
    """Return a, b, c (3, s, k): a push p that rises by r a step is followed by a p − b r at a speed c r."""
    square = frequency**2
    return np.array([1.0 / square, 2.0 * ratio / (frequency * square * step), 1.0 / (square * step)])


@compiled_with_arrays
def _carried(follows: Array, once: Array, across: Array, push: Array) -> Array:
    """Modal places (s, m, k) at the samples of each segment but the last, from rest at the first one.

    What a motion that follows the push lacks of the true one goes as a free motion. From a segment to the
    next it is the tip that moves on, and not its modes.

    Parameters
    ----------
    follows : (3, s, k) of :func:`_followed`. once : (2, 2, s, k) map of place and speed over a step.
    across : (s − 1, k, k) from the modes of each segment to those of the next.
    push : (s, m + 1, k) modal force.
    """
    segments, samples, count = push.shape
    place = np.empty((segments, samples - 1, count))
    at, speed = np.zeros(count), np.zeros(count)
    for s in range(segments):
        if s:
            at, speed = across[s - 1] @ at, across[s - 1] @ speed
        for i in range(count):
            static, late, quick = follows[0, s, i], follows[1, s, i], follows[2, s, i]
            for m in range(samples - 1):
                place[s, m, i] = at[i]
                risen = push[s, m + 1, i] - push[s, m, i]
                left = at[i] - static * push[s, m, i] + late * risen
                faster = speed[i] - quick * risen
                at[i] = once[0, 0, s, i] * left + once[0, 1, s, i] * faster
                speed[i] = once[1, 0, s, i] * left + once[1, 1, s, i] * faster + quick * risen
                at[i] += static * push[s, m + 1, i] - late * risen
    return place


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
