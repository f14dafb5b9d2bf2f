"""The plain programs, on a tiny problem: a wave that grows with the feed, and what may be on top of it."""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import pytest

from metro.effects.effect import Effect, EffectParameter
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit
from metro.loop.fitting.noise import first_noise
from metro.observables.problem import Block, Parameter, Problem, Refusal
from metro.observables.stability.problem import LabelProblem
from proof.answers import complete
from proof.baselines import BASELINES
from proof.baselines.base import Base
from proof.baselines.gaussian_process import GaussianProcess
from proof.baselines.kriging import Points, Process, agreement, by_chance, fitted
from proof.baselines.program import Given
from proof.baselines.run import PROGRAMS
from proof.baselines.stepwise import Stepwise, forward, weights
from proof.statistics import uniform

POINTS, SIGMA, BUDGET = 24, 0.1, 1e-6
ANGLE = 2.0 * np.pi * np.arange(POINTS) / POINTS
FEEDS = (1.0, 1.6, 2.2, 2.8, 3.4, 4.0, 1.9, 3.1)  # the last two are held out


@dataclass(frozen=True)
class Wave:
    """b · feed · cos τ + bump cos 3τ + ripple sin 5τ."""

    bump: float = 0.0
    ripple: float = 0.0

    @property
    def parameters(self):
        return (Parameter("b", "N"),)

    def nuisance_starts(self, _block):
        return np.zeros((1, 0))

    def design(self, block, _nuisance, _beta=None):
        offset = self.bump * np.cos(3.0 * ANGLE) + self.ripple * np.sin(5.0 * ANGLE)
        return (block.setting * np.cos(ANGLE))[:, None], offset


def effect(name, **options):
    def apply(model, values):
        return replace(model, **{name: getattr(model, name) + values[name]})

    parameter = EffectParameter(name, "N", -9.0, 9.0, 0.1, (-0.5, 0.5))
    return Effect(name, ("toy",), (parameter,), apply, "", "", "", **options)


LIBRARY = (effect("bump"), effect("ripple"), effect("bump", resembled=True, form="likeness"))


def problem(truth, level=None, seed=3):
    """Two runs of each feed; ``level`` of a feed, N, is what no effect knows."""
    rng = np.random.default_rng(seed)
    blocks = []
    for i in range(2 * len(FEEDS)):
        feed = FEEDS[i // 2]
        empty = Block(
            run=f"r{i}",
            condition=f"c{i // 2}",
            role="validate" if i // 2 >= 6 else "identify",
            order=i,
            measured=np.zeros(POINTS),
            sigma=np.full(POINTS, SIGMA),
            setting=feed,
            axis=np.full(POINTS, "x"),
            zeros=np.zeros((POINTS, 0)),
            zero_sd=np.zeros(0),
            coordinates={"axis": np.full(POINTS, "x"), "angle_deg": np.degrees(ANGLE)},
        )
        matrix, offset = truth.design(empty, np.zeros(0))
        odd = level(feed) if level else 0.0
        noise = SIGMA * rng.standard_normal(POINTS)
        blocks.append(replace(empty, measured=matrix @ [4.0] + offset + odd + noise))
    return Problem("toy", "N", 1.0, Wave(), tuple(blocks), np.full(1, 1e-6))


def given(task):
    blocks = task.role("identify")
    base = fit(Candidate(task.base), blocks, first_noise(BUDGET, task.scatter, blocks))
    feeds = {block.run: block.setting for block in task.blocks}
    order = np.random.default_rng(0).permutation(len(feeds))
    runs = pd.DataFrame({"feed_per_tooth_mm": pd.Series(feeds), "order": order})
    return Given(base, runs, LIBRARY, BUDGET, 1)


def labelled():
    """Twenty speeds with four depths each; the boundary is where it is predicted for slow cuts alone."""
    rpm, depth = np.repeat(np.arange(2000.0, 4000.0, 100.0), 4), np.tile([0.6, 0.9, 1.2, 1.8], 20) * 1e-3
    names = tuple(f"t{i}" for i in range(len(rpm)))
    roles = tuple("validate" if i // 4 in {2, 5, 12, 15} else "identify" for i in range(len(rpm)))
    unstable = depth > np.where(rpm < 2950.0, 1e-3, 0.5e-3)
    chance = np.where(depth > 1e-3, 0.95, 0.05)
    return LabelProblem("lobes", names, names, roles, unstable, rpm, depth, chance, ())


def test_the_names_are_those_of_the_programs():
    assert tuple(PROGRAMS) == BASELINES


@pytest.mark.parametrize("program", [Base, GaussianProcess, Stepwise])
def test_every_program_says_that_it_cannot_tell_without_a_problem_or_a_fit(program):
    task = problem(Wave())
    without = replace(given(task), base=None)
    assert program(without).refused(Refusal("no record"))["status"] == "insufficient"
    assert program(without).sampled(task)["status"] == "insufficient"


def test_the_base_model_names_nothing_and_leaves_the_error_as_it_is():
    task = problem(Wave(bump=0.6))
    found = Base(given(task)).sampled(task)
    assert found["status"] == "clean"
    assert found["effects"] == []
    assert found["before"]["rms"] == pytest.approx(np.hypot(0.6 / np.sqrt(2.0), SIGMA), rel=0.1)
    assert found["after"] == found["before"]


def test_stepwise_names_what_is_there_and_how_large_it_is():
    task = problem(Wave(bump=0.6, ripple=-0.3))
    found = complete(Stepwise(given(task)).sampled(task))
    assert [one["effect"] for one in found["effects"]] == ["bump", "ripple"]  # the larger one first
    low, high = found["effects"][0]["parameters"]["bump"]["ci95"]
    assert low < 0.6 < high
    assert found["after"]["rms"] == pytest.approx(SIGMA, rel=0.1)
    assert found["status"] == "explained"


def test_stepwise_names_nothing_where_there_is_nothing():
    task = problem(Wave())
    found = Stepwise(given(task)).sampled(task)
    assert (found["status"], found["effects"]) == ("clean", [])
    assert {one["effect"] for one in found["candidates"]} == {"bump", "ripple"}
    assert sum(one["probability"] for one in found["candidates"]) < 0.5


def test_the_selection_is_by_the_textbook():
    """Three models of which each effect lowers the BIC by a known amount."""
    worth = {"bump": 6.0, "ripple": -2.0}
    chosen = forward((), LIBRARY[:2], lambda m, e: (*m, e.name), lambda m: -sum(worth[name] for name in m))
    assert chosen.model == ("bump",)
    assert chosen.named["bump"] == pytest.approx(np.exp(3.0) / (1.0 + np.exp(3.0) + np.exp(-1.0)))
    assert chosen.candidates["ripple"] == pytest.approx(np.exp(-1.0) / (1.0 + np.exp(-1.0)))
    assert weights([5.0, 5.0]) == [0.5, 0.5]


def test_a_gaussian_process_corrects_what_depends_on_the_settings_and_names_nothing():
    task = problem(Wave(), level=lambda feed: feed)
    found = GaussianProcess(given(task)).sampled(task)
    assert found["status"] == "unexplained"
    assert found["effects"] == []
    assert found["after"]["rms"] < 0.4 * found["before"]["rms"]


def test_a_gaussian_process_corrects_a_wave_that_is_the_same_in_all_runs():
    task = problem(Wave(bump=0.6))
    found = GaussianProcess(given(task)).sampled(task)
    assert found["status"] == "unexplained"
    assert found["after"]["rms"] < 0.7 * found["before"]["rms"]


def test_a_gaussian_process_finds_nothing_in_noise_more_often_than_it_says():
    rng = np.random.default_rng(8)
    runs, condition = [f"r{i}" for i in range(12)], np.arange(12) // 2
    settings, places = rng.standard_normal((12, 2)).repeat(6, axis=0), rng.standard_normal((72, 1))
    p_values = []
    for _ in range(200):
        value = rng.standard_normal(12).repeat(6) + rng.standard_normal(72)  # a run's own error, and noise
        points = Points(settings, places, np.repeat(runs, 6), value)
        p_values.append(by_chance(agreement(points, runs, condition.tolist()), 1))
    assert uniform(p_values)[1] > 0.01
    task = problem(Wave())
    found = GaussianProcess(given(task)).sampled(task)
    assert found["status"] == "clean"
    assert found["after"]["rms"] < 1.1 * found["before"]["rms"]


def test_labels_are_corrected_within_zero_and_one():
    task = labelled()
    found = GaussianProcess(Given(None, pd.DataFrame(), (), BUDGET, 1)).labelled(task)
    assert found["status"] == "unexplained"
    assert found["after"]["rms"] < found["before"]["rms"]
    assert Base(Given(None, pd.DataFrame(), (), BUDGET, 1)).labelled(task)["status"] == "clean"


def test_the_mean_of_the_process_is_that_of_the_closed_form():
    """Two points of two runs, no place: k/(1 + σ² + ρ² + k′) by hand."""
    points = Points(np.array([[0.0], [1.0]]), np.zeros((2, 0)), np.array(["a", "b"]), np.array([1.0, 0.0]))
    process = Process(points, np.ones(2), np.array([1.0, 0.5, 0.5]))
    near, own = np.exp(-0.5), 1.0 + 0.25 + 0.25
    expected = (1.0 * own - near * near) / (own**2 - near**2)
    assert process.mean(np.zeros((1, 1)), np.zeros((1, 0)))[0] == pytest.approx(expected, rel=1e-6)


def test_the_fit_finds_the_noise_and_what_a_run_shares():
    rng = np.random.default_rng(5)
    run = np.repeat(np.arange(30), 12)
    shared, white = 0.8 * rng.standard_normal(30)[run], 0.3 * rng.standard_normal(len(run))
    settings = rng.standard_normal((30, 2))[run]
    process = fitted(Points(settings, np.zeros((len(run), 0)), run.astype(str), shared + white))
    signal, of_run, noise = process.parts
    assert noise == pytest.approx(0.3, rel=0.1)
    assert np.hypot(signal, of_run) == pytest.approx(0.8, rel=0.3)


def test_repeats_that_agree_with_each_other_alone_say_nothing():
    """Each condition has its own level, of either sign: the others are wrong about it as often as right."""
    runs, condition = [f"r{i}" for i in range(16)], np.arange(16) // 2
    level = np.array([1.0, -1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0])[condition]
    points = Points(np.zeros((16, 1)), np.zeros((16, 0)), np.array(runs), level)
    alike = agreement(points, runs, condition.tolist())
    assert alike[0, 1] == 0.0  # repeats
    assert alike[0, 2] == pytest.approx(-1.0)
    assert alike.sum() < 0.0
    assert by_chance(alike, 1) > 0.3
