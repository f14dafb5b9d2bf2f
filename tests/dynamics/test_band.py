"""The band of the lobes against solving the lobes again."""

from dataclasses import replace

import numpy as np

from metro.dynamics.band import depth_samples
from metro.dynamics.by_depth import depths_anew
from metro.dynamics.lobes import stability_boundary
from metro.dynamics.system import Cut, Structure

STRUCTURE = Structure(
    np.array([0, 0, 1]),
    2 * np.pi * np.array([41.0, 63.0, 35.0]),
    np.array([0.05, 0.04, 0.06]),
    np.array([4e6, 3e6, 7e6]),
)
CUT = Cut(4, 0.0, np.pi / 2, 1e9, 4e8)
RPM = np.linspace(500, 2000, 12)


def test_samples_are_near_the_boundary_solved_anew():
    rng = np.random.default_rng(3)
    deviations = rng.normal(size=(6, 11)) * np.repeat([0.003, 0.03, 0.02, 0.02], [3, 3, 3, 2])
    samples = depth_samples(STRUCTURE, CUT, stability_boundary(STRUCTURE, CUT, RPM), deviations)
    anew = depths_anew(STRUCTURE, CUT, RPM, deviations)
    for sample, solved, d in zip(samples, anew, np.exp(deviations), strict=True):
        structure = Structure(
            STRUCTURE.axis, STRUCTURE.omega * d[:3], STRUCTURE.zeta * d[3:6], STRUCTURE.stiffness * d[6:9]
        )
        cut = replace(CUT, ktc=CUT.ktc * d[9], krc=CUT.krc * d[10])
        np.testing.assert_array_equal(solved, stability_boundary(structure, cut, RPM).depth)
        assert np.median(np.abs(np.log(sample / solved))) < 0.006


def test_no_deviation_gives_the_boundary_itself():
    boundary = stability_boundary(STRUCTURE, CUT, RPM)
    np.testing.assert_allclose(
        depth_samples(STRUCTURE, CUT, boundary, np.zeros((1, 11)))[0], boundary.depth, rtol=1e-9
    )


def test_harder_work_lowers_every_depth_in_proportion():
    boundary = stability_boundary(STRUCTURE, CUT, RPM)
    deviations = np.zeros((1, 11))
    deviations[0, 9:] = 0.05
    lower = depth_samples(STRUCTURE, CUT, boundary, deviations)[0]
    np.testing.assert_allclose(np.log(lower / boundary.depth), -0.05, atol=1e-4)


def test_each_slope_is_that_of_boundaries_solved_to_either_side():
    """One parameter at a time: a small change of it, and the boundary that is solved anew with it."""
    step = 1e-3
    each = np.eye(11) * step
    boundary = stability_boundary(STRUCTURE, CUT, RPM)
    slopes = np.log(depth_samples(STRUCTURE, CUT, boundary, each) / boundary.depth) / step
    above, below = (np.log(depths_anew(STRUCTURE, CUT, RPM, sign * each)) for sign in (1.0, -1.0))
    solved = (above - below) / (2.0 * step)
    assert np.abs(solved[:3]).max() > 3.0  # frequencies move the lobes
    np.testing.assert_allclose(slopes, solved, atol=0.03)
