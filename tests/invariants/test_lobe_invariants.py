"""A stability boundary does not depend on units, on the frame, or on the order of modes and of speeds."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from metro.dynamics.lobes import stability_boundary
from metro.dynamics.system import Cut, Structure

RPM = np.array([2600.0, 3100.0, 4000.0, 5200.0])
FEW = settings(max_examples=8, deadline=None, derandomize=True, database=None)
CLOSE = {"rtol": 1e-4}


def within(low, high):
    return st.floats(low, high, allow_nan=False)


@st.composite
def structures(draw):
    """Two modes along x and one along y, from 150 to 400 Hz."""
    hertz = np.array([draw(within(150.0, 200.0)), draw(within(260.0, 400.0)), draw(within(210.0, 300.0))])
    zeta = np.array([draw(within(0.02, 0.06)) for _ in range(3)])
    stiffness = np.array([draw(within(2e6, 2e7)) for _ in range(3)])
    return Structure(np.array([0, 0, 1]), 2.0 * np.pi * hertz, zeta, stiffness)


@st.composite
def cuts(draw):
    entry = draw(within(0.0, 2.0))
    return Cut(draw(st.integers(2, 4)), entry, draw(within(entry + 0.4, np.pi)), 1e9, draw(within(1e8, 6e8)))


@FEW
@given(structures(), cuts(), within(0.2, 50.0), within(1e-3, 1e3))
def test_in_other_units_of_time_and_force_the_depth_is_the_same(structure, cut, seconds, newtons):
    other = Structure(
        structure.axis, structure.omega * seconds, structure.zeta, structure.stiffness * newtons
    )
    same = Cut(cut.teeth, cut.entry, cut.exit, cut.ktc * newtons, cut.krc * newtons)
    here, there = stability_boundary(structure, cut, RPM), stability_boundary(other, same, RPM * seconds)
    np.testing.assert_allclose(there.depth, here.depth, **CLOSE)
    np.testing.assert_allclose(there.chatter_hz, here.chatter_hz * seconds, **CLOSE)


@FEW
@given(structures(), cuts(), within(-3.0, 3.0))
def test_in_a_turned_frame_the_boundary_is_the_same(structure, cut, angle):
    turned = Cut(cut.teeth, cut.entry - angle, cut.exit - angle, cut.ktc, cut.krc)
    here, there = (
        stability_boundary(*each, RPM) for each in ((structure, cut), (structure.turned(angle), turned))
    )
    np.testing.assert_allclose(there.depth, here.depth, **CLOSE)


@FEW
@given(structures(), cuts(), st.permutations(range(3)), st.permutations(range(len(RPM))))
def test_modes_and_speeds_may_come_in_any_order(structure, cut, modes, speeds):
    modes, speeds = list(modes), list(speeds)
    other = Structure(
        1 - structure.axis[modes], structure.omega[modes], structure.zeta[modes], structure.stiffness[modes],
        structure.directions[::-1],
    )  # fmt: skip
    here, there = stability_boundary(structure, cut, RPM), stability_boundary(other, cut, RPM[speeds])
    np.testing.assert_allclose(there.depth, here.depth[speeds], **CLOSE)


@FEW
@given(structures(), cuts(), st.integers(0, len(RPM) - 1))
def test_a_speed_alone_has_the_boundary_that_it_has_among_others(structure, cut, which):
    here, alone = (stability_boundary(structure, cut, rpm) for rpm in (RPM, RPM[[which]]))
    np.testing.assert_allclose(alone.depth, here.depth[[which]], **CLOSE)
