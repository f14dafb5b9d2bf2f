"""Parameters drawn from their prior and weighed: against integrals over a fine grid."""

from dataclasses import replace

import numpy as np
import pytest
from label_toy import GATES, SHIFT, SLOPE, Line, problem
from scipy.special import logsumexp

from metro.loop.labels.evidence import Errors
from metro.loop.labels.hypotheses import LabelEvidence, changed, hypothesis, pursued
from metro.loop.labels.points import Nearby, quantile
from metro.loop.labels.problem import tests_of as told_by

TASK = problem(Line(slope=0.8, shift=-0.4), 5)
TESTS, _ = told_by(TASK, "identify")
NONE = Errors(np.zeros((1, len(TASK.point_rpm))), np.array([TESTS.model_sd]))
EVIDENCE = LabelEvidence(TASK.boundaries, TASK.estimates, TESTS, NONE, GATES.seed)


def grid(effects, count):
    """Points of the prior on a fine grid, and their log-likelihood."""
    share = (np.arange(count) + 0.5) / count
    axes = [quantile(effect.parameters[0], share) for effect in effects]
    theta = np.stack([a.ravel() for a in np.meshgrid(*axes, indexing="ij")], axis=1)
    models = [Line(**{e.name: v for e, v in zip(effects, row, strict=True)}) for row in theta]
    depth = np.stack([model.boundary(TASK.point_rpm) for model in models])
    found = EVIDENCE.likelihood(depth, np.full_like(depth, 300.0))
    return theta, found.sum(axis=2)[:, 0]


@pytest.mark.parametrize("effects", [(SLOPE,), (SHIFT, SLOPE)])
def test_evidence_and_posterior_are_those_of_a_fine_grid(effects):
    theta, log = grid(effects, 2000 if len(effects) == 1 else 150)
    known = hypothesis(effects[:1], EVIDENCE) if len(effects) > 1 else None
    found = hypothesis(effects, EVIDENCE, known)
    assert found.log_evidence == pytest.approx(logsumexp(log) - np.log(len(log)), abs=0.35)
    weights = np.exp(log - logsumexp(log))
    for i, effect in enumerate(effects):
        mean = weights @ theta[:, i]
        sd = np.sqrt(weights @ (theta[:, i] - mean) ** 2)
        told = found.parameters(effect.name)["size"]
        assert told["value"] == pytest.approx(mean, abs=0.6 * sd)
        assert told["ci95"][1] - told["ci95"][0] == pytest.approx(3.92 * sd, rel=0.4)


@pytest.mark.parametrize("effects", [(SLOPE,), (SHIFT, SLOPE)])
def test_enough_points_are_left_for_the_ends_of_an_interval(effects):
    found = hypothesis(effects, EVIDENCE)
    assert 1.0 / np.sum(found.weights**2) > 50.0


def test_what_is_not_solved_is_learnt_and_its_error_is_as_told():
    found = hypothesis((SHIFT, SLOPE), EVIDENCE)
    exact = TASK.boundaries([changed(found, i) for i in range(len(found.theta))])[0]
    error = found.depth - EVIDENCE.testable(exact)
    weight = found.weights[:, None] * np.ones_like(error)
    rough = np.stack([TASK.estimates([changed(found, i)])[0][0] for i in range(len(found.theta))]) - exact
    assert np.average(error**2, weights=weight) < 0.01 * np.average(rough**2, weights=weight)
    assert np.average(error**2, weights=weight) < 4.0 * np.average(found.unsure**2, weights=weight)


def test_what_is_given_is_no_coordinate_of_the_search_and_has_no_interval():
    (size,) = SLOPE.parameters
    given = replace(size, name="at", lower=3.0, upper=3.0, plausible=None)
    scaled = replace(
        SLOPE,
        parameters=(given, size),
        apply=lambda model, values: SLOPE.apply(model, {"size": values["size"] * values["at"] / 3.0}),
    )
    found, plain = hypothesis((scaled,), EVIDENCE), hypothesis((SLOPE,), EVIDENCE)
    np.testing.assert_array_equal(found.cube, plain.cube)
    np.testing.assert_array_equal(found.theta, np.insert(plain.theta, 0, 3.0, axis=1))
    assert found.log_evidence == pytest.approx(plain.log_evidence)
    estimates = found.parameters("slope")
    assert (estimates["at"]["value"], estimates["at"]["ci95"]) == (3.0, None)
    assert estimates["size"]["ci95"] == pytest.approx(plain.parameters("slope")["size"]["ci95"])


def test_nothing_has_one_prediction():
    nothing = hypothesis((), EVIDENCE)
    assert nothing.theta.shape == (1, 0)
    np.testing.assert_allclose(nothing.depth[0], Line().boundary(TASK.point_rpm))


@pytest.mark.parametrize("step", [-0.3, 0.1, 0.4])
def test_where_the_boundary_jumps_it_is_solved_until_the_interval_is_that_of_a_fine_grid(step):
    """Beyond ``step`` of the slope another lobe is the lowest; what is quickly estimated does not know it."""

    def solved(changes):
        models = [change(Line()) for change in changes]
        jump = 0.8 * np.tanh((np.array([[model.slope] for model in models]) - step) / 0.02)
        depth = np.stack([model.boundary(TASK.point_rpm) for model in models]) + jump
        return depth, np.full_like(depth, 300.0)

    evidence = LabelEvidence(solved, TASK.estimates, TESTS, NONE, GATES.seed)
    found = hypothesis((SLOPE,), evidence)
    theta = quantile(SLOPE.parameters[0], (np.arange(2000) + 0.5) / 2000)
    depth, _ = solved([lambda _, v=v: Line(slope=v) for v in theta])
    log = evidence.likelihood(depth, np.full_like(depth, 300.0)).sum(axis=2)[:, 0]
    below = np.cumsum(np.exp(log - logsumexp(log)))
    told = found.parameters("slope")["size"]["ci95"]
    assert told == pytest.approx(np.interp([0.025, 0.975], below, theta), abs=0.12)
    assert found.log_evidence == pytest.approx(logsumexp(log) - np.log(len(log)), abs=0.35)


@pytest.mark.parametrize("width", [0.02, 0.5])
def test_points_drawn_about_others_are_folded_back_into_the_cube(width):
    cloud = Nearby(np.array([[0.01, 1.0], [0.5, 0.0]]), np.full(2, width))
    points = np.concatenate([cloud.drawn(np.random.default_rng(seed), 3) for seed in range(40)])
    assert points.min() >= 0.0
    assert points.max() <= 1.0
    near = np.abs(points[:, None, :2] - cloud.centres).max(axis=2).min(axis=1)
    assert np.quantile(near, 0.9) < 3.0 * width


def test_what_is_pursued_ends_where_it_would_have_ended_at_once():
    first = hypothesis((SHIFT, SLOPE), EVIDENCE, rounds=1)
    whole = hypothesis((SHIFT, SLOPE), EVIDENCE, rounds=4)
    assert len(first.theta) < len(whole.theta)
    ended = pursued(first, 4)
    np.testing.assert_array_equal(ended.theta, whole.theta)
    np.testing.assert_array_equal(ended.weights, whole.weights)
    assert pursued(ended, 4) is ended
