"""The noise of the loop against dense linear algebra and against what was injected."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from toy import BETA, POINTS, SIGMA, Wave, block

from metro.loop.fitting import noise as noise_room
from metro.loop.fitting.expectation import updated
from metro.loop.fitting.noise import (
    Noise,
    block_sigma,
    columns,
    diagonal,
    first_noise,
    missed,
    shared,
    whitener,
)


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 12), st.integers(0, 5), st.integers(0, 10_000))
def test_whitening_is_the_dense_inverse_square_root(size, directions, seed):
    rng = np.random.default_rng(seed)
    variance, u = rng.uniform(0.1, 3.0, size), rng.normal(size=(size, directions))
    covariance = np.diag(variance) + u @ u.T
    whiten = whitener(variance, u)
    root = whiten(np.eye(size))
    assert root @ covariance @ root.T == pytest.approx(np.eye(size), abs=1e-9)
    rest = rng.normal(size=size)
    assert np.sum(whiten(rest) ** 2) == pytest.approx(rest @ np.linalg.solve(covariance, rest))


def runs(count, scatter, missed=0.0, zero=0.0, repeats=1):
    """Blocks and their residuals about the true coefficients."""
    rng = np.random.default_rng(5)
    parts = []
    for i in range(count):
        one = block(
            f"r{i}", 1.0 + i % 5, "identify", rng, phased=False, scatter=0.0, condition=f"c{i // repeats}"
        )
        one = replace(one, zeros=np.ones((POINTS, 1)), zero_sd=np.array([0.02]))
        matrix, _ = Wave().design(one, np.zeros(0))
        rest = matrix @ (BETA * scatter * rng.normal(size=2)) + SIGMA * rng.normal(size=POINTS)
        rest = rest + zero * 0.02 * rng.normal() + missed * np.sqrt(2) * np.cos(5 * np.arange(POINTS))
        parts.append((replace(one, measured=matrix @ BETA + rest), matrix, rest))
    return parts


def estimated(parts, prior, steps=120):
    noise = prior
    for _ in range(steps):
        noise = updated(
            noise, prior, [(one, rest, columns(one, noise, matrix, BETA)) for one, matrix, rest in parts]
        )
    return noise


@pytest.mark.parametrize("scatter", [0.005, 0.03])
def test_scatter_between_runs_is_recovered_from_repeats(scatter):
    parts = runs(300, scatter)
    found = estimated(parts, first_noise(0.0, np.full(2, 0.01), [part[0] for part in parts]))
    assert found.scatter == pytest.approx(np.full(2, scatter), rel=0.12)


def test_few_repeats_leave_the_scatter_near_its_prior():
    parts = runs(2, 0.0)
    found = estimated(parts, first_noise(0.0, np.full(2, 0.01), [part[0] for part in parts]))
    assert np.all(found.scatter > 0.006)


def test_size_of_the_zeros_is_recovered():
    parts = runs(300, 0.01, zero=4.0)
    found = estimated(parts, first_noise(0.0, np.full(2, 0.01), [part[0] for part in parts]))
    assert found.zero_factor == pytest.approx(4.0, rel=0.15)


def test_nothing_is_missed_by_the_right_model():
    parts = runs(200, 0.01)
    found = estimated(parts, first_noise(0.0, np.full(2, 0.01), [part[0] for part in parts]))
    rms = np.sqrt(np.mean([np.mean(one.measured**2) for one, *_ in parts]))
    assert found.misfit["x"] * rms < 0.2 * SIGMA


def test_what_the_model_misses_is_measured_relative_to_the_signal():
    parts = [part for part in runs(200, 0.01, missed=0.3) if part[0].setting.feed == 3.0]
    found = estimated(parts, first_noise(0.0, np.full(2, 0.01), [part[0] for part in parts]))
    rms = np.sqrt(np.mean([np.mean(one.measured**2) for one, *_ in parts]))
    # Twelve neighbours weigh as one: an excess of m² is a misfit of m²/12 per element.
    assert found.misfit["x"] * rms == pytest.approx(0.3, rel=0.35)
    assert (
        found.misfit["x"] > 5 * estimated(runs(40, 0.01), first_noise(0.0, np.full(2, 0.01), [])).misfit["x"]
    )


@pytest.mark.parametrize("repeats", [1, 3, 5])
def test_what_is_missed_beyond_the_budget_is_the_same_however_often_it_is_repeated(repeats):
    """A budget of half of it: of what is missed, three quarters of the square are left."""
    waves = 0.3 * np.sqrt(2.0) * np.cos(5 * np.arange(POINTS))
    parts = []
    for one, matrix, rest in runs(60, 0.0, repeats=repeats):
        if one.setting.feed == 3.0 or repeats > 1:
            parts.append((replace(one, measured=matrix @ BETA + rest + waves), matrix, rest + waves))
    parts = [part for part in parts if part[0].setting.feed == 3.0]
    rms = np.sqrt(np.mean([np.mean(one.measured**2) for one, *_ in parts]))
    prior = first_noise(0.15 / rms, np.full(2, 0.001), [part[0] for part in parts])
    prior = replace(prior, repeats=dict.fromkeys(prior.repeats, float(repeats)))
    found = estimated(parts, prior)
    assert found.misfit["x"] * rms == pytest.approx(0.3 * np.sqrt(0.75), rel=0.1)


@pytest.mark.parametrize(("share", "level"), [(0.2, 0.0), (0.0, 2.0), (0.15, 2.0)])
def test_what_is_missed_whatever_the_signal_is_told_from_what_grows_with_it(share, level):
    """Else runs with a small signal would make those with a large one count for nothing."""
    rng, parts = np.random.default_rng(8), []
    for one, matrix, _ in runs(300, 0.0):
        rms = np.sqrt(np.mean(one.measured**2))
        waves = rng.normal(0.0, np.hypot(share * rms, level), POINTS)
        parts.append((one, matrix, waves + rng.normal(0.0, SIGMA, POINTS)))
    found = estimated(parts, first_noise(0.0, np.full(2, 0.01), [part[0] for part in parts]))
    assert found.misfit["x"] == pytest.approx(share, rel=0.15, abs=0.03)
    assert found.level["x"] == pytest.approx(level, rel=0.2, abs=0.3)


def test_signals_of_one_size_leave_all_that_is_missed_relative():
    rng = np.random.default_rng(8)
    parts = [part for part in runs(60, 0.0) if part[0].setting.feed == 3.0]
    parts = [(one, matrix, rng.normal(0.0, 0.3, POINTS)) for one, matrix, _ in parts]
    found = estimated(parts, first_noise(0.0, np.full(2, 0.01), [part[0] for part in parts]))
    assert found.level["x"] == pytest.approx(0.0, abs=1e-9)
    assert found.misfit["x"] > 0.0


def test_what_cuts_miss_is_no_error_of_a_load_test_or_an_instrument():
    """Their axes may have the same names, and quite another unit."""
    one = replace(runs(1, 0.0)[0][0], role="calibrate")
    noise = Noise(0.0, np.full(2, 0.01), {}, misfit={"x": 0.2}, level={"x": 3.0})
    assert diagonal(one, noise) == pytest.approx(diagonal(one, noise.sound))


def test_a_load_test_tells_nothing_of_the_scatter_of_cuts():
    (one, matrix, rest), *_ = runs(1, 0.05)
    load = replace(one, role="calibrate")
    prior = first_noise(0.0, np.full(2, 0.01), [load])
    assert shared(load, prior, matrix, BETA) == pytest.approx(np.full((POINTS, 1), 0.02))
    after = updated(prior, prior, [(load, rest, columns(load, prior, matrix, BETA))])
    assert after.scatter == pytest.approx(prior.scatter)
    assert after.misfit == {}


def test_the_budget_does_not_average_out_over_repeats():
    one = runs(1, 0.0)[0][0]
    alone = diagonal(one, Noise(0.01, np.full(2, 0.01), {one.condition: 1})) - SIGMA**2
    three = diagonal(one, Noise(0.01, np.full(2, 0.01), {one.condition: 3})) - SIGMA**2
    rms = np.sqrt(np.mean(one.measured**2))
    assert alone == pytest.approx(np.full(POINTS, (0.01 * rms) ** 2))
    assert three == pytest.approx(3 * alone)


def log_determinant(block, noise, directions):
    whiten = noise_room.whitener(diagonal(block, noise), directions)
    return noise_room.log_determinant(block, noise, directions, whiten)


def test_misfit_weighs_many_neighbours_as_one_element():
    one = runs(1, 0.0)[0][0]
    noise = Noise(0.0, np.full(2, 0.01), {}, misfit={"x": 1.0})
    rms2 = np.mean(one.measured**2)
    assert diagonal(one, noise) - SIGMA**2 == pytest.approx(
        np.full(POINTS, noise_room.MISFIT_CORRELATION * rms2)
    )
    # Counted as elements, each still has its own variance, a twelfth as often, in units of the noise.
    assert log_determinant(one, replace(noise, misfit={}), np.zeros((POINTS, 0))) == pytest.approx(-POINTS)
    once = SIGMA**2 + rms2
    count = POINTS * once / (SIGMA**2 + noise_room.MISFIT_CORRELATION * rms2)
    by_count = count * (np.log(once / SIGMA**2) - 1.0)
    assert log_determinant(one, noise, np.zeros((POINTS, 0))) == pytest.approx(by_count)


def test_what_is_shared_adds_what_dense_algebra_says_and_nothing_by_a_misfit():
    one, matrix, _ = runs(1, 0.02)[0]
    noise = Noise(0.01, np.array([0.01, 0.03]), {one.condition: 2}, misfit={"x": 1.0})
    directions = shared(one, noise, matrix, BETA)
    variance = diagonal(one, replace(noise, misfit={}))
    dense = np.linalg.slogdet(np.diag(variance) + directions @ directions.T)[1] - np.sum(np.log(variance))
    for kind in (noise, replace(noise, misfit={})):
        added = log_determinant(one, kind, directions) - log_determinant(one, kind, np.zeros((POINTS, 0)))
        assert added == pytest.approx(dense)


@pytest.mark.parametrize("start", [0.0, 0.02, 0.3])
@pytest.mark.parametrize(("bad", "off", "below"), [(0.05, 0.03, 0.5), (0.1, 0.03, 0.3), (0.04, 0.025, 0.2)])
def test_a_misfit_stays_where_it_is_found_wherever_it_is_sought_from(start, bad, off, below):
    """Elements that are measured well are missed, others are nearer than their error: whole steps go on."""
    well, turn = np.arange(POINTS) % 2 == 0, np.where(np.arange(POINTS) % 4 < 2, 1.0, -1.0)
    rest = np.where(well, off, below * bad) * turn
    parts = [
        (replace(one, sigma=np.where(well, 0.01, bad), measured=matrix @ BETA + rest), matrix, rest)
        for one, matrix, _ in runs(3, 0.0)
    ]
    prior = first_noise(0.0, np.full(2, 0.01), [part[0] for part in parts])
    found = (estimated(parts, replace(prior, misfit={"x": start}), steps) for steps in (80, 81))
    near, still = (np.sqrt(np.mean([missed(part[0], one) for part in parts])) for one in found)
    assert near == pytest.approx(still, rel=0.02)
    assert still > 0.0


def test_sigma_of_the_comparison_is_the_spread_of_simulated_runs():
    rng = np.random.default_rng(3)
    one, matrix, _ = runs(1, 0.0)[0]
    synthesis = rng.normal(size=(7, POINTS))
    one = replace(one, synthesis=synthesis, repeats=4)
    noise = Noise(0.02, np.array([0.01, 0.03]), {one.condition: 5}, zero_factor=3.0)
    rms = np.sqrt(np.mean(one.measured**2))
    draws = 20000
    values = SIGMA * rng.normal(size=(draws, POINTS)) + 0.02 * rms * rng.normal(size=(draws, POINTS))
    values += (rng.normal(size=(draws, 2)) * BETA * noise.scatter) @ matrix.T + 0.06 * rng.normal(
        size=(draws, 1)
    )
    assert block_sigma(one, noise, matrix, BETA) == pytest.approx(
        (values @ synthesis.T).std(axis=0), rel=0.03
    )


@pytest.mark.parametrize("part", [0.0, 0.4, 1.0])
def test_what_repeats_share_of_an_error_that_they_may_share_is_told_by_them(part):
    """Each condition has an error of its own in all repeats, the rest is each run's."""
    rng = np.random.default_rng(8)
    parts = []
    for one, matrix, rest in runs(120, 0.0, repeats=3):
        size = 3.0 * SIGMA
        if int(one.run[1:]) % 3 == 0:
            common = size * np.sqrt(part) * rng.normal(size=POINTS)
        own = size * np.sqrt(1.0 - part) * rng.normal(size=POINTS)
        error = rest + common + own
        told = replace(one, measured=matrix @ BETA + error, alike=np.full(POINTS, size))
        parts.append((told, matrix, error))
    blocks = [each[0] for each in parts]
    assert estimated(parts, first_noise(0.0, np.full(2, 0.01), blocks), steps=4).alike == pytest.approx(
        part, abs=0.06
    )
    alone = [replace(one, condition=one.run) for one in blocks]
    lonely = [(one, *rest) for one, (_, *rest) in zip(alone, parts, strict=True)]
    assert estimated(lonely, first_noise(0.0, np.full(2, 0.01), alone), steps=4).alike == 1.0


def test_only_what_a_model_gets_wrong_may_be_the_same_in_all_conditions():
    """The variance of a mean over all runs: the budget stays, what repeats share falls by the conditions."""
    blocks = [replace(one, alike=np.full(POINTS, SIGMA)) for one, _, _ in runs(12, 0.0, repeats=3)]
    noise = noise_room.all_alike(replace(first_noise(0.1, np.zeros(2), blocks), alike=0.5))
    signal = np.mean(blocks[0].measured ** 2)
    mean = diagonal(blocks[0], noise) / 12
    expected = (1.0 + 1.0 * (0.5 + 0.5 * 3)) * SIGMA**2 / 12 + 0.01 * signal
    assert mean == pytest.approx(np.full(POINTS, expected))


def test_a_zero_that_hardly_shows_is_not_blown_up_to_explain_what_a_model_misses():
    """Runs are off by hundreds of times what their zeros may be: that is no zero."""
    faint = np.sqrt(2.0 / POINTS) * SIGMA / 0.02
    parts = [
        (replace(one, zeros=faint * one.zeros), matrix, rest)
        for one, matrix, rest in runs(60, 0.0, zero=100.0 * SIGMA / 0.02)
    ]
    found = estimated(parts, first_noise(0.0, np.full(2, 0.01), [part[0] for part in parts]))
    assert found.zero_factor <= 4.0
    one = parts[0][0]
    assert np.mean(missed(one, found)) > 0.04 * np.mean(one.measured**2)


def test_what_calibrates_shares_what_it_does_not_identify_and_no_scatter():
    one = block("r1", 1.0, "identify", np.random.default_rng(3), phased=False)
    beside = np.random.default_rng(4).normal(size=(POINTS, 2))
    design, _ = Wave().design(one, np.zeros(0))
    noise = Noise(0.0, np.array([0.01, 0.02]), {})
    tests = replace(one, role="calibrate", unidentified=beside)
    assert np.array_equal(shared(tests, noise, design, BETA), beside)
    assert shared(replace(one, unidentified=beside), noise, design, BETA).shape[1] == 4
