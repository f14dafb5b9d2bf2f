"""What labels say of the boundary: closed forms and brute force."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from metro.loop.labels import evidence as room
from metro.loop.labels.evidence import (
    Errors,
    Labels,
    Likelihood,
    drawn_errors,
    left_out,
    log_evidence,
    posterior,
)

RPM = np.array([2000.0, 3000.0])
TOOTH_HZ = np.array([80.0, 110.0])
NONE = np.full(3, np.nan)


def labelled(point, depth, unstable, chatter_hz=None, error=1e-9):
    depth = np.asarray(depth)
    chatter = np.full(len(depth), np.nan) if chatter_hz is None else np.asarray(chatter_hz)
    return Labels(
        np.asarray(point),
        depth,
        np.asarray(unstable, float),
        chatter,
        RPM,
        TOOTH_HZ,
        0.15,
        error,
        np.zeros(2),
    )


def at(tests, boundary, chatter=300.0):
    """Log-likelihood (j,) of one boundary, the same at both points."""
    depth = np.full((1, 2), boundary)
    errors = Errors(np.zeros((1, 2)), np.array([0.15]))
    return Likelihood.of(tests, errors)(depth, np.full((1, 2), chatter))[0, 0]


@pytest.mark.parametrize("unstable", [0.0, 1.0])
def test_one_label_says_what_a_normal_error_of_its_own_variance_says(unstable):
    tests = labelled([0], [0.1], [unstable])
    sign = 1.0 if unstable else -1.0
    sd = 0.15 * np.sqrt(room.OF_SPEED + room.OF_TEST)
    for boundary in (-0.1, 0.1, 0.3):
        expected = norm.logcdf(sign * (0.1 - boundary) / sd)
        assert at(tests, boundary)[0] == pytest.approx(expected, abs=0.02)


def test_labels_of_one_speed_share_its_error_as_brute_force_says():
    tests = labelled([0, 0, 0], [-0.1, 0.0, 0.1], [1, 1, 1])
    error = np.linspace(-0.8, 0.8, 100001)
    each = norm.cdf((np.array([[-0.1], [0.0], [0.1]]) - 0.2 - error) / (0.15 * np.sqrt(room.OF_TEST)))
    density = norm.pdf(error, scale=0.15 * np.sqrt(room.OF_SPEED))
    expected = np.log(np.trapezoid(each.prod(axis=0) * density, error))
    assert at(tests, 0.2)[0] == pytest.approx(expected, abs=0.01)
    alone = sum(at(labelled([0], [depth], [1]), 0.2)[0] for depth in (-0.1, 0.0, 0.1))
    assert at(tests, 0.2)[0] > alone + 1.0


def test_a_wrong_label_costs_no_more_than_its_probability():
    tests = labelled([0], [3.0], [0.0], error=0.01)
    assert at(tests, 0.0)[0] == pytest.approx(np.log(0.01), abs=1e-3)


def test_a_chatter_frequency_speaks_for_the_boundary_that_predicts_it():
    heard = labelled([1], [0.5], [1.0], [300.0])
    heard = replace(heard, tooth_hz=np.full(2, 1e6))  # its other lines are far off
    right, near, wrong, none = (at(heard, 0.0, hz)[0] for hz in (300.0, 315.0, 600.0, np.nan))
    assert right > near > wrong == none
    stray = room.STRAY / room.STRAY_WIDTH
    peak = (1 - room.STRAY) * room.LINES[0] / (np.sqrt(2 * np.pi) * room.FREQUENCY_SD) + stray
    assert right - wrong == pytest.approx(np.log(peak / stray), abs=1e-9)


@pytest.mark.parametrize("line", [-2, -1, 1, 2])
def test_chatter_may_be_heard_so_many_teeth_from_its_own_frequency(line):
    heard = labelled([1], [0.5], [1.0], [2000.0])
    aside, own, none = (at(heard, 0.0, hz)[0] for hz in (2000.0 - line * 110.0, 2000.0, np.nan))
    away = at(replace(heard, tooth_hz=np.full(2, 500.0)), 0.0, 2000.0 - line * 110.0)[0]
    assert none < away < aside < own


def test_lines_take_no_more_than_what_follows_the_model():
    assert sum(room.LINES.values()) == pytest.approx(1.0)


def test_evidence_is_the_mean_likelihood_under_the_prior():
    likelihood = np.log(np.array([[[0.2, 0.5]], [[0.6, 0.1]]]))  # two boundaries, one deviation, two speeds
    prior = np.array([0.75, 0.25])
    assert log_evidence(likelihood, prior) == pytest.approx(np.log(0.75 * 0.1 + 0.25 * 0.06))
    np.testing.assert_allclose(posterior(likelihood, prior), np.array([0.075, 0.015]) / 0.09)
    first = (0.75 * 0.1 + 0.25 * 0.06) / (0.75 * 0.5 + 0.25 * 0.1)
    assert left_out(likelihood, prior)[0] == pytest.approx(np.log(first))


def test_speeds_left_out_are_whole():
    tests = labelled([0, 1, 1], [0.0, 0.1, 0.2], [0, 1, 1])
    assert list(tests.speeds) == [2000.0, 3000.0]
    assert list(tests.take(tests.point == 1).speeds) == [3000.0]
    same = replace(tests, rpm=np.array([2500.0, 2500.0]))  # two cuts at one speed
    assert at(same, 0.0).shape == (1,)
    assert at(same, 0.0).sum() == pytest.approx(at(tests, 0.0).sum())


def test_errors_have_the_variances_that_are_stated_and_sizes_that_are_all_alike():
    tests = replace(labelled([0, 1], [0.0, 0.0], [1, 1]), cut=np.array([0, 1]))
    errors = drawn_errors(tests, np.zeros((70_000, 2)), 5)
    relative = errors.deviations / errors.sd[:, None]
    covariance = np.cov(relative.T)
    np.testing.assert_allclose(np.diag(covariance), room.SHARED + room.OF_CUT, rtol=0.03)
    assert covariance[0, 1] == pytest.approx(room.SHARED, rel=0.05)
    assert np.unique(errors.sd, return_counts=True)[1].std() < 1.0


def test_labels_far_from_the_boundary_say_that_the_errors_are_large():
    near, far = (labelled([0, 0, 1, 1], [by - 0.1, by + 0.1] * 2, [0, 1, 0, 1]) for by in (0.0, 0.8))
    weights = []
    for tests in (near, far):
        errors = drawn_errors(tests, np.zeros((700, 2)), 5)
        flat = np.zeros((1, 2))
        likelihood = Likelihood.of(tests, errors)(flat, np.full((1, 2), np.nan))
        weights.append(room.of_errors(likelihood, np.ones(1), errors) @ errors.sd)
    assert weights[0] < 0.25
    assert weights[1] > 0.35


def test_what_is_not_known_of_a_boundary_moves_it_by_so_much_in_each_draw():
    tests, draws = labelled([0, 0, 1], [-0.2, 0.3, 0.1], [0, 1, 1]), 40
    errors = Errors(np.zeros((draws, 2)), np.full(draws, 0.15))
    likelihood = Likelihood.of(tests, errors)
    boundary, hz, unsure = np.zeros((1, 2)), np.full((1, 2), 300.0), np.array([[0.3, 0.1]])
    found = likelihood(boundary, hz, unsure)
    each = [likelihood(boundary + unsure * own, hz)[0, 0] for own in likelihood.draws.own]
    np.testing.assert_allclose(found[0], each, atol=1e-12)
    assert np.ptp(found, axis=1).min() > 0.1
