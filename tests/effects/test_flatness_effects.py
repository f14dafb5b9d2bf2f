"""Effects of flatness in faces made by formulas: found where they are, unseen where zeros hide them."""

import math
from dataclasses import replace

import numpy as np
import pytest
from face_batch import GATES, RADIUS, problem
from face_manifest import SIZE
from scipy.signal import lfilter
from scipy.stats import f
from worded import in_words

from metro.effects.effect import fitted_to
from metro.effects.library import library, with_declared
from metro.loop.checks.evidence import compare, dimmed, leave_out
from metro.loop.checks.signature import places, signature
from metro.loop.fitting import noise
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit, score
from metro.loop.fitting.noise import first_noise
from metro.loop.fitting.system import moved_models, sensitivities
from metro.loop.search.search import search
from metro.loop.verdict.verdict import parameters
from metro.observables.flatness.model import _shaped
from metro.observables.flatness.setup import Setup, bow_shapes
from metro.observables.flatness.setup import grown as share_of_minute
from metro.observables.problem import predictions


def tilted(dx, dy, **_cut):
    return 0.9e-3 * dy + 0.6e-3 * dx


def grown(time, **_cut):
    return -25e-3 / 60.0 * time


def warmed_up(time, **_cut):
    return 60e-3 * np.expm1(-time / 8.0)


def entered(way, **_cut):
    return np.where(way >= 0.0, 40e-3 * np.exp(-np.abs(way) / 15.0), 0.0)


def swung(time, phase, **_cut):
    return 8e-3 * np.sin(2 * np.pi * 1.7 * time + phase)


def swung_in_short_waves(time, phase, **_cut):
    return 15e-3 * np.sin(2 * np.pi * 4.9 * time + phase)  # 8 mm at 40 mm/s: two points of the path


def bowed(x, y):
    u, v = x / 60.0 - 1.0, y / 30.0 - 1.0
    return 40e-3 * u**2 - 25e-3 * u * v + 30e-3 * v**2


def spot(x, y):
    return 40e-3 * np.exp(-((x - 80.0) ** 2 + (y - 30.0) ** 2) / 200.0)


def drooped(way, length, load, **_cut):
    """Height, mm, of drives that droop by 0.4 µm/N and come back over 15 mm, in small steps of the force."""
    axis = np.arange(-RADIUS, length + 2.0 * RADIUS, 0.01)
    gone = [1.0 - np.clip(end + axis, 0.0, RADIUS) / RADIUS for end in (RADIUS, RADIUS - length)]
    share = np.sqrt(1.0 - gone[0] ** 2) - np.sqrt(1.0 - gone[1] ** 2)  # of the cutter's width that cuts
    droop = lfilter([1.0], [1.0, -np.exp(-0.01 / 15.0)], np.diff(share, prepend=0.0))
    return 4e-4 * load * np.interp(way, axis, droop, left=0.0)


HIDDEN = [
    ("spindle_tilt", {"hidden": tilted}, {"about_x_mrad": 0.9, "about_y_mrad": -0.6}),
    ("thermal_growth", {"hidden": grown}, {"um_per_min": 25.0}),
    ("entry_transient", {"hidden": entered}, {"amplitude_um": 40.0, "length_mm": 15.0}),
    ("path_vibration", {"hidden": swung}, {"frequency_hz": 1.7, "amplitude_um": 8.0}),
    ("fixture_bow", {"work": bowed}, {"xx_um": 40.0, "xy_um": -25.0, "yy_um": 30.0}),
    ("stiffness_scale", {"factor": 0.65}, {"factor": 0.65}),
]


def bowed_as_a_scanner(x, y):
    return bowed(x, y) / 8.0


SHORT = ("path_vibration", {"hidden": swung_in_short_waves}, {"frequency_hz": 4.9, "amplitude_um": 15.0})


def base_fit(task):
    blocks = task.role("identify", "calibrate")
    prior = first_noise(GATES.model_form_budget, task.scatter, blocks)
    return fit(Candidate(task.base), blocks, prior), prior


def effect_of(task, name):
    return next(e for e in fitted_to(library("flatness"), task)[0] if e.name == name)


@pytest.fixture(scope="module")
def clean():
    task = problem(seed=5)
    return task, *base_fit(task)


@pytest.mark.parametrize(
    ("name", "made", "truth"), [*HIDDEN, SHORT], ids=[*(case[0] for case in HIDDEN), "short waves"]
)
def test_an_effect_comes_back_with_its_size_inside_its_interval(name, made, truth):
    task = problem(**made)
    base, prior = base_fit(task)
    found = fit(Candidate(task.base, (effect_of(task, name),)), base.blocks, prior, base)
    assert found.total > base.total + 8.0
    for parameter, value in truth.items():
        low, high = parameters(found, name)[parameter]["ci95"]
        assert low < value < high
        assert high - low < 1.5 * abs(value)


def test_a_second_vibration_is_found_beside_the_declared_one_each_with_its_own_phases():
    def twice(time, phase, **cut):
        return swung(time, phase, **cut) + 12e-3 * np.sin(2 * np.pi * 0.7 * time + 2.0 - 3.0 * phase)

    declared = {"path_vibration": {"frequency_hz": 1.7, "amplitude_um": 8.0}}
    task = with_declared(problem(hidden=twice), declared)
    base, prior = base_fit(task)
    found = fit(Candidate(task.base, (effect_of(task, "path_vibration"),)), base.blocks, prior, base)
    assert found.total > base.total + 8.0
    assert {len(found.nuisance[block.run]) for block in task.role("identify")} == {2}
    for parameter, value in {"frequency_hz": 0.7, "amplitude_um": 12.0}.items():
        low, high = parameters(found, "path_vibration")[parameter]["ci95"]
        assert low < value < high
        assert high - low < 0.2 * value


def test_a_spindle_that_warms_up_levels_off_and_one_that_grows_evenly_does_not():
    """Else what the first passes have more than the last looks like a transient of every pass."""
    totals, fits = [], []
    for made in (warmed_up, grown):
        task = problem(hidden=made)
        base, prior = base_fit(task)
        forms = [e for e in fitted_to(library("flatness"), task)[0] if e.name == "thermal_growth"]
        assert [form.form for form in forms] == ["", "levelling off"]
        fits.append([fit(Candidate(task.base, (each,)), base.blocks, prior, base) for each in forms])
        totals.append([each.total for each in fits[-1]])
    assert totals[0][1] > totals[0][0] + 8.0
    found = parameters(fits[0][1], "thermal_growth")
    for name, value in {"um_per_min": 60.0, "settles_s": 8.0}.items():
        low, high = found[name]["ci95"]
        assert low < value < high
        assert high - low < 0.5 * value
    assert totals[1][1] < totals[1][0] + 3.0


@pytest.mark.parametrize("settles", [5.0, 90.0, 1e7])
def test_a_growth_is_counted_by_its_first_minute(settles):
    time = np.array([0.0, 1e-3, 60.0, 1e12])
    minute, (none, first, one, whole) = 1.0 - math.exp(-60.0 / settles), share_of_minute(time, settles)
    assert (none, one) == (0.0, pytest.approx(1.0))
    assert first == pytest.approx(1e-3 / settles / minute, rel=1e-3)  # the slope at which it begins
    assert whole == pytest.approx(1.0 / minute, rel=1e-6)
    assert share_of_minute(time, math.inf)[:3] == pytest.approx(share_of_minute(time, 1e7)[:3], abs=1e-5)


def test_a_droop_that_goes_with_the_force_is_one_and_not_the_same_in_all_faces():
    task = problem(hidden=drooped)
    base, prior = base_fit(task)
    of_any, of_force = (e for e in fitted_to(library("flatness"), task)[0] if e.name == "entry_transient")
    fits = {
        each.form: fit(Candidate(task.base, (each,)), base.blocks, prior, base) for each in (of_any, of_force)
    }
    found = fits["with the force"]
    assert found.total > max(base.total, fits[""].total) + 8.0
    usual = np.mean([np.linalg.norm(block.setting.force) for block in task.role("identify")])
    at_edge = drooped(np.zeros(1), SIZE[0], usual)[0] / 1e-3
    reported = parameters(found, "entry_transient")
    assert reported["grows_with"] == "force"
    for parameter, value in {"amplitude_um": at_edge, "length_mm": 15.0}.items():
        low, high = reported[parameter]["ci95"]
        assert low < value < high
        assert high - low < 0.5 * value


def test_what_is_declared_of_a_droop_says_whether_it_goes_with_the_force():
    values = {"amplitude_um": 40.0, "length_mm": 15.0}
    of_any = with_declared(problem(), {"entry_transient": values}).base.setup
    of_force = with_declared(problem(), {"entry_transient": {"grows_with": "force"} | values}).base.setup
    assert (len(of_any.entry), len(of_any.droops)) == (1, 0)
    assert (len(of_force.entry), len(of_force.droops)) == (0, 1)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "made", "truth"), HIDDEN, ids=[case[0] for case in HIDDEN])
def test_the_search_names_the_effect_alone(name, made, truth):
    outcome = search(problem(**made), library("flatness"), GATES)
    assert name in (*outcome.names, *(rival.other for rival in outcome.rivals))
    assert len(outcome.names) == 1


@pytest.mark.slow
def test_nothing_is_found_in_a_clean_batch():
    outcome = search(problem(seed=7), library("flatness"), GATES)
    assert outcome.names == ()
    assert not any(line.significant for line in outcome.lines)


def test_the_noise_is_that_of_faces_which_no_fit_has_seen(clean):
    task, base, _ = clean
    held = score(base, task.role("validate"))
    ratio = sum(held.chi2.values()) / sum(held.elements.values())
    assert ratio == pytest.approx(1.0, abs=0.25)


def test_a_clean_batch_has_no_pattern(clean):
    _, base, _ = clean
    assert not any(line.significant for line in signature(base, 0.04))


def test_the_size_from_which_a_growth_shows_is_three_errors_of_generalised_least_squares(clean):
    task, base, _ = clean
    growth = effect_of(task, "thermal_growth")
    found = dimmed(Candidate(task.base, (growth,)), base)
    normal = np.zeros((len(base.beta) + 1,) * 2)
    for block in base.blocks:
        nuisance = base.nuisance[block.run]
        matrix, offset = task.base.design(block, nuisance)
        moved = growth.apply(task.base, {"um_per_min": 1e-3}).design(block, nuisance)[1]
        shared = noise.shared(block, base.noise, matrix, base.beta)
        covariance = np.diag(noise.diagonal(block, base.noise)) + shared @ shared.T
        columns = np.column_stack([matrix, (moved - offset) / 1e-3])
        normal += columns.T @ np.linalg.solve(covariance, columns)
    scale = 1.0 / np.sqrt(np.diag(normal))
    sd = scale[-1] * np.sqrt(np.linalg.inv(normal * np.outer(scale, scale))[-1, -1])
    assert found.least == pytest.approx(3.0 * sd, rel=0.05)
    assert found.share < 0.05  # the plane of a scan takes nearly all of a face that falls evenly


def test_a_phase_that_every_face_has_for_itself_is_paid_for(clean):
    task, base, prior = clean
    effect = replace(effect_of(task, "path_vibration"), sought=1.0)
    free, paid = (
        fit(Candidate(task.base, (replace(effect, own=own),)), base.blocks, prior, base) for own in (0, 1)
    )
    evidence = compare(base, paid)
    assert evidence.p_value == pytest.approx(f.sf(evidence.statistic / (2 + 8), 2 + 8, 8 + 4), rel=1e-6)
    assert evidence.p_value > compare(base, free).p_value
    gains = [sum(leave_out(each, prior).values()) for each in (free, paid)]
    assert gains[0] - gains[1] == pytest.approx(8.0)  # one for each of eight faces


@pytest.mark.parametrize("name", ["thermal_growth", "fixture_bow", "spindle_tilt"])
def test_a_slope_that_the_place_of_an_unplaced_scan_takes_is_not_found(name):
    task = problem(work=lambda x, y: 30e-3 * (x / 60.0 - 1.0) - 20e-3 * (y / 30.0 - 1.0), placed=False)
    base, prior = base_fit(task)
    found = fit(Candidate(task.base, (effect_of(task, name),)), base.blocks, prior, base)
    assert found.total < base.total + 6.0


def distorted(x, y):
    u, v = x / 60.0 - 1.0, y / 30.0 - 1.0
    return 25e-3 * u**3 - 15e-3 * u * v**2


@pytest.mark.parametrize(
    ("made", "name", "likelier"),
    [
        ({"hidden": lambda number, **_cut: 20e-3 * np.sin(1.3 * number)}, "pass_levels", 10.0),
        # One deeper pass is no polynomial over the passes: it is only more like that than like all else.
        ({"hidden": lambda number, **_cut: -20e-3 * (number == 2)}, "pass_levels", 0.0),
        ({"work": distorted}, "cubic_form", 10.0),
    ],
    ids=["uneven passes", "one pass deeper", "distortion"],
)
def test_what_is_outside_the_library_is_most_like_a_cause_of_its_kind(made, name, likelier):
    task = problem(**made)
    base, prior = base_fit(task)
    others = ("thermal_growth", "fixture_bow", "spindle_tilt", "pass_levels", "cubic_form")
    total = {
        other: fit(Candidate(task.base, (effect_of(task, other),)), base.blocks, prior, base).total
        for other in others
    }
    likeness = total.pop(name)
    assert effect_of(task, name).resembled
    assert likeness > max(total.values()) + likelier


def test_derivatives_by_effects_and_phases_are_those_of_the_predictions(clean):
    task, base, _ = clean
    names = ("path_vibration", "stiffness_scale", "fixture_bow", "entry_transient", "spindle_tilt")
    effects = tuple(effect_of(task, name) for name in names)
    values = [1.7, 8.0, 0.8, 40.0, -25.0, 30.0, 40.0, 15.0, 0.9, -0.6]
    theta = np.array([*values[:8], *([-20.0] if len(effects[3].parameters) == 3 else []), *values[8:]])
    candidate = Candidate(task.base, effects)
    moved = moved_models(candidate, theta)
    model, size = candidate.model(theta), [parameter.scale for parameter in candidate.parameters]
    for block in (*task.role("identify")[:2], *task.role("calibrate")[:1]):
        nuisance = model.nuisance_starts(block)[-1]
        effect, own = sensitivities(model, moved, block, nuisance, base.beta)

        def slope(i, block=block, nuisance=nuisance):
            there = [theta + step * size[i] * np.eye(len(theta))[i] for step in (1e-3, -1e-3)]
            ends = [predictions(candidate.model(at), block, nuisance[None], base.beta)[0] for at in there]
            return (ends[0] - ends[1]) / (2e-3 * size[i])

        expected = np.array([slope(i) for i in range(len(theta))]).T
        largest = np.abs(expected).max(axis=0)
        # A place where two passages are nearly as low bends, which a difference of a finite step sees.
        assert (np.abs(effect - expected).max(axis=0) <= 0.02 * largest).all()
        steps = nuisance + 1e-3 * np.repeat([[1.0], [-1.0]], len(nuisance), axis=1)
        ends = predictions(model, block, steps, base.beta)
        np.testing.assert_allclose(
            own.sum(axis=1), (ends[0] - ends[1]) / 2e-3, atol=0.02 * np.abs(own).max(initial=0.0)
        )
        assert block.role == "calibrate" or (largest > 0.0).all()


@pytest.mark.parametrize("placed", [True, False])
def test_a_prediction_at_many_phases_is_that_of_the_design_at_each(placed):
    task = problem(placed=placed)
    effects = [effect_of(task, name) for name in ("path_vibration", "stiffness_scale", "fixture_bow")]
    theta = np.array([1.7, 8.0, 0.8, 40.0, -25.0, 30.0])
    model = Candidate(task.base, tuple(effects)).model(theta)
    beta = 0.02 * np.random.default_rng(5).normal(size=len(model.parameters))
    for block in task.blocks:
        nuisances = model.nuisance_starts(block)
        each = [
            offset + matrix @ beta for matrix, offset in (model.design(block, n, beta) for n in nuisances)
        ]
        np.testing.assert_allclose(predictions(model, block, nuisances, beta), each, rtol=1e-9, atol=1e-12)


def test_a_bow_is_over_all_passages_alike_and_no_face_is_finished_anew_for_it():
    task = problem()
    block, effect = task.role("identify")[0], effect_of(task, "fixture_bow")
    task.base.design(block, np.zeros(1))
    finished = _shaped.cache_info().misses
    bent = Candidate(task.base, (effect,)).model(np.array([40.0, -25.0, 30.0]))
    height = bent.design(block, np.zeros(1))[1] - task.base.design(block, np.zeros(1))[1]
    setting = block.setting
    bow = setting.mean(bow_shapes(setting.x, setting.y, setting.size) @ bent.setup.bowed)
    np.testing.assert_allclose(height, setting.shape(bow), atol=1e-12)
    assert np.ptp(height) > 20e-6
    assert _shaped.cache_info().misses == finished


def test_a_form_of_third_degree_is_what_its_parameters_say():
    x, y = np.random.default_rng(2).uniform(0.0, 1.0, (2, 50)) * [[0.12], [0.06]]
    u, v = 2.0 * x / 0.12 - 1.0, 2.0 * y / 0.06 - 1.0
    height = bow_shapes(x, y, (0.12, 0.06)) @ Setup(cubic=(1e-5, 2e-5, 3e-5, 4e-5)).bowed
    np.testing.assert_allclose(
        height, 1e-5 * u**3 + 2e-5 * u**2 * v + 3e-5 * u * v**2 + 4e-5 * v**3, atol=1e-15
    )


@pytest.mark.parametrize(
    ("made", "words"),
    [
        ({"hidden": lambda number, **_cut: 15e-3 * (number >= 3)}, "pass"),
        ({"hidden": lambda number, **_cut: -20e-3 * (number == 2)}, "pass 3"),
        ({"work": spot}, "bulges at x"),
    ],
    ids=["step", "one pass deeper", "hard spot"],
)
def test_what_is_outside_the_library_is_described(made, words):
    base, _ = base_fit(problem(**made))
    lines = signature(base, 0.04)
    assert any(line.significant for line in lines)
    assert words in in_words(places(lines))


def test_a_bow_that_a_scanner_has_is_not_one_of_the_fixture():
    task = problem(work=bowed_as_a_scanner)
    assert search(task, library("flatness"), GATES).names == ()
