"""The orders of a fit are taken from fewer angles than a waveform that is drawn has."""

import math
from dataclasses import replace

import numpy as np
import pytest

from metro.cutting.cutter import Cutter
from metro.cutting.engagement import Engagement
from metro.cutting.force import Cut, force_basis
from metro.cutting.law import EdgeLaw
from metro.observables.force.order_basis import order_basis
from metro.signals.orders import amplitudes, to_orders

BENT = Cutter(
    6e-3, helix=0.6, tooth_angles=tuple(0.5 * math.pi * np.arange(4)), runout_radius=2e-5, runout_angle=0.3
)


@pytest.mark.parametrize(
    ("tool", "most"), [(BENT, 4e-4), (replace(BENT, corner=1e-3), 1.5e-3), (replace(BENT, helix=0.0), 4e-3)]
)
def test_orders_of_a_fit_are_those_of_four_times_as_many_angles(tool, most):
    cut = Cut(1e-4, 4e-3, Engagement(0.5 * math.pi, math.pi))
    fine = amplitudes(to_orders(force_basis(tool, EdgeLaw(), cut, True, 1440), 48))
    off = order_basis(tool, EdgeLaw(), cut, 48, True) - fine
    assert np.linalg.norm(off) < most * np.linalg.norm(fine)
