"""Stability lobes to zeroth order: the cut is what it is on the mean over a tooth period.

Altintas and Budak, CIRP Ann. 44 (1995) 357, with both directions coupled, and with process damping. A
vibration ``u exp(i omega t)`` lasts at the depth ``a`` where ``1/a`` is an eigenvalue of

    G(omega) [(1 - exp(-i omega T)) A + i omega / Omega B],

``A`` and ``B`` the mean directional and damping factors, ``T`` the tooth period, ``Omega`` the spindle's
angular speed. It is exact where the cut does not vary over the period. Elsewhere it knows no flip and may be
wrong by half of the depth: it is no boundary to be shown, but a start, as hundreds of structures take no
longer than a few boundaries of :mod:`metro.dynamics.lobes`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from metro.dynamics.system import Cut, Structure
from metro.dynamics.teeth import equal_teeth, mean_damping_factors, mean_directional_factors
from metro.units import Array, ComplexArray

_BELOW, _ABOVE = 0.5, 1.6  # frequencies, as multiples of the lowest and of the highest mode
_PHASE, _FEWEST, _MOST = 0.4, 60, 400  # rad of a tooth period from line to line; how many lines
_BESIDE = np.sinh(np.linspace(-2.2, 2.2, 17))  # lines beside a mode, in half-widths of its resonance
_AT_ONCE = 200_000  # lines of all structures


def zero_order_boundary(
    structures: Sequence[Structure], cuts: Sequence[Cut], rpm: Array
) -> tuple[Array, Array]:
    """Lowest depths (t, k), m, and chatter frequencies there (t, k), Hz, of t structures.

    Parameters
    ----------
    structures : with equally many modes.
    cuts : of the t structures, which differ in process damping alone.
    rpm : (t, k) speeds of each, rev/min.

    Returns
    -------
    Depths are infinite, and frequencies NaN, where no depth is unstable.
    """
    count = len(_lines(structures[:1], cuts[0], rpm[:1])[0])
    size = max(1, _AT_ONCE // count)
    parts = [
        _solved(structures[i : i + size], cuts[i : i + size], rpm[i : i + size])
        for i in range(0, len(structures), size)
    ]
    depth, chatter = (np.concatenate(part) for part in zip(*parts, strict=True))
    return depth, chatter


def _solved(structures: Sequence[Structure], cuts: Sequence[Cut], rpm: Array) -> tuple[Array, Array]:
    omega = _lines(structures, cuts[0], rpm)
    chip, rub = _acting(structures, cuts, omega)
    trace, rubbed = np.trace(chip, axis1=-2, axis2=-1), np.trace(rub, axis1=-2, axis2=-1)
    determinant, both = _determinant(chip, chip), 2.0 * _determinant(chip, rub)
    alone = _determinant(rub, rub)
    depth, chatter = np.full(rpm.shape, np.inf), np.full(rpm.shape, np.nan)
    for k in range(rpm.shape[1]):
        z = 1.0 - np.exp(-1j * omega * cuts[0].tooth_period(rpm[:, k])[:, None])
        w = 1j * omega / (2.0 * np.pi / 60.0 * rpm[:, k])[:, None]
        half = 0.5 * (z * trace + w * rubbed)
        root = _continuous(np.sqrt(half**2 - (z * z * determinant + z * w * both + w * w * alone)))
        depth[:, k], chatter[:, k] = _lowest(omega, np.stack([half + root, half - root]))
    return depth, chatter


def _lines(structures: Sequence[Structure], cut: Cut, rpm: Array) -> Array:
    """(t, f) rising angular frequencies, as close as the tooth period and the resonances ask for."""
    modes = np.stack([structure.omega for structure in structures])
    width = np.stack([structure.omega * structure.zeta for structure in structures])
    low, high = _BELOW * modes.min(axis=1), _ABOVE * modes.max(axis=1)
    radians = float(((high - low) * cut.tooth_period(rpm.min(axis=1))).max())
    share = np.linspace(0.0, 1.0, int(np.clip(np.ceil(radians / _PHASE), _FEWEST, _MOST)))
    even = low[:, None] + (high - low)[:, None] * share
    beside = modes[:, :, None] + width[:, :, None] * _BESIDE
    return np.sort(np.concatenate([even, beside.reshape(len(modes), -1)], axis=1), axis=1)


def _acting(
    structures: Sequence[Structure], cuts: Sequence[Cut], omega: Array
) -> tuple[ComplexArray, ComplexArray]:
    """Receptance times the mean factors (t, f, 2, 2), of the chip and of process damping."""
    names = ("omega", "zeta", "stiffness")
    own, zeta, stiffness = (np.stack([getattr(s, name) for s in structures])[:, None] for name in names)
    along = np.stack([s.directions[s.axis] for s in structures])
    ratio = omega[:, :, None] / own
    modal = 1.0 / (stiffness * (1.0 - ratio**2 + 2j * zeta * ratio))
    dyads = (along[..., :, None] * along[..., None, :]).reshape(*along.shape[:2], 4)
    receptance = (modal @ dyads).reshape(*omega.shape, 2, 2)
    factors = mean_directional_factors(equal_teeth(cuts[0]), np.zeros(1), 1)[0][0, 0, 0]
    per_damping = np.array([cut.damping for cut in cuts])[:, None, None]
    unit = equal_teeth(replace(cuts[0], damping=1.0))
    rubbing = mean_damping_factors(unit, np.zeros(1), 1)[0, 0] * per_damping
    return receptance @ factors, receptance @ rubbing[:, None]


def _determinant(a: ComplexArray, b: ComplexArray) -> ComplexArray:
    """Mixed determinant: that of a matrix with itself is its own."""
    mixed: ComplexArray = 0.5 * (
        a[..., 0, 0] * b[..., 1, 1]
        + b[..., 0, 0] * a[..., 1, 1]
        - a[..., 0, 1] * b[..., 1, 0]
        - b[..., 0, 1] * a[..., 1, 0]
    )
    return mixed


def _continuous(root: ComplexArray) -> ComplexArray:
    """Give square roots (t, f) the sign that they have at the line before."""
    same = np.real(root[:, 1:] * root[:, :-1].conj()) >= 0.0
    sign = np.cumprod(np.where(same, 1.0, -1.0), axis=1)
    followed: ComplexArray = np.concatenate([root[:, :1], root[:, 1:] * sign], axis=1)
    return followed


def _lowest(omega: Array, values: ComplexArray) -> tuple[Array, Array]:
    """Lowest depth (t,) and its frequency (t,), Hz, of the eigenvalues (2, t, f) of 1/depth."""
    a, b = values[:, :, :-1], values[:, :, 1:]
    real = a.imag * b.imag < 0.0
    share = np.where(real, a.imag / np.where(real, a.imag - b.imag, 1.0), 0.0)
    inverse = np.where(real, a.real + share * (b.real - a.real), 0.0)
    at = omega[:, :-1] + share * np.diff(omega, axis=1)
    inverse, at = (np.concatenate(list(part), axis=1) for part in (inverse, at))
    winner = (np.arange(len(omega)), inverse.argmax(axis=1))
    greatest, unstable = inverse[winner], inverse[winner] > 0.0
    depth = np.where(unstable, 1.0 / np.where(unstable, greatest, 1.0), np.inf)
    return depth, np.where(unstable, at[winner] / (2.0 * np.pi), np.nan)
