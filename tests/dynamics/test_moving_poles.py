"""Poles that move from file to file widen the intervals; made-up structures, a line per file written out."""

import numpy as np
import pytest

from metro.dynamics.by_file import own_fits, with_files
from metro.dynamics.modal import identify_modes
from metro.dynamics.modes import modal_constants
from metro.dynamics.refine import Data, refine

HZ, ZETA, STIFFNESS = np.array([40.0, 71.0, 110.0]), np.array([0.02, 0.015, 0.01]), 1e7 * np.array([1, 3, 6])
FREQUENCY = np.arange(20.0, 140.0, 0.25)
FILES = 6
PLACES = np.sin(np.pi * np.outer(np.arange(1, FILES + 1) / (FILES + 1), [1, 2, 3]))
WAY = [[np.array([i]) for i in range(FILES)]]
AT_SENSOR = STIFFNESS / PLACES[0] ** 2


def responses(seed, half_widths, damping):
    """Hammer at six places, sensor at the first; the poles of each file shifted by so much, 1 % of noise."""
    rng, columns = np.random.default_rng(seed), []
    for place in PLACES:
        natural = HZ * np.exp(half_widths * ZETA * rng.normal(size=3))
        zeta = ZETA * np.exp(damping * rng.normal(size=3))
        ratio = FREQUENCY[:, None] / natural
        columns.append((place * PLACES[0] / STIFFNESS / (1 - ratio**2 + 2j * zeta * ratio)).sum(axis=1))
    frf = np.stack(columns, axis=1)
    sd = 0.01 * np.sqrt(np.mean(np.abs(frf) ** 2) / 2)
    return frf + sd * (rng.normal(size=frf.shape) + 1j * rng.normal(size=frf.shape))


@pytest.fixture(scope="module")
def moving():
    return [identify_modes(FREQUENCY, responses(seed, 0.3, 0.1), driving=0, files=WAY) for seed in range(8)]


def test_a_pole_that_moves_is_one_mode(moving):
    """Common poles alone take it for several that nearly coincide."""
    assert [len(model.modes) for model in moving] == [3] * len(moving)
    alone = identify_modes(FREQUENCY, responses(0, 0.3, 0.1), driving=0)
    assert len(alone.modes) > 3


@pytest.mark.parametrize(("name", "truth"), [("frequency", HZ), ("damping", ZETA), ("stiffness", AT_SENSOR)])
def test_the_intervals_contain_the_truth(moving, name, truth):
    inside = [
        abs(getattr(mode, name) - true) < 1.96 * getattr(mode, name + "_sd")
        for model in moving
        for mode, true in zip(model.modes, truth, strict=True)
    ]
    assert np.mean(inside) > 0.85


def test_the_scatter_of_the_poles_is_found(moving):
    shifts = [
        each.frequency.scatter / zeta
        for model in moving
        for each, zeta in zip(model.moved, ZETA, strict=True)
    ]
    assert np.median(shifts) == pytest.approx(0.3, rel=0.25)


def test_where_nothing_moves_the_intervals_stay():
    ratios = []
    for seed in range(4):
        frf = responses(seed, 0.0, 0.0)
        alone = identify_modes(FREQUENCY, frf, driving=0)
        model = identify_modes(FREQUENCY, frf, driving=0, files=WAY)
        assert len(model.modes) == 3
        ratios += [
            getattr(mode, name) / getattr(without, name)
            for mode, without in zip(model.modes, alone.modes, strict=True)
            for name in ("frequency_sd", "damping_sd", "stiffness_sd")
        ]
    assert np.median(ratios) < 1.1
    assert np.min(ratios) > 0.999


def test_a_close_pair_that_every_file_shows_remains_a_pair():
    natural, rng = np.array([60.0, 61.5]), np.random.default_rng(0)
    shape = np.array([[1.0, 0.8], [0.7, -0.9], [-0.5, 1.0], [0.9, 0.4]])
    ratio = FREQUENCY[:, None] / natural
    modal = 1e-7 / (1 - ratio**2 + 2j * 0.02 * ratio)
    frf = modal @ (shape * shape[0]).T
    sd = 0.01 * np.sqrt(np.mean(np.abs(frf) ** 2) / 2)
    frf = frf + sd * (rng.normal(size=frf.shape) + 1j * rng.normal(size=frf.shape))
    model = identify_modes(FREQUENCY, frf, driving=0, files=[[np.array([i]) for i in range(4)]])
    np.testing.assert_allclose([mode.frequency for mode in model.modes], natural, rtol=2e-3)


def test_a_pole_that_strays_to_another_mode_says_nothing_of_its_own():
    """The second file hardly shows the broad mode, but has one beside the third that the common fit lacks."""
    natural, zeta = np.array([40.0, 71.0, 110.0, 113.0]), np.array([0.02, 0.2, 0.01, 0.03])
    ratio = FREQUENCY[:, None] / natural
    modal = 1e-7 / (1 - ratio**2 + 2j * zeta * ratio)
    frf = modal @ np.array([[1.0, 1.0, 1.0, 0.0], [1.0, 0.3, 1.0, 0.3]]).T
    data = Data(2 * np.pi * FREQUENCY, frf, np.full(frf.shape, 1e9))
    common = refine(data, 2 * np.pi * natural[:3], zeta[:3], real=False, iterations=0)
    fits = own_fits(data, common, WAY[0][:2])
    np.testing.assert_array_equal([each.strayed for each in fits], [[False] * 3, [False, True, False]])
    assert fits[1].fit.omega[1] == pytest.approx(common.omega[1])
    alone = modal_constants(common, 1, None, common.residues[1])
    mode, moved = with_files(alone, 1, fits[1:], driving=None, decay=0.0, fit=common)
    assert moved is not None
    assert not mode.resolved
    assert mode.frequency == pytest.approx(alone.frequency)
    assert 1.96 * mode.frequency_sd == pytest.approx(0.2 * mode.frequency)
