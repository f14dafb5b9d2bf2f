"""CDSEM: where the explicit rule breaks down, the order of the midpoint rule, and modes alone."""

import numpy as np
import pytest
from machines import BENCH, MASS, OMEGA, ZETA

from metro.dynamics import cdsem, lobes
from metro.dynamics.system import Cut, Structure, immersion

SLOT = Cut(2, *immersion("slot", 1.0, 1.0), 6e8, 2e8)
TWO = Structure(
    np.array([0, 1]), 2 * np.pi * np.array([41.0, 63.0]), np.array([0.05, 0.04]), np.array([4e6, 7e6])
)


def radius(depth, steps, interpolation, cut=SLOT):
    mode, rpm = np.array([0]), np.array([5000.0])
    settings = {"steps": steps, "interpolation": interpolation}
    return cdsem.spectral_radius(BENCH, cut, mode, rpm, np.array([depth]), **settings)[0]


def test_the_explicit_rule_needs_the_published_number_of_steps():
    # omega T / (2 zeta): 1580 at 5000 rpm; rounded up in print to 1582
    assert cdsem.steps_for_stability(BENCH, SLOT, 5000.0) == pytest.approx(1582, abs=2)
    assert radius(0.0, 1500, 0.0) > 1
    assert radius(0.0, 1582, 0.0) < 1


@pytest.mark.parametrize("interpolation", [0.0, 0.3, 1.0])
def test_every_term_is_differenced_as_the_rule_is_written(interpolation):
    """(z[i+1] - z[i]) / dt, with state, delayed state and factor each between the step's two ends."""
    steps, depth, dt = 40, 0.4e-3, 60 / (2 * 5000.0) / 40
    phi = np.pi * np.arange(steps + 1) / steps
    factor = -depth * np.sin(phi) * (6e8 * np.cos(phi) + 2e8 * np.sin(phi)) / MASS
    factor[: steps // 2] = 0.0  # half immersion: the tooth enters at the node in the middle
    size = 2 + steps + 1
    total = np.eye(size)  # q, q', and the displacements of now and of a period before
    for i in range(steps):
        at = (1 - interpolation) * factor[i] + interpolation * factor[i + 1]
        A = np.array([[0.0, 1.0], [at - OMEGA**2, -2 * ZETA * OMEGA]])
        now, new = np.zeros((2, size)), np.eye(2) - interpolation * dt * A
        now[:, :2] = np.eye(2) + (1 - interpolation) * dt * A
        now[1, -1] -= dt * at * (1 - interpolation)
        now[1, -2] -= dt * at * interpolation
        step = np.eye(size, k=-1)
        step[:3] = 0.0
        step[:2] = np.linalg.solve(new, now)
        step[2] = step[0]
        total = step @ total
    expected = np.abs(np.linalg.eigvals(total)).max()
    half = Cut(2, *immersion("down", 0.5, 1.0), 6e8, 2e8)
    assert radius(depth, steps, interpolation, half) == pytest.approx(expected, rel=1e-8)


def test_the_midpoint_rule_is_of_second_order():
    exact = lobes.spectral_radius(BENCH, SLOT, [5000], [0.5e-3])[0]
    coarse, fine = (radius(0.5e-3, steps, cdsem.MIDPOINT) - exact for steps in (400, 800))
    assert coarse / fine == pytest.approx(4.0, abs=0.3)


def test_the_explicit_rule_is_of_first_order():
    exact = lobes.spectral_radius(BENCH, SLOT, [5000], [0.5e-3])[0]
    coarse, fine = (radius(0.5e-3, steps, 0.0) - exact for steps in (4000, 8000))
    assert coarse / fine == pytest.approx(2.0, abs=0.5)


def test_depths_of_modes_alone_are_close_to_the_exact_ones():
    cut, rpm = Cut(4, 0.0, np.pi, 2e9, 8e8), np.linspace(500, 2000, 7)
    exact = cdsem.single_mode_depths(TWO, cut, rpm)
    np.testing.assert_allclose(cdsem.cdsem_depths(TWO, cut, rpm, exact), exact, rtol=0.02)


def test_a_mode_alone_is_a_structure_of_one_mode():
    cut, rpm = Cut(4, 0.0, 1.4, 2e9, 8e8), np.linspace(500, 2000, 5)
    one = Structure(TWO.axis[1:], TWO.omega[1:], TWO.zeta[1:], TWO.stiffness[1:])
    np.testing.assert_array_equal(
        cdsem.single_mode_depths(TWO, cut, rpm)[1], lobes.stability_boundary(one, cut, rpm).depth
    )


def test_the_lowest_of_modes_alone_bounds_the_modes_together_from_neither_side():
    four = Structure(
        np.zeros(4, dtype=int),
        2 * np.pi * np.array([21.4, 34.8, 56.6, 65.6]),
        np.array([0.061, 0.071, 0.036, 0.063]),
        np.array([7.3e6, 4.1e6, 4.2e6, 2.2e6]),
    )
    cut, rpm = Cut(4, 0.0, np.pi, 10145e6, 11036.5e6), np.linspace(500, 2500, 41)
    alone = cdsem.single_mode_depths(four, cut, rpm).min(axis=0)
    together = lobes.stability_boundary(four, cut, rpm).depth
    assert np.any(together < 0.9 * alone)
    assert np.any(together > 1.1 * alone)


def test_where_a_mode_alone_never_chatters_there_is_nothing_to_find():
    exact = np.full((2, 3), np.inf)
    assert np.all(np.isinf(cdsem.cdsem_depths(TWO, Cut(4, 0.0, 1.0, 2e9, 8e8), np.full(3, 900.0), exact)))


@pytest.mark.parametrize("seed", range(4))
def test_governing_modes_are_the_lowest_of_all_modes_and_stiff_ones_are_not_solved(seed):
    rng = np.random.default_rng(seed)
    many = Structure(
        rng.integers(0, 2, size=6),
        2 * np.pi * rng.uniform(40.0, 160.0, size=6),
        rng.uniform(0.02, 0.06, size=6),
        np.array([4e6, 5e6, 7e6, 9e6, 3e8, 5e8]),
    )
    cut = Cut(int(rng.integers(2, 5)), *immersion("up", rng.uniform(0.3, 0.9), 1.0), 2e9, 8e8)
    rpm = np.linspace(500, 2500, 23)
    every, governing = (solve(many, cut, rpm) for solve in (cdsem.single_mode_depths, cdsem.governing_depths))
    np.testing.assert_allclose(governing.min(axis=0), every.min(axis=0), rtol=1e-3)
    np.testing.assert_array_equal(governing.argmin(axis=0), every.argmin(axis=0))
    assert np.isinf(governing[4:]).all()
    safe = cdsem.surely_stable_alone(many, cut)
    assert np.all(every >= safe[:, None])
