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
from metro.units import Array

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
    # It takes numba, which a boundary does without.
    from metro.dynamics.zero_order_lines import Acting, Modes, Scratch, lowest

    modes = Modes(
        np.stack([one.omega for one in structures]),
        np.stack([one.zeta for one in structures]),
        np.stack([one.stiffness for one in structures]),
        np.stack([one.along for one in structures]),
    )
    factors = mean_directional_factors(equal_teeth(cuts[0]), np.zeros(1), 1)[0][0, 0, 0]
    unit = equal_teeth(replace(cuts[0], damping=1.0))
    per_damping = np.array([cut.damping for cut in cuts])[:, None, None]
    rubbing = mean_damping_factors(unit, np.zeros(1), 1)[0, 0] * per_damping
    acting = Acting(factors, rubbing, cuts[0].tooth_period(rpm), 2.0 * np.pi / 60.0 * rpm)
    depth, chatter = np.full(rpm.shape, np.inf), np.full(rpm.shape, np.nan)
    scratch = Scratch(
        np.zeros((3, rpm.shape[1]), complex), np.ones(rpm.shape[1]), np.zeros((2, rpm.shape[1]))
    )
    lowest(modes, acting, _lines(structures, cuts[0], rpm), scratch, (depth, chatter))
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
