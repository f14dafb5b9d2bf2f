"""Factorial studies: closed forms, a published analysis of variance, statsmodels, and simulated designs."""

import itertools
import math

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from metro.surface.factorial import cell_means, contrasts, f_test, fit_design, holm, level_effects
from metro.surface.factors import find_factors, make_design

# Warp breaks per loom, 9 each of wool A, B × tension L, M, H (Tippett 1950, in Tukey 1977; R's `warpbreaks`)
BREAKS = {
    "AL": [26, 30, 54, 25, 70, 52, 51, 26, 67],
    "AM": [18, 21, 29, 17, 12, 18, 35, 30, 36],
    "AH": [36, 21, 24, 18, 10, 43, 28, 15, 26],
    "BL": [27, 14, 29, 19, 29, 31, 41, 20, 44],
    "BM": [42, 26, 19, 16, 39, 28, 21, 39, 29],
    "BH": [20, 21, 24, 17, 13, 15, 15, 16, 28],
}


def cube(repeats=1, names=("C", "b", "c")):
    """Settings of a 2³ design, each cell `repeats` times, and the signs (n, 3) of the levels."""
    signs = np.array(list(itertools.product([-1, 1], repeat=3)) * repeats)
    return {name: np.where(column > 0, "2", "1") for name, column in zip(names, signs.T, strict=True)}, signs


def study(settings, values, block=None):
    return fit_design(make_design(find_factors(settings)), np.asarray(values), block)


def test_effects_of_a_balanced_cube_are_differences_of_means_of_logarithms():
    settings, signs = cube(repeats=2)
    y = np.random.default_rng(3).normal(5.0, 0.3, 16)
    fitted = study(settings, np.exp(y))
    a, b, c = signs.T
    for name, sign in zip(settings, signs.T, strict=True):
        (effect,) = contrasts(fitted, name)
        assert effect.log == pytest.approx(y[sign > 0].mean() - y[sign < 0].mean(), abs=1e-12)
    both = level_effects(fitted, ("C", "b"))
    assert [e.level for e in both] == [("1", "1"), ("1", "2"), ("2", "1"), ("2", "2")]
    assert both[3].log == pytest.approx(np.mean(a * b * y), abs=1e-12)
    assert level_effects(fitted, ("C", "b", "c"))[-1].log == pytest.approx(np.mean(a * b * c * y), abs=1e-12)
    halves = y.reshape(2, 8)
    variance = halves.var(axis=0, ddof=1).mean()
    assert fitted.scatter**2 == pytest.approx(variance, rel=1e-12)
    assert contrasts(fitted, "C")[0].sd == pytest.approx(math.sqrt(variance / 4), rel=1e-12)
    assert f_test(fitted, ("b",))[0] == pytest.approx(4 * np.mean(b * y) ** 2 / (variance / 4), rel=1e-9)


def test_the_difference_in_units_of_the_mean_is_that_of_the_geometric_means():
    settings, signs = cube(repeats=2)
    y = np.random.default_rng(4).normal(5.0, 0.3, 16)
    (effect,) = contrasts(study(settings, np.exp(y)), "C")
    high, low = (math.exp(y[signs[:, 0] * s > 0].mean()) for s in (1, -1))
    assert effect.share * math.exp(y.mean()) == pytest.approx(high - low, rel=1e-12)
    assert effect.factor[0] == pytest.approx(high / low, rel=1e-12)
    halves = np.random.default_rng(1).normal(effect.log / 2, effect.sd / 2, 100_000)  # of the two levels
    assert effect.share_sd == pytest.approx(np.std(np.exp(halves) - np.exp(-halves)), rel=0.03)


def test_the_published_analysis_of_variance_of_the_warp_breaks():
    rows = [(cell[0], cell[1], float(n)) for cell, values in BREAKS.items() for n in values]
    wool, tension, breaks = zip(*rows, strict=True)
    fitted = study({"wool": wool, "tension": tension}, np.exp(breaks))
    printed = {("wool",): (3.765, 0.0582), ("tension",): (8.498, 0.000693)}
    for term, (f, p) in (printed | {("wool", "tension"): (4.189, 0.0210)}).items():
        found = f_test(fitted, term)
        assert found[0] == pytest.approx(f, abs=5e-4)
        assert found[2] == 48
        assert found[3] == pytest.approx(p, rel=5e-3)


def test_an_uneven_design_with_a_factor_named_c_agrees_with_statsmodels():
    from statsmodels.formula.api import ols
    from statsmodels.stats.anova import anova_lm

    rng = np.random.default_rng(8)
    settings, _ = cube(repeats=4)
    chosen = np.sort(rng.choice(32, 23, replace=False))
    settings = {name: column[chosen] for name, column in settings.items()}
    values = np.exp(rng.normal(5.0, 0.2, 23))
    frame = pd.DataFrame(settings).rename(columns={"C": "a"}).assign(y=np.log(values))
    table = anova_lm(ols("y ~ C(a, Sum) * C(b, Sum) * C(c, Sum)", frame).fit(), typ=3)
    fitted = study(settings, values)
    assert f_test(fitted, ("C",))[0] == pytest.approx(table.loc["C(a, Sum)", "F"], rel=1e-9)
    three = "C(a, Sum):C(b, Sum):C(c, Sum)"
    assert f_test(fitted, ("C", "b", "c"))[3] == pytest.approx(table.loc[three, "PR(>F)"], rel=1e-9)


def test_settings_that_vary_alike_are_one_factor_and_say_so():
    settings, _ = cube()
    pose = np.where(settings["C"] == "1", "home", "away")
    factors = find_factors(settings | {"pose": pose, "speed": np.full(8, 12000.0)})
    assert [factor.name for factor in factors] == ["C", "b", "c"]
    assert factors[0].aliases == ("pose",)


def test_a_half_fraction_names_what_it_cannot_tell_apart():
    settings, signs = cube(repeats=4)
    half = signs.prod(axis=1) > 0
    design = make_design(find_factors({name: column[half] for name, column in settings.items()}))
    assert design.terms == (("C",), ("b",), ("c",))
    told = {alias.term: alias for alias in design.aliases}
    assert told["C", "b"].same_as == (("c",),)
    assert not told["C", "b"].part


def test_a_pose_that_follows_from_two_factors_is_no_third_one():
    settings, _ = cube(repeats=2)
    pose = np.char.add(settings["C"].astype(str), settings["b"].astype(str))
    design = make_design(find_factors(settings | {"pose": pose}))
    told = {alias.term: alias for alias in design.aliases}
    assert told["pose",].part is False
    assert told["pose",].same_as == (("C",), ("b",), ("C", "b"))
    assert [term for term in told if "pose" in term] == [("pose",)]
    assert ("C", "b") in design.terms


def test_without_repeats_interactions_are_counted_as_scatter():
    settings, _ = cube()
    design = make_design(find_factors(settings))
    assert design.terms == (("C",), ("b",), ("c",))
    assert design.pooled == (("C", "b"), ("C", "c"), ("b", "c"), ("C", "b", "c"))


def test_a_number_of_many_levels_is_a_line():
    depth = np.repeat([1.0, 1.5, 2.0, 3.0], 3)
    fitted = study({"depth": depth}, np.exp(1.0 + 0.4 * depth))
    assert contrasts(fitted, "depth")[-1].log == pytest.approx(0.8, abs=1e-10)
    assert [effect.level for effect in contrasts(fitted, "depth")] == [("1.5",), ("2",), ("3",)]


@pytest.mark.parametrize(
    ("settings", "words"), [({"a": ["1"] * 3}, "no factor"), ({"a": list("abc")}, "too few")]
)
def test_designs_that_tell_nothing_are_refused(settings, words):
    with pytest.raises(ValueError, match=words):
        make_design(find_factors(settings))


def test_values_that_have_no_logarithm_are_refused():
    settings, _ = cube(repeats=2)
    with pytest.raises(ValueError, match="positive"):
        study(settings, np.r_[0.0, np.ones(15)])


def test_intervals_hold_and_false_positives_are_one_in_twenty():
    rng = np.random.default_rng(11)
    settings, signs = cube(repeats=3)
    inside, false, tests = 0, 0, 0
    for _ in range(500):
        chosen = np.sort(rng.choice(24, 20, replace=False))
        part = {name: column[chosen] for name, column in settings.items()}
        truth = rng.normal(0.0, 0.1)
        y = 5.0 + truth / 2 * signs[chosen, 0] + rng.normal(0.0, 0.1, 20)
        fitted = study(part, np.exp(y))
        _, low, high = contrasts(fitted, "C")[0].factor
        inside += low <= math.exp(truth) <= high
        nulls = [term for term in fitted.design.terms if term != ("C",)]
        false += sum(f_test(fitted, term)[3] < 0.05 for term in nulls)
        tests += len(nulls)
    assert stats.binomtest(inside, 500, 0.95).pvalue > 0.01
    assert false / tests == pytest.approx(0.05, abs=0.012)


def test_plates_are_a_random_effect():
    rng = np.random.default_rng(12)
    signs = np.tile([[-1, -1], [-1, 1], [1, -1], [1, 1]], (6, 1))
    plate = np.repeat(np.arange(6), 4)
    whole = np.repeat([-1, 1, -1, 1, -1, 1], 4)
    settings = {"within": signs[:, 0], "other": signs[:, 1], "plates": whole}
    settings = {name: column.astype(str) for name, column in settings.items()}
    inside, false, wrong = 0, 0, 0
    for _ in range(100):
        y = 5 + 0.1 * signs[:, 0] + rng.normal(0, 0.2, 6)[plate] + rng.normal(0, 0.05, 24)
        fitted = study(settings, np.exp(y), plate)
        _, low, high = contrasts(fitted, "within")[0].factor
        inside += low <= math.exp(0.2) <= high
        false += f_test(fitted, ("plates",))[3] < 0.05
        wrong += f_test(study(settings, np.exp(y)), ("plates",))[3] < 0.05
    assert fitted.dof["plates",] == 4
    assert fitted.block_sd == pytest.approx(0.2, abs=0.15)
    assert inside >= 88
    assert false <= 12
    assert wrong >= 20  # what becomes of it where plates are taken for nothing


def test_balanced_plates_leave_the_differences_within_them():
    rng = np.random.default_rng(13)
    settings, _ = cube(repeats=3)
    plate = np.repeat(np.arange(3), 8)
    y = 5 + rng.normal(0, 0.3, 3)[plate] + rng.normal(0, 0.05, 24)
    fitted = study(settings, np.exp(y), plate)
    rest = y.reshape(3, 8) - y.reshape(3, 8).mean(axis=0)
    rest -= rest.mean(axis=1, keepdims=True)
    assert fitted.scatter**2 == pytest.approx((rest**2).sum() / 14, rel=1e-3)
    assert contrasts(fitted, "C")[0].sd == pytest.approx(math.sqrt((rest**2).sum() / 14 / 6), rel=1e-3)
    assert fitted.dof["C",] == 14


def test_cell_means_of_a_full_model_are_those_of_the_runs():
    settings, _ = cube(repeats=2)
    y = np.random.default_rng(5).normal(5.0, 0.3, 16)
    cell, mean, covariance = cell_means(study(settings, np.exp(y)))
    assert mean == pytest.approx(np.array([y[cell == i].mean() for i in range(8)]), abs=1e-12)
    variance = y.reshape(2, 8).var(axis=0, ddof=1).mean()
    assert covariance == pytest.approx(variance / 2 * np.eye(8), abs=1e-12)


def test_holm_multiplies_by_how_many_are_left_and_leaves_out_what_is_not_known():
    p = np.array([0.01, 0.04, 0.03, 0.005, 0.6])
    assert holm(p) == pytest.approx([0.04, 0.09, 0.09, 0.025, 0.6])
    assert holm(np.array([0.02, np.nan, 0.03])) == pytest.approx([0.04, np.nan, 0.04], nan_ok=True)
    assert np.isnan(holm(np.array([np.nan]))).all()
