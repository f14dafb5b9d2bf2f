"""The joint fit against dense generalised least squares, a general optimiser, and Monte Carlo."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import optimize, stats
from toy import BEND, BETA, GATES, RIPPLE, Wave, problem
from toy import block as toy_block

from metro.loop.checks.evidence import compare, hold_out, leave_out, missed, surviving_share, weights
from metro.loop.checks.left_out import most_missed
from metro.loop.checks.predictive import predictive
from metro.loop.fitting import noise as noise_room
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.descent import descend
from metro.loop.fitting.fit import fit, refit, score
from metro.loop.fitting.noise import first_noise
from metro.loop.fitting.system import (
    State,
    inverse,
    linearised,
    normal_equations,
    own_step,
)


def prior_of(task, blocks):
    return first_noise(GATES.model_form_budget, task.scatter, blocks)


def dense_covariance(block, noise, model, nuisance, beta):
    matrix, _ = model.design(block, nuisance)
    shared = noise_room.shared(block, noise, matrix, beta)
    return np.diag(noise_room.diagonal(block, noise)) + shared @ shared.T


def test_without_effects_the_fit_is_generalised_least_squares():
    task = problem(1, phased=False)
    blocks = task.role("identify")
    found = fit(Candidate(task.base), blocks, prior_of(task, blocks))

    def dense(noise, runs):
        normal, right = np.zeros((2, 2)), np.zeros(2)
        for block in runs:
            matrix, _ = task.base.design(block, np.zeros(0))
            weight = np.linalg.inv(dense_covariance(block, noise, task.base, np.zeros(0), found.beta))
            normal += matrix.T @ weight @ matrix
            right += matrix.T @ weight @ block.measured
        return np.linalg.solve(normal, right), np.linalg.inv(normal)

    beta, covariance = dense(found.noise, blocks)
    assert np.abs(found.beta - beta).max() < 0.02 * np.sqrt(np.diag(covariance)).min()
    sd, known = np.sqrt(np.diag(found.covariance)), np.sqrt(np.diag(covariance))
    assert found.covariance / np.outer(sd, sd) == pytest.approx(covariance / np.outer(known, known), rel=1e-3)
    # How far the parameters are off is what leaving one run out moves them by, widened for few runs.
    left = [dense(found.noise, [b for b in blocks if b is not block])[0] for block in blocks]
    moved = np.sqrt(np.sum((np.array(left) - beta) ** 2, axis=0))
    assert np.all(sd > 0.999 * moved)
    assert np.all(sd < 1.5 * moved)


def test_log_likelihood_is_that_of_the_dense_gaussian():
    task = problem(2)
    blocks = task.role("identify")
    found = fit(Candidate(task.base), blocks, prior_of(task, blocks))
    noise = replace(found.noise, misfit={})  # with misfit, elements are deliberately counted together
    state = State(found.theta, found.beta, dict(found.nuisance))
    reached = linearised(found.candidate, blocks, noise, state, derivatives="none")
    for block in blocks:
        covariance = dense_covariance(block, noise, task.base, found.nuisance[block.run], found.beta)
        dense = stats.multivariate_normal(found.predict(block), covariance).logpdf(block.measured)
        # in units of the variance that no model shares, and one for each element
        constant = 0.5 * len(block.measured) * (np.log(2 * np.pi) + 1.0)
        constant += 0.5 * np.log(noise_room.diagonal(block, noise)).sum()
        assert reached.log_likelihood[block.run] == pytest.approx(dense + constant, abs=1e-6)


def test_the_evidence_does_not_depend_on_the_unit():
    """In mN, the same runs speak as much for an effect, whatever the smaller model misses."""
    task = problem(3, truth=Wave(bend=0.2, ripple=0.1))
    statistic = []
    for unit in (1.0, 1e3, 1e-6):
        blocks = tuple(
            replace(block, measured=unit * block.measured, sigma=unit * block.sigma)
            for block in task.role("identify")
        )
        prior = prior_of(task, blocks)
        base = fit(Candidate(task.base), blocks, prior)
        assert max(base.noise.misfit.values()) > 0.01
        statistic.append(fit(Candidate(task.base, (BEND,)), blocks, prior, base).total - base.total)
    assert statistic[0] > 10.0
    assert statistic[1:] == pytest.approx([statistic[0]] * 2, rel=1e-3)


def test_with_effect_and_phases_the_descent_ends_where_a_general_optimiser_does():
    task = problem(3, truth=Wave(bend=0.2, ripple=0.1))
    blocks = task.role("identify")
    candidate = Candidate(task.base, (BEND, RIPPLE))
    found = fit(candidate, blocks, prior_of(task, blocks))
    model = candidate.model(found.theta)

    def roots(noise):
        covariances = [dense_covariance(b, noise, model, found.nuisance[b.run], found.beta) for b in blocks]
        return [np.linalg.cholesky(np.linalg.inv(covariance)).T for covariance in covariances]

    def rest(x, roots):
        model = candidate.model(x[2:4])
        parts = []
        for i, block in enumerate(blocks):
            matrix, _ = model.design(block, x[4 + i : 5 + i])
            parts.append(roots[i] @ (block.measured - matrix @ x[:2]))
        return np.concatenate(parts)

    start = np.concatenate([BETA, [0.2, 0.1], [found.nuisance[b.run][0] for b in blocks]])
    best = optimize.least_squares(rest, start, xtol=1e-12, ftol=1e-12, args=(roots(found.noise),))
    sd = np.sqrt(np.diag(np.linalg.inv(best.jac.T @ best.jac)))[:4]
    assert np.all(np.abs(np.concatenate([found.beta, found.theta]) - best.x[:4]) < 0.1 * sd)
    wide = optimize.least_squares(rest, best.x, args=(roots(noise_room.all_alike(found.noise)),)).jac
    wide_sd = np.sqrt(np.diag(np.linalg.inv(wide.T @ wide)))[:4]
    # Only the effects' intervals allow for a model error that is the same in all conditions.
    told = np.sqrt(np.diag(found.covariance))
    assert told[2:] == pytest.approx(wide_sd[2:], rel=0.02)
    assert found.theta == pytest.approx([0.2, 0.1], abs=4 * sd.max())


def test_covariance_is_the_spread_of_repeated_batches():
    values, sds = [], []
    for seed in range(40):
        task = problem(100 + seed, truth=Wave(bend=0.2))
        blocks = task.role("identify")
        prior = first_noise(0.0, task.scatter, blocks)  # these batches have no model-form error
        found = fit(Candidate(task.base, (BEND,)), blocks, prior, fit(Candidate(task.base), blocks, prior))
        values.append([*found.beta, *found.theta])
        sds.append(np.sqrt(np.diag(found.covariance)))
    spread, told = np.std(values, axis=0), np.mean(sds, axis=0)
    assert spread[:2] == pytest.approx(told[:2], rel=0.3)
    # A little misfit is always estimated, and weighs on what the noise within a run decides.
    assert spread[2] < 1.15 * told[2] < 2.1 * spread[2]
    assert np.all(np.abs(np.mean(values, axis=0) - [*BETA, 0.2]) < 4 * spread / np.sqrt(40))


def test_an_interval_holds_what_an_effect_differs_by_from_run_to_run():
    """An effect of another size in each of six runs, in noise that is believed to be ten times what it is.

    Then no misfit is seen, and the inverse of the normal matrix says a third of how far the effect is off.
    """
    held, sds = [], []
    for seed in range(40):
        rng = np.random.default_rng(300 + seed)
        runs = [
            toy_block(f"r{i}", 3.0, "identify", rng, truth=Wave(bend=rng.normal(0.2, 0.03)), order=i)
            for i in range(6)
        ]
        blocks = tuple(replace(run, sigma=10.0 * run.sigma) for run in runs)
        prior = first_noise(0.0, np.full(2, 0.01), blocks)
        found = fit(Candidate(Wave(), (BEND,)), blocks, prior, fit(Candidate(Wave()), blocks, prior))
        sd = float(np.sqrt(found.covariance[2, 2]) * found.wider[0])
        held.append(abs(found.theta[0] - 0.2) < stats.t.ppf(0.975, len(blocks) - 1) * sd)
        sds.append(sd)
    assert np.mean(held) >= 0.9
    assert np.median(sds) < 2.0 * 0.03 / np.sqrt(6)


def test_a_fit_starts_phases_over_the_whole_revolution():
    task = problem(4)
    blocks = task.role("identify")
    found = fit(Candidate(task.base), blocks, prior_of(task, blocks))
    assert found.beta == pytest.approx(BETA, rel=0.03)
    phases = np.array([found.nuisance[b.run][0] for b in blocks]) % (2 * np.pi)
    assert np.ptp(phases) > np.pi


def test_what_a_model_misses_does_not_bend_the_parameters_silently():
    task = problem(5, truth=Wave(spike=0.3))
    blocks = task.role("identify")
    found = fit(Candidate(task.base), blocks, prior_of(task, blocks))
    assert missed(found) > 0.05
    sound = problem(5)
    assert missed(fit(Candidate(sound.base), sound.role("identify"), prior_of(task, blocks))) < 0.005


def test_descent_never_raises_the_cost_and_keeps_parameters_in_bounds():
    task = problem(6, truth=Wave(bend=0.2))
    blocks = task.role("identify")
    noise = prior_of(task, blocks)
    tight = replace(BEND, parameters=(replace(BEND.parameters[0], upper=0.12),))
    candidate = Candidate(task.base, (tight,))
    state = State(np.array([0.0]), BETA * 1.3, {b.run: np.array([0.1]) for b in blocks})
    before = linearised(candidate, blocks, noise, state, derivatives="none").cost
    after, _ = descend(candidate, blocks, noise, state)
    assert linearised(candidate, blocks, noise, after, derivatives="none").cost < before
    assert after.theta[0] <= 0.12


def test_the_weak_prior_pulls_an_effect_towards_zero_and_only_then():
    task = problem(7, truth=Wave(bend=0.2))
    blocks = task.role("identify")
    prior = prior_of(task, blocks)
    flat = fit(Candidate(task.base, (BEND,)), blocks, prior)
    state = State(flat.theta, flat.beta, dict(flat.nuisance))
    sd = np.sqrt(
        np.linalg.inv(normal_equations(linearised(flat.candidate, blocks, flat.noise, state))[0])[2, 2]
    )
    believed = replace(BEND, parameters=(replace(BEND.parameters[0], plausible=100.0 * float(sd)),))
    pulled, _ = descend(
        Candidate(task.base, (believed,)), blocks, flat.noise, replace(state, theta=state.theta + 3 * sd)
    )
    # The mean of likelihood and prior, weighted by their precisions.
    assert pulled.theta[0] == pytest.approx(flat.theta[0] / (1.0 + 1e-4), abs=0.15 * sd)
    certain = replace(BEND, parameters=(replace(BEND.parameters[0], plausible=1e-3 * float(sd)),))
    kept, _ = descend(Candidate(task.base, (certain,)), blocks, flat.noise, state)
    assert abs(kept.theta[0]) < 0.05 * flat.theta[0]


def test_an_angle_is_the_same_after_its_period():
    turning = replace(BEND, parameters=(replace(BEND.parameters[0], lower=0.0, upper=0.15, period=0.15),))
    task = problem(8, truth=Wave(bend=0.2))
    blocks = task.role("identify")
    candidate = Candidate(task.base, (turning,))
    found, _ = descend(
        candidate,
        blocks,
        prior_of(task, blocks),
        State(
            np.array([0.14]), BETA, dict(fit(Candidate(task.base), blocks, prior_of(task, blocks)).nuisance)
        ),
    )
    assert 0.0 <= found.theta[0] < 0.15


def test_scoring_moves_nothing_but_the_phases():
    task = problem(9, truth=Wave(bend=0.2))
    blocks, held = task.role("identify"), task.role("validate")
    found = fit(Candidate(task.base, (BEND,)), blocks, prior_of(task, blocks))
    scored = score(found, held)
    assert np.array_equal(scored.beta, found.beta)
    assert np.array_equal(scored.theta, found.theta)
    assert scored.noise == found.noise
    assert set(scored.nuisance) == {block.run for block in held}
    model = found.candidate.model(found.theta)
    for block in held:
        covariance = dense_covariance(block, found.noise, model, scored.nuisance[block.run], found.beta)
        weight = np.linalg.inv(covariance)

        def chi2(phase, block=block, weight=weight):
            rest = block.measured - model.design(block, np.array([phase]))[0] @ found.beta
            return rest @ weight @ rest

        near = scored.nuisance[block.run][0]
        best = optimize.minimize_scalar(chi2, bounds=(near - 0.1, near + 0.1), method="bounded").x
        assert near == pytest.approx(best, abs=2e-3)
        assert scored.chi2[block.run] == pytest.approx(chi2(near), rel=1e-6)


def test_a_condition_left_out_is_predicted_from_the_others_alone():
    task = problem(10)
    blocks = task.role("identify")
    prior = prior_of(task, blocks)
    found = fit(Candidate(task.base), blocks, prior)
    out = leave_out(found, prior)
    assert set(out) == {block.condition for block in blocks}
    for name in out:
        rest = [block for block in blocks if block.condition != name]
        held = [block for block in blocks if block.condition == name]
        fresh = fit(Candidate(task.base), tuple(rest), prior)
        fresh_but_wary = most_missed(fresh, found.noise)
        assert out[name] == pytest.approx(predictive(fresh_but_wary, held), abs=0.5)
        spoilt = [replace(b, measured=b.measured * 1.2) if b.condition == name else b for b in blocks]
        other = refit(fit(Candidate(task.base), tuple(spoilt), prior), rest, prior)
        assert other.beta == pytest.approx(fresh.beta, rel=2e-3)


def test_one_condition_is_left_out_run_by_run_and_one_run_cannot_be():
    task = problem(11, feeds=(2.0,))
    prior = prior_of(task, task.role("identify"))
    found = fit(Candidate(task.base), task.role("identify"), prior)
    assert set(leave_out(found, prior)) == {"r1", "r2", "r3"}
    alone = refit(found, task.role("identify")[:1], prior)
    assert list(leave_out(alone, prior).values()) == [-np.inf]


def test_evidence_of_a_parameter_more_is_its_f_probability():
    task = problem(12)
    blocks = task.role("identify")
    prior = prior_of(task, blocks)
    base = fit(Candidate(task.base), blocks, prior)
    larger = fit(Candidate(task.base, (BEND,)), blocks, prior, base)
    evidence = compare(base, larger)
    assert 1e-4 < evidence.p_value < 1.0
    assert evidence.statistic == pytest.approx(2 * (larger.total - base.total))
    assert evidence.p_value == pytest.approx(
        stats.f.sf(evidence.statistic, 1, len(blocks) + noise_room.PRIOR_RUNS)
    )
    waves = [np.concatenate([f.predict(b) for b in blocks]) for f in (base, larger)]
    signal = np.concatenate([b.measured for b in blocks])
    assert evidence.size == pytest.approx(np.linalg.norm(waves[1] - waves[0]) / np.linalg.norm(signal))


def test_of_one_run_nothing_is_gained_and_weights_are_those_before_the_data():
    task = problem(4)
    blocks = task.role("identify")[:1]
    prior = prior_of(task, blocks)
    alone = fit(Candidate(task.base), blocks, prior)
    larger = fit(Candidate(task.base, (BEND,)), blocks, prior, alone)
    out = leave_out(alone, prior)
    assert hold_out(compare(alone, larger), out, larger, prior).held_out == {"r1": 0.0}
    assert weights([out, leave_out(larger, prior)], seed=1, prior=[3.0, 1.0]) == pytest.approx([0.75, 0.25])
    assert weights([{"a": -np.inf}, {"a": np.inf}], seed=1) == pytest.approx([0.5, 0.5])
    assert weights([{"a": 0.0}, {"a": np.inf}], seed=1)[1] > 0.99


def test_weights_follow_the_held_out_likelihoods():
    even = weights([{"a": 1.0, "b": 2.0}, {"a": 1.0, "b": 2.0}], seed=1)
    assert even == pytest.approx([0.5, 0.5])
    one = weights([{"a": 0.0}, {"a": 2.0}], seed=1)
    assert one[1] == pytest.approx(1 / (1 + np.exp(-2.0)))
    assert weights([{"a": 0.0, "b": 0.0}, {"a": -np.inf, "b": 5.0}], seed=1)[1] < 0.2
    # A gain in one condition alone is worth less than the same gain spread over all.
    spread = weights([dict.fromkeys("abcd", 0.0), dict.fromkeys("abcd", 1.0)], seed=1)[1]
    lumped = weights([dict.fromkeys("abcd", 0.0), {"a": 4.0, "b": 0.0, "c": 0.0, "d": 0.0}], seed=1)[1]
    assert lumped < spread - 0.05


def test_no_single_condition_decides_between_effects():
    """A condition that is another than its files say is no evidence, however unlikely one effect is there."""
    none = dict.fromkeys("abcdefg", -20.0)
    one, other = dict.fromkeys("abcdefg", 0.0), {"a": -80.0, **dict.fromkeys("bcdefg", 1.0)}
    assert weights([none, one, other], seed=1)[2] > 0.5
    alone = weights([{"a": -90.0}, {"a": 0.0}, {"a": -80.0}], seed=1)
    assert 0.005 < alone[2] < 0.02
    assert weights([{"a": -90.0}, {"a": 0.0}], seed=1)[1] > 0.999  # where there is no other


def test_what_survives_of_an_effect_that_the_base_imitates_is_nothing():
    from toy import GAIN

    task = problem(13)
    blocks = task.role("identify")
    base = fit(Candidate(task.base), blocks, prior_of(task, blocks))
    assert surviving_share(Candidate(task.base, (GAIN,)), base) < 1e-6
    assert surviving_share(Candidate(task.base, (RIPPLE,)), base) > 0.5


def test_an_inverse_is_exact_whatever_the_sizes_of_the_columns():
    rng = np.random.default_rng(1)
    columns, size = rng.normal(size=(20, 3)), np.array([1e-9, 1.0, 1e9])
    expected = np.linalg.inv(columns.T @ columns) / np.outer(size, size)
    found = inverse((columns * size).T @ (columns * size))
    assert found == pytest.approx(expected, rel=1e-9, abs=0.0)


def test_eliminating_the_phases_solves_the_full_system():
    task = problem(14)
    uneven = np.linspace(0.02, 0.4, 24)  # else base and phase columns are orthogonal
    blocks = [replace(block, sigma=uneven) for block in task.role("identify")[:2]]
    state = State(np.zeros(0), BETA * 1.1, {b.run: np.array([0.4]) for b in blocks})
    system = linearised(Candidate(task.base), blocks, prior_of(task, blocks), state)
    full = np.zeros((48, 4))
    for i, (_, base, _, own) in enumerate(system.rows):
        full[24 * i : 24 * i + 24, :2], full[24 * i : 24 * i + 24, 2 + i : 3 + i] = base, own
    rest = np.concatenate([row[0] for row in system.rows])
    normal, right = normal_equations(system)
    assert inverse(normal) == pytest.approx(np.linalg.inv(full.T @ full)[:2, :2], rel=1e-8)
    step = np.linalg.lstsq(full, rest, rcond=None)[0]
    common = np.linalg.solve(normal, right)
    assert common == pytest.approx(step[:2])
    assert [own_step(row, common)[0] for row in system.rows] == pytest.approx(step[2:])


def test_descent_from_anywhere_ends_lower_than_it_began():
    task = problem(15)
    blocks = task.role("identify")
    noise, candidate, rng = prior_of(task, blocks), Candidate(task.base), np.random.default_rng(1)
    for _ in range(15):
        state = State(np.zeros(0), BETA, {b.run: rng.uniform(0, 6.28, 1) for b in blocks})
        before = linearised(candidate, blocks, noise, state, derivatives="none").cost
        after, _ = descend(candidate, blocks, noise, state)
        assert linearised(candidate, blocks, noise, after, derivatives="none").cost <= before
