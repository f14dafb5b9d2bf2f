"""The course of a parameter over batches, against closed forms and another package."""

import numpy as np
import pytest
from scipy import stats
from statsmodels.stats.meta_analysis import combine_effects

from metro.memory import course as room
from metro.memory.course import course
from metro.memory.regression import Mixture, level, mixture, regress


def test_without_scatter_a_regression_is_the_weighted_mean_of_the_textbook():
    rng = np.random.default_rng(1)
    s = rng.uniform(0.5, 2.0, 12)
    y = rng.normal(3.0, s)
    fitted = regress(np.ones((1, 12, 1)), y, s)
    assert fitted.tau[0] == 0.0
    weight = 1.0 / s**2
    assert fitted.beta[0, 0, 0] == pytest.approx(weight @ y / weight.sum())
    assert fitted.covariance[0, 0, 0, 0] == pytest.approx(1.0 / weight.sum())


def test_with_equal_and_exact_batches_the_interval_of_the_mean_is_nearly_students():
    rng = np.random.default_rng(2)
    y = rng.normal(10.0, 1.0, 15)
    mean, _ = level(y, np.full(15, 1e-3))
    low, middle, high = (float(part[0]) for part in mean.interval())
    half = stats.t.ppf(0.975, 14) * y.std(ddof=1) / np.sqrt(15)
    assert middle == pytest.approx(y.mean(), abs=0.02)
    # A prior flat in τ has the weight of one batch less than that of Student's t.
    assert half <= 0.5 * (high - low) <= 1.12 * half


def test_the_mean_over_batches_agrees_with_a_random_effects_meta_analysis():
    rng = np.random.default_rng(3)
    s = rng.uniform(0.2, 1.0, 18)
    y = 2.0 + rng.normal(0.0, 0.5, 18) + rng.normal(0.0, s)
    mean, p_value = level(y, s)
    low, middle, high = (float(part[0]) for part in mean.interval())
    other = combine_effects(y, s**2, method_re="pm", use_t=True)
    half = stats.t.ppf(0.975, 17) * np.sqrt(other.var_hksj_re)
    assert middle == pytest.approx(other.mean_effect_re, abs=0.1 * half)
    assert 0.5 * (high - low) == pytest.approx(half, rel=0.25)
    assert p_value < 1e-3


def test_a_quantile_of_a_mixture_has_its_probability_below_it():
    parts = Mixture(np.array([0.3, 0.7]), np.array([[0.0], [5.0]]), np.array([[1.0], [0.2]]))
    for p in (0.025, 0.2, 0.5, 0.975):
        assert parts.below(parts.quantile(p))[0] == pytest.approx(p, abs=1e-6)


def test_what_a_line_predicts_is_the_closed_form_of_a_prediction_interval():
    rng = np.random.default_rng(4)
    u = np.linspace(0.0, 1.0, 30)
    y = 1.0 + 2.0 * u + rng.normal(0.0, 0.1, 30)
    design = np.stack([np.ones(30), u], axis=1)
    fitted = regress(design[None], y, np.full(30, 1e-4))
    low, middle, high = mixture(fitted, np.array([[[1.0, 1.1]]]), np.ones(1), scatter=True).interval()
    beta, rest, *_ = np.linalg.lstsq(design, y, rcond=None)
    row = np.array([1.0, 1.1])
    sd = np.sqrt(rest[0] / 28 * (1.0 + row @ np.linalg.inv(design.T @ design) @ row))
    assert middle[0] == pytest.approx(row @ beta, abs=0.01)
    assert 0.5 * (high - low)[0] == pytest.approx(stats.t.ppf(0.975, 28) * sd, rel=0.06)


@pytest.mark.parametrize(
    ("kind", "of"),
    [
        ("trend", lambda t: 5.0 + 0.2 * t),
        ("step", lambda t: 5.0 + 2.0 * (t >= 12)),
        ("levels off", lambda t: 9.0 - 4.0 * np.exp(-t / 3.0)),
        ("accelerates", lambda t: 5.0 + 4.0 * np.exp((t - 19.0) / 3.0)),
    ],
)
def test_each_course_is_told_from_the_others_and_covers_the_truth(kind, of):
    rng = np.random.default_rng(5)
    t = np.arange(20.0)
    y = of(t) + rng.normal(0.0, 0.15, 20)
    found = course(t, y, np.full(20, 0.1))
    assert (found.kind, found.p_value) == (kind, 1.0 / (room.DRAWS + 1))
    inside = (found.track[:, 0] <= of(t)) & (of(t) <= found.track[:, 2])
    assert inside.mean() >= 0.8
    assert found.after[0] < of(20.0) < found.after[2] or kind == "accelerates"
    low, _, high = found.change
    assert low < of(19.0) - of(0.0) < high
    assert found.before_step == (11 if kind == "step" else None)


def test_of_no_change_every_p_value_is_as_frequent_as_it_says():
    rng = np.random.default_rng(6)
    p = []
    for _ in range(60):
        s = np.exp(rng.uniform(-1.0, 1.0, 8))
        y = 3.0 + rng.standard_t(3, 8) * s  # long tails: the test asks for no distribution
        t = np.arange(8.0)
        shapes = np.array([shape(t / 7.0) for shape in room.shapes(t / 7.0)[1:]])
        p.append(room._p_value(shapes, y, s, 1.0))
    assert stats.kstest(p, "uniform").pvalue > 0.01


def test_of_few_batches_only_the_mean_is_told():
    found = course(np.arange(4.0), np.array([1.0, 2.0, 3.0, 4.0]), np.full(4, 0.01))
    assert found.p_value is None
    assert found.weights == {"constant": 1.0}
    assert found.after[0] < 1.0
    assert found.after[2] > 4.0


def test_the_next_batch_comes_after_the_usual_pause():
    t = np.array([0.0, 1.0, 2.0, 10.0, 11.0, 12.0])
    y = np.array([1.0, 1.1, 0.9, 1.05, 1.0, 0.95])
    assert course(t, y, np.full(6, 0.1)).next_at == pytest.approx(13.0)


def test_a_course_does_not_depend_on_the_units():
    rng = np.random.default_rng(7)
    t, y, s = np.arange(10.0), rng.normal(5.0, 1.0, 10), np.full(10, 0.5)
    one, other = course(t, y, s), course(24.0 * t, 1e6 * y, 1e6 * s)
    assert other.p_value == one.p_value
    np.testing.assert_allclose(other.track, 1e6 * one.track, rtol=1e-6)
    np.testing.assert_allclose(other.after, 1e6 * one.after, rtol=1e-6)
