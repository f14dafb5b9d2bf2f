"""Stiffness that modes lose or gain as the spindle turns faster: that of its bearings.

Balls that are thrown outwards leave a bearing softer, by about the square of the speed (Cao and Altintas, J.
Mech. Des. 126 (2004) 1089). The preload that grows with the heat of friction leaves it stiffer, by a lower
power (Abele, Altintas and Brecher, CIRP Ann. 59 (2010) 781). To first order in the change of a spring, the
square of a natural frequency changes by the share of the mode's strain energy that is in that spring
(Rayleigh): a mode of the work or of the arm has none of it in the bearings, and does not soften.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import Array

_MOST_LOST = 0.95  # of the stiffness of bearings: with none left, a mode that has them alone has no frequency


@dataclass(frozen=True)
class Softening:
    """Relative change of stiffnesses with the speed; masses and damping ratios are constant.

    Attributes
    ----------
    change : relative, of the bearings' stiffness at the speed ``at``, rev/min.
    exponent : with which power of the speed it goes.
    shares : of the strain energy of each mode that is in the bearings, in the order of the structure. Empty:
        every stiffness changes as ``change`` says.
    others : the same share of modes that are added to these.
    """

    change: float
    at: float
    exponent: float = 1.0
    shares: tuple[float, ...] = ()
    others: float = 1.0

    def of_modes(self, rpm: Array, modes: int) -> Array:
        """Relative change (k, m) of the stiffness of so many modes at speeds (k,), rev/min."""
        of_bearings = self.change * (np.asarray(rpm, dtype=float) / self.at) ** self.exponent
        if self.shares:  # else nobody knows what else holds a mode, and a model without stiffness is refused
            of_bearings = np.maximum(of_bearings, -_MOST_LOST)
        shares = np.full(modes, self.others)
        known = self.shares[:modes]
        shares[: len(known)] = known
        changes: Array = of_bearings[:, None] * shares
        return changes
