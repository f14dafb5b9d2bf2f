"""What the loop finds does not depend on units, on the order or names of runs, or on how they are sampled."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from metro.effects.effect import Effect, EffectParameter
from metro.loop.checks.evidence import compare, hold_out, leave_out
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit
from metro.loop.fitting.noise import first_noise
from metro.observables.problem import Block, Parameter

FEW = settings(max_examples=4, deadline=None, derandomize=True, database=None)
ANGLE = 2 * np.pi * np.arange(24) / 24
SEEDS = st.integers(0, 2**32 - 1)
FEEDS = (1.0, 2.0, 3.0)


@dataclass(frozen=True)
class Wave:
    """beta0 · feed · (cos τ + bend cos 3τ) + beta1 (1 + sin 2τ + sin 5τ / 2), τ from each run's own start."""

    bend: float = 0.0
    parameters = (Parameter("a", "N"), Parameter("b", "N"))

    def nuisance_starts(self, _block):
        return np.linspace(0.0, 2 * np.pi, 16, endpoint=False)[:, None]

    def design(self, block, nuisance, _beta):
        feed, angle = block.setting
        tau = np.array(angle) - nuisance[0]
        first = feed * (np.cos(tau) + self.bend * np.cos(3 * tau))
        return np.stack([first, 1 + np.sin(2 * tau) + 0.5 * np.sin(5 * tau)], axis=1), np.zeros(len(tau))


BEND = Effect(
    "bend", ("toy",), (EffectParameter("bend", "1", -2.0, 2.0, 0.05, starts=(-0.1, 0.1)),),
    lambda model, values: replace(model, bend=model.bend + values["bend"]), "", "", "",
)  # fmt: skip


def batch(seed):
    """Three feeds, twice each: coefficients scatter by 1 %, samples by 0.05; each run starts anywhere."""
    rng = np.random.default_rng(seed)
    blocks = []
    for order, feed in enumerate(FEEDS * 2):
        block = Block(
            f"r{order}", f"feed {feed:g}", "identify", order, np.zeros(24), np.full(24, 0.05),
            (feed, tuple(ANGLE)), np.repeat(["x", "y"], 12), np.ones((24, 1)), np.array([0.02]), {},
        )  # fmt: skip
        matrix, _ = Wave(0.02).design(block, rng.uniform(0.0, 6.0, 1), None)
        values = matrix @ (np.array([5.0, 8.0]) * rng.normal(1.0, 0.01, 2)) + rng.normal(0.0, 0.05, 24)
        blocks.append(replace(block, measured=values))
    return tuple(blocks)


def told(blocks):
    """Return what the runs say of the effect: its size, and the evidence for it."""
    prior = first_noise(0.002, np.full(2, 0.01), blocks)
    smaller = fit(Candidate(Wave()), blocks, prior)
    larger = fit(Candidate(Wave(), (BEND,)), blocks, prior, smaller)
    found = hold_out(compare(smaller, larger), leave_out(smaller, prior), larger, prior)
    return larger, found


def same(found, expected, unit=1.0):
    (fitted, evidence), (other, known) = found, expected
    assert fitted.theta == pytest.approx(other.theta, rel=1e-5)
    assert fitted.beta == pytest.approx(other.beta * unit, rel=1e-5)
    deviations = np.sqrt(np.diag(other.covariance)) * [unit, unit, 1.0]
    assert np.sqrt(np.diag(fitted.covariance)) == pytest.approx(deviations, rel=1e-4)
    assert evidence.statistic == pytest.approx(known.statistic, abs=1e-3)
    assert evidence.size == pytest.approx(known.size, rel=1e-4)
    assert evidence.gain == pytest.approx(known.gain, abs=1e-3)


@FEW
@given(SEEDS, st.floats(1e-6, 1e6))
def test_in_another_unit_the_evidence_is_the_same(seed, unit):
    blocks = batch(seed)
    other = [
        replace(b, measured=b.measured * unit, sigma=b.sigma * unit, zero_sd=b.zero_sd * unit) for b in blocks
    ]
    same(told(tuple(other)), told(blocks), unit)


@FEW
@given(SEEDS)
def test_runs_may_come_in_any_order(seed):
    blocks, order = batch(seed), np.random.default_rng([seed, 1]).permutation(6)
    same(told(tuple(blocks[i] for i in order)), told(blocks))


@FEW
@given(SEEDS)
def test_runs_conditions_and_axes_may_have_any_names(seed):
    blocks, draw = batch(seed), np.random.default_rng([seed, 2])
    runs, conditions = draw.permutation(6), draw.permutation(3)
    names = dict(zip((f"feed {feed:g}" for feed in FEEDS), conditions, strict=True))
    other = [
        replace(b, run=f"run-{i}", condition=f"c{names[b.condition]}", axis=np.where(b.axis == "x", "y", "x"))
        for b, i in zip(blocks, runs, strict=True)
    ]
    same(told(tuple(other)), told(blocks))


@FEW
@given(SEEDS, st.randoms(use_true_random=False))
def test_samples_of_a_run_may_begin_anywhere_and_come_in_any_order(seed, draw):
    blocks, other = batch(seed), []
    for b in blocks:
        order, (feed, angle) = draw.sample(range(24), 24), b.setting
        setting = (feed, tuple(np.array(angle)[order] + draw.uniform(-0.1, 0.1)))
        other.append(replace(b, measured=b.measured[order], axis=b.axis[order], setting=setting))
    same(told(tuple(other)), told(blocks))
