"""Intervals from what leaving out a run does: brute force, closed forms, Monte Carlo."""

import numpy as np
import pytest
from scipy import stats

from metro.loop.fitting.covariance import between_runs
from metro.loop.fitting.system import System


def system(designs, rests, weight=()):
    """Runs of whitened designs and residuals, as the fit leaves them; the last columns have the prior."""
    weight = np.asarray(weight, dtype=float)
    rows = []
    for design, rest in zip(designs, rests, strict=True):
        base, effect = np.split(design, [design.shape[1] - len(weight)], axis=1)
        rows.append((rest, base, effect, np.zeros((len(rest), 0))))
    bases = designs[0].shape[1] - len(weight)
    precision = np.diag([*np.zeros(bases), *weight])
    zero = np.zeros(len(precision))
    return System(rows, [], {}, {}, zero, zero, precision)


def fitted(designs, values):
    solution = np.linalg.lstsq(np.concatenate(designs), np.concatenate(values), rcond=None)[0]
    return solution, [value - design @ solution for design, value in zip(designs, values, strict=True)]


def drawn(rng, runs=9, points=6):
    """Designs of two coefficients, told well by some runs and badly by others."""
    return [rng.normal(size=(points, 2)) * rng.uniform(0.3, 2.0, 2) for _ in range(runs)]


def test_the_factor_is_that_of_fits_without_each_run():
    rng = np.random.default_rng(1)
    designs = drawn(rng)
    values = [design @ [3.0, -2.0] + rng.normal(size=len(design)) for design in designs]
    solution, rests = fitted(designs, values)
    moves = [
        fitted(designs[:i] + designs[i + 1 :], values[:i] + values[i + 1 :])[0] - solution
        for i in range(len(designs))
    ]
    # Satterthwaite's degrees of freedom from the dense projection of all elements
    design = np.concatenate(designs)
    inverse = np.linalg.inv(design.T @ design)
    rest_of = np.eye(len(design)) - design @ inverse @ design.T
    run = np.repeat(np.arange(len(designs)), [len(each) for each in designs])
    expected = []
    for k in range(2):
        pulls = np.zeros((len(designs), len(design)))
        for i in range(len(designs)):
            others = design[run != i]
            pulls[i, run == i] = np.linalg.solve(others.T @ others, design[run == i].T)[k]
        covariance = pulls @ rest_of @ pulls.T
        dof = np.trace(covariance) ** 2 / np.sum(covariance**2)
        sd = np.sqrt(np.sum(np.square(moves), axis=0)[k] / inverse[k, k])
        expected.append(sd * stats.t.ppf(0.975, dof) / stats.t.ppf(0.975, len(designs) - 1))
    assert between_runs(system(designs, rests)) == pytest.approx(expected)


def test_of_a_plain_mean_it_is_the_scatter_of_the_runs():
    # Each run tells the mean once: the moves are r_i/(n − 1), and the degrees of freedom n − 1.
    values = np.array([1.0, 4.0, 2.0, 5.0, 3.5])
    designs = [np.ones((1, 1))] * 5
    solution, rests = fitted(designs, [values[i : i + 1] for i in range(5)])
    assert solution == pytest.approx([values.mean()])
    assert between_runs(system(designs, rests)) == pytest.approx([values.std(ddof=1) * np.sqrt(5 / 4)])


def test_what_a_run_says_of_its_own_unknown_is_no_evidence():
    rng = np.random.default_rng(2)
    designs = drawn(rng)
    rests = fitted(designs, [rng.normal(size=6) for _ in designs])[1]
    own = [rng.normal(size=(6, 1)) for _ in designs]
    free = []
    for design, rest, column in zip(designs, rests, own, strict=True):
        away = np.eye(6) - column @ np.linalg.pinv(column)
        free.append((away @ rest, away @ design))
    with_own = System(
        [(r, d, np.zeros((6, 0)), o) for r, d, o in zip(rests, designs, own, strict=True)],
        [], {}, {}, np.zeros(2), np.zeros(2), np.zeros((2, 2)),
    )  # fmt: skip
    expected = between_runs(system([d for _, d in free], [r for r, _ in free]))
    assert between_runs(with_own) == pytest.approx(expected)


def test_what_a_single_run_tells_keeps_the_deviation_of_the_normal_matrix():
    rng = np.random.default_rng(3)
    designs = drawn(rng)
    alone = [np.column_stack([each, np.full(6, float(i == 4))]) for i, each in enumerate(designs)]
    unseen = [np.column_stack([each, np.zeros(6)]) for each in designs]
    values = [rng.normal(size=6) for _ in designs]
    for cases in (alone, unseen):
        factor = between_runs(system(cases, fitted(cases, values)[1]))
        assert factor[2] == 1.0
        assert np.all(factor[:2] != 1.0)


def test_a_prior_on_an_effect_stays_when_a_run_goes():
    rng = np.random.default_rng(4)
    designs = drawn(rng, runs=6)
    rests = [rng.normal(size=6) for _ in designs]
    strong = between_runs(system(designs, rests, weight=[1e9]))
    without = between_runs(system([each[:, :1] for each in designs], rests))
    assert strong[0] == pytest.approx(without[0], rel=1e-6)


def deviation(designs, rests):
    whole = np.concatenate(designs)
    return np.sqrt(np.diag(np.linalg.inv(whole.T @ whole))) * between_runs(system(designs, rests))


@pytest.mark.parametrize("declared", [0.1, 0.5, 3.0])
def test_the_deviation_does_not_depend_on_the_size_of_the_error_that_the_weights_declare(declared):
    rng = np.random.default_rng(5)
    designs = drawn(rng)
    rests = fitted(designs, [rng.normal(size=6) for _ in designs])[1]
    other = deviation([each / declared for each in designs], [each / declared for each in rests])
    assert other == pytest.approx(deviation(designs, rests))


def test_what_less_than_two_runs_tell_depends_on_it():
    # Nearly all that is known of the second coefficient comes from the first run.
    rng = np.random.default_rng(8)
    designs = [rng.normal(size=(6, 2)) * [1.0, 30.0 if i == 0 else 1.0] for i in range(12)]
    rests = fitted(designs, [rng.normal(size=6) for _ in designs])[1]
    other = deviation([each / 2.0 for each in designs], [each / 2.0 for each in rests])
    assert other / deviation(designs, rests) == pytest.approx([1.0, 2.0])


def test_intervals_hold_where_the_runs_scatter_and_the_weights_know_nothing_of_it():
    # The weights believe that the elements of a run are independent; half of the error is shared.
    rng = np.random.default_rng(6)
    truth, inside = np.array([3.0, -2.0]), []
    for _ in range(1000):
        designs = [rng.normal(size=(6, 2)) * rng.uniform(0.7, 1.4, 2) for _ in range(12)]
        values = [each @ (truth + 0.7 * rng.normal(size=2)) + rng.normal(size=6) for each in designs]
        solution, rests = fitted(designs, values)
        inside.append(np.abs(solution - truth) < stats.t.ppf(0.975, 11) * deviation(designs, rests))
    assert 0.94 <= np.mean(inside) <= 0.975  # the jackknife errs to the safe side
