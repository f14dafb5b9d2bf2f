"""The split of an error in what came with the force and what is the observable's own, by construction."""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import pytest

from metro.loop.causes.chain import parts, split
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit
from metro.loop.fitting.noise import first_noise
from metro.observables.cut.upstream import mean_forces
from metro.observables.problem import Block, Parameter, Problem
from metro.wording.causes import split_in_words

PLACES = 12
COMPLIANCE, TRUE, OFF = 2e-3, 50.0, 0.1  # mm per N; N; of the predicted force
SHAPE = 0.004 * np.cos(np.pi * np.arange(PLACES))  # of the wall, which is nobody's force; mean zero


@dataclass(frozen=True)
class Spring:
    """A deflection in proportion to the force that its setting names."""

    parameters: tuple = (Parameter("compliance", "mm/N"),)

    def nuisance_starts(self, _block):
        return np.zeros((1, 0))

    def design(self, block, _nuisance, _beta=None):
        return np.full((PLACES, 1), block.setting), np.zeros(PLACES)


def wall(run, role, force, shape=0.0):
    """One wall cut with ``force``."""
    return Block(
        run=run, condition=run, role=role, order=1, measured=COMPLIANCE * force + shape * np.ones(PLACES),
        sigma=np.full(PLACES, 1e-4), setting=force, axis=np.full(PLACES, "z"), zeros=np.zeros((PLACES, 0)),
        zero_sd=np.zeros(0), coordinates={},
    )  # fmt: skip


def held_out(shape):
    blocks = (*(wall(f"r{i}", "identify", 20.0 * i) for i in (1, 2, 3)), wall("v", "validate", TRUE, shape))
    problem = Problem("deformation", "mm", 1.0, Spring(), blocks, np.full(1, 0.005))
    runs = problem.role("identify")
    return problem, fit(Candidate(Spring()), runs, first_noise(0.007, problem.scatter, runs))


@pytest.mark.parametrize(("shape", "share"), [(0.0, 1.0), (SHAPE, None)])
def test_the_parts_are_those_that_the_batch_was_made_of(shape, share):
    problem, fitted = held_out(shape)
    (run,) = problem.role("validate")
    fed = {"measured": run, "before": replace(run, setting=TRUE * (1 + OFF)), "after": run}
    told = split(problem, {"before": fitted, "after": fitted}, {"v": fed})
    upstream, own = COMPLIANCE * TRUE * OFF, float(np.sqrt(np.mean(np.square(shape))))
    assert told["before"]["upstream"] == pytest.approx(upstream, rel=1e-3)
    assert told["before"]["own"] == pytest.approx(own, rel=1e-3, abs=1e-6)
    assert told["before"]["total"] == pytest.approx(np.hypot(upstream, own), rel=1e-3)
    expected = upstream**2 / (upstream**2 + own**2) if share is None else share
    assert told["before"]["share"] == pytest.approx(expected, rel=1e-3)
    assert told["after"]["upstream"] == 0.0
    assert told["after"]["total"] == told["after"]["own"]
    assert [entry["run"] for entry in told["runs"]] == ["v", "v"]


def test_parts_that_had_made_up_for_each_other_have_a_negative_share_and_figures_are_in_the_unit_told():
    """The wall stands 8 µm proud by itself, and the force that was predicted too large hides it."""
    problem, fitted = held_out(0.008)
    problem = replace(problem, unit="um", si=1e-3)
    (run,) = problem.role("validate")
    fed = {"measured": run, "before": replace(run, setting=TRUE * (1 + OFF)), "after": run}
    told = split(problem, {"before": fitted, "after": fitted}, {"v": fed})["before"]
    assert (told["total"], told["upstream"], told["own"]) == pytest.approx((2.0, 10.0, 8.0), rel=1e-3)
    assert told["share"] == pytest.approx(1 - 16, rel=1e-2)


def test_the_two_parts_add_up_place_by_place():
    problem, fitted = held_out(SHAPE)
    (run,) = problem.role("validate")
    found = parts(fitted, run, replace(run, setting=30.0))
    assert found.total == pytest.approx(found.upstream + found.own)
    assert found.total == pytest.approx(run.measured - COMPLIANCE * 30.0, abs=1e-6)


def test_what_the_measured_force_may_be_off_by_is_the_doubt_of_the_parts():
    """Two errors of 3 N and 4 N, each by itself, are one of 5 N, whatever was predicted."""
    problem, fitted = held_out(SHAPE)
    (run,) = problem.role("validate")
    fed = {"measured": run, "before": replace(run, setting=30.0), "after": run}
    fed |= {name: replace(run, setting=TRUE + off) for name, off in (("one", 3.0), ("other", -4.0))}
    told = split(problem, {"before": fitted, "after": fitted}, {"v": fed})
    for when in ("before", "after"):
        assert told[when]["doubt"] == pytest.approx(5.0 * COMPLIANCE, rel=1e-3)
    assert f"{5.0 * COMPLIANCE:.2g} mm from the measured force" in split_in_words(told)
    without = split(problem, {"before": fitted, "after": fitted}, {"v": dict(list(fed.items())[:3])})
    assert without["before"]["doubt"] == 0.0
    assert without["before"]["upstream"] == told["before"]["upstream"]


def test_mean_forces_are_those_of_the_rows_by_run_and_axis():
    angle = np.arange(0, 360, 3.0)
    rows = pd.concat(
        pd.DataFrame({"angle_deg": angle, "measured": level + 5 * np.cos(np.radians(angle))}).assign(
            observable="force", run=run, axis=axis, before=1.1 * level, after=level
        )
        for run, shift in (("a", 0.0), ("b", 100.0))
        for axis, level in (("z", 30 + shift), ("x", 10 + shift), ("y", -20 + shift))
    )
    found = mean_forces(rows)
    assert found["a"]["measured"] == pytest.approx([10.0, -20.0, 30.0])
    assert found["b"]["before"] == pytest.approx([121.0, 88.0, 143.0])
    assert mean_forces(rows[rows["run"] == "none"]) == {}
