"""The zero-order boundary, against the one that knows every harmonic of the cut."""

import numpy as np
import pytest

from metro.dynamics.lobes import stability_boundary
from metro.dynamics.softening import Softening
from metro.dynamics.stability_model import StabilityModel, estimated
from metro.dynamics.system import Cut, Structure
from metro.dynamics.zero_order import zero_order_boundary

TIP = Structure(
    np.array([0, 1]), 2 * np.pi * np.array([310.0, 392.0]), np.array([0.03, 0.035]), np.array([9e6, 7e6])
)
RPM = np.array([2400.0, 3300.0, 4500.0])


@pytest.mark.parametrize("damping", [0.0, 3e7])
def test_it_is_exact_where_the_cut_does_not_vary(damping):
    slot = Cut(4, 0.0, np.pi, 8e8, 3.2e8, damping)  # four teeth in a slot push alike at every angle
    exact = stability_boundary(TIP, slot, RPM)
    depth, hz = zero_order_boundary([TIP], [slot], RPM[None])
    np.testing.assert_allclose(depth[0], exact.depth, rtol=0.015)
    np.testing.assert_allclose(hz[0], exact.chatter_hz, rtol=0.003)


def test_many_models_are_solved_as_each_alone_with_turned_modes_and_softening():
    slot = Cut(4, 0.3, 2.9, 8e8, 3.2e8)
    models = [
        StabilityModel(TIP.turned(angle), (slot,), 6e-3, (Softening(softening, 1000.0),))
        for angle, softening in ((0.0, 0.0), (0.4, 0.0), (0.0, -0.05))
    ]
    together = estimated(models, RPM)
    for i, model in enumerate(models):
        for all_of_them, one in zip(together, estimated([model], RPM), strict=True):
            np.testing.assert_allclose(all_of_them[i], one[0], rtol=2e-3)
        assert np.abs(np.log(together[0][i] / model.boundary(RPM)[0])).max() < 0.1


def test_a_cut_that_only_damps_is_stable_at_every_depth():
    depth, hz = zero_order_boundary([TIP], [Cut(4, 0.0, np.pi, 0.0, 0.0, 3e7)], RPM[None])
    assert np.isinf(depth).all()
    assert np.isnan(hz).all()
