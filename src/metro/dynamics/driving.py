"""Whether a declared driving point is one: the signs that the residues of its modes must have.

Hit where its response is measured, a structure moves with the force in every mode: of normal modes with
H = sum of A/(s - p) + conj, Im A = -phi²/(2 m omega_d) is negative in all of them. Where all have the other
sign, sensor or hammer points the other way; where the signs mix, the two are at different places.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

import numpy as np

from metro.dynamics.polefit import PoleFit
from metro.units import Array, ComplexArray

# A residue of zero has so clear a wrong sign by chance in fewer than one of a thousand tests of twenty modes.
_CLEAR = 4.0
# Hammer and sensor d apart see opposite signs near a node, where the residue is at most (phi' d/2)². With d a
# twentieth of the wave length that is (pi/20)², a fortieth of an antinode's: no sign of another place.
_NEAR_A_NODE = 0.025
# Residues of modes closer than this many times the sum of their half widths share their errors.
_APART = 2.0
# Of the power that the force exchanges. At its own point all goes in; with the sign of the response turned,
# all but what noise between the resonances makes comes out.
_NEARLY_ALL = 0.75


class Standing(Enum):
    """What the residues say of a declared driving point."""

    THERE = "there"
    REVERSED = "reversed"
    ELSEWHERE = "elsewhere"


def standing(fit: PoleFit, free: ComplexArray, column: int, modes: Sequence[int], power: float) -> Standing:
    """Judge a driving point by the modes in the band, and by the power of its force where they have no say.

    Modes that overlap have none: of a tool in its holder it may be all of them.

    Parameters
    ----------
    free : (m, c) residues fitted as complex: one that is not within 45° of a normal mode's has no say.
    column : of the driving point.
    modes : which of the fit's are in the band.
    power : of its FRF, by :func:`power_given_out`.
    """
    width = fit.omega * fit.zeta
    apart = np.abs(fit.omega[:, None] - fit.omega) / (width[:, None] + width)
    alone = np.min(apart + np.diag(np.full(len(width), np.inf)), axis=1) > _APART
    normal = np.abs(free[:, column].imag) > np.abs(free[:, column].real)
    has_a_say = [r for r in modes if alone[r] and normal[r]]
    residue = fit.residues[has_a_say, column].imag
    clear = np.abs(residue) > _CLEAR * np.array([_error(fit, r, column) for r in has_a_say])
    # A omega does not depend on the mode but for phi² and the modal mass
    size = np.abs(residue) * fit.omega[has_a_say]
    right = clear & (residue < 0.0)
    wrong = clear & (residue > 0.0) & (size > _NEAR_A_NODE * np.max(size, initial=0.0))
    if not wrong.any():
        return Standing.REVERSED if power > _NEARLY_ALL and not right.any() else Standing.THERE
    return Standing.ELSEWHERE if right.any() else Standing.REVERSED


def _error(fit: PoleFit, r: int, column: int) -> float:
    gradient = np.zeros(3 * len(fit.omega))
    gradient[2 * len(fit.omega) + r] = 1.0
    return fit.sd(gradient, column)


def turning(frf: ComplexArray) -> float:
    """Mean turn of an FRF (n,) from line to line over its size, in −1…1: negative where its phase falls.

    Over each resonance the phase falls by half a turn in the convention e^{+iωt}, whatever the sign of the
    response; it rises where the FRF is conjugated.
    """
    step = np.conj(frf[:-1]) * frf[1:]
    size = float(np.sum(np.abs(step)))
    return float(np.sum(step.imag)) / size if size > 0.0 else 0.0


def power_given_out(frequency: Array, frf: ComplexArray) -> float:
    """Return the power that a force takes out of the structure over all that it exchanges, in −1…1.

    Σ ω Im H over Σ ω |Im H|: −1 at its own point, where it puts power in at every frequency; 1 where the
    response there is reversed or the FRF conjugated.
    """
    exchanged = float(np.sum(np.abs(frf.imag) * frequency))
    return float(np.sum(frf.imag * frequency)) / exchanged if exchanged > 0.0 else 0.0
