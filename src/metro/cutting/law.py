"""The force law: what a chip of a given thickness costs per unit of edge."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import Array


@dataclass(frozen=True)
class EdgeLaw:
    """Linear edge-force law: dF = (K_c h + K_e) dz for each of tangential, radial, axial (physics.md §2).

    A law gives the two functions of the chip thickness that multiply the shear and the edge coefficients;
    effects replace it by one with other functions.

    Attributes
    ----------
    edge_growth : relative growth of the edge terms per metre cut, 1/m (0: sharp for ever).
    size_exponent, reference_thickness : K_c ∝ (h/h₀)^−m; m = 0 is the linear law.
    """

    edge_growth: float = 0.0
    size_exponent: float = 0.0
    reference_thickness: float = 1e-4

    def shear(self, thickness: Array) -> Array:
        """Return the function of the chip thickness (m) that multiplies K_tc, K_rc, K_ac."""
        if self.size_exponent == 0.0:
            return thickness
        positive = np.maximum(thickness, 1e-9)
        return thickness * (positive / self.reference_thickness) ** -self.size_exponent

    def edge(self, cut_length: float) -> float:
        """Factor on K_te, K_re, K_ae after ``cut_length`` metres."""
        return 1.0 + self.edge_growth * cut_length
