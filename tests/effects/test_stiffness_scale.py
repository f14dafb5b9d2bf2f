"""Stiffness in the cut against that of the load tests: found where they differ, and only there."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

from metro.batch.processed import Processed, read_batch
from metro.effects.library import library
from metro.effects.stiffness_scale import OF_ARM, apply
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit
from metro.loop.fitting.held_out import identified_fit
from metro.loop.fitting.noise import first_noise
from metro.loop.search.search import search
from metro.loop.search.trial import Gates
from metro.loop.verdict.verdict import parameters
from metro.observables.deformation import observable as deformation
from metro.observables.force import observable as force
from metro.observables.problem import Block, Parameter, Problem
from metro.stages.ingest import ingest
from metro.structure import Structure

ROOT = Path(__file__).parents[2]
GATES = Gates(model_form_budget=0.007, materiality=0.004, false_additions=0.05, held_out_gain=3.0, seed=1)
COMPLIANCE = np.array([2.0, 0.7])


@dataclass(frozen=True)
class Springs:
    """Displacement = compliance × lever × force; in the cut, of a structure that may be softer."""

    structure: Structure = field(default_factory=Structure)

    @property
    def parameters(self):
        return (Parameter("c1", "1"), Parameter("c2", "1"))

    def nuisance_starts(self, _block):
        return np.zeros((1, 0))

    def design(self, block, _nuisance, _beta=None):
        rows = block.setting
        return (rows if block.role == "calibrate" else self.structure.in_cut(rows)), np.zeros(len(rows))


def springs(factor, seed):
    """Six load tests and eight cuts in four conditions, two more held out."""
    rng = np.random.default_rng(seed)
    truth, blocks = Springs(Structure(factor)), []
    for i in range(16):
        role = "calibrate" if i < 6 else "identify" if i < 14 else "validate"
        levers = np.stack([np.linspace(0.5, 1.5, 12), rng.uniform(0.5, 2.0, 12)], axis=1) * (1 + i % 4)
        blank = Block(
            run=f"r{i}",
            condition=f"{role}{i % 4}",
            role=role,
            order=i,
            measured=np.zeros(12),
            sigma=np.full(12, 0.01),
            setting=levers,
            axis=np.full(12, "z"),
            zeros=np.zeros((12, 0)),
            zero_sd=np.zeros(0),
            coordinates={},
        )
        scatter = 0.0 if role == "calibrate" else 0.01
        clean = truth.design(blank, np.zeros(0))[0] @ (COMPLIANCE * (1 + scatter * rng.normal(size=2)))
        blocks.append(replace(blank, measured=clean + 0.01 * rng.normal(size=12)))
    return Problem("deformation", "m", 1.0, Springs(), tuple(blocks), np.full(2, 0.01))


@pytest.mark.parametrize("factor", [0.7, 0.9, 1.3])
def test_a_factor_on_the_stiffness_is_recovered_beside_load_tests(factor):
    outcome = search(springs(factor, 1), (OF_ARM,), GATES)
    assert outcome.names == ("stiffness_scale",)
    found = parameters(outcome.final, "stiffness_scale")["factor"]
    assert found["ci95"][0] < factor < found["ci95"][1]
    assert found["value"] == pytest.approx(factor, rel=0.02)
    assert outcome.final.beta == pytest.approx(COMPLIANCE, rel=0.01)


@pytest.mark.parametrize("seed", range(4))
def test_nothing_is_found_where_cut_and_load_tests_agree(seed):
    assert search(springs(1.0, seed), (OF_ARM,), GATES).names == ()


def test_without_load_tests_it_cannot_be_seen():
    task = springs(0.8, 2)
    alone = replace(task, blocks=tuple(block for block in task.blocks if block.role != "calibrate"))
    outcome = search(alone, (OF_ARM,), GATES)
    assert outcome.names == ()
    assert "stiffness_scale" in outcome.not_visible


def test_applied_twice_the_factors_multiply():
    twice = apply(apply(Springs(), {"factor": 0.8}), {"factor": 0.5})
    assert twice.structure.stiffness_factor == pytest.approx(0.4)


def arm_outcome(folder, out):
    """Force coefficients of a batch of the arm, then the loop on its deformation."""
    ingest(folder, ROOT / "config" / "cells", out, {}, "test")
    batch = read_batch(out)
    read = Processed(out)
    observed = force.observe(batch, read, {})
    task = force.problem(batch, observed, {})
    blocks = task.role("identify")
    base = identified_fit(task, fit(Candidate(task.base), blocks, first_noise(0.007, task.scatter, blocks)))
    identified = force.report(batch, observed, {}, task, base)
    walls = deformation.problem(batch, deformation.observe(batch, read, identified), identified)
    return search(walls, library("deformation"), GATES)


def test_the_arm_of_the_bundled_batch_is_softer_in_the_cut_than_in_its_load_tests(tmp_path):
    outcome = arm_outcome(ROOT / "data" / "raw" / "kr160-side", tmp_path / "out")
    assert "stiffness_scale" in outcome.names
    assert parameters(outcome.final, "stiffness_scale")["joint"] == "all"
    found = parameters(outcome.final, "stiffness_scale")["factor"]
    assert found["ci95"][0] < 0.5 < found["ci95"][1]
    assert found["value"] == pytest.approx(0.5, rel=0.05)


@pytest.mark.slow
def test_an_arm_as_stiff_in_the_cut_as_in_its_load_tests_is_left_alone(tmp_path, monkeypatch):
    from virtual_cell.recipes import kr160

    monkeypatch.setattr(kr160, "SOFT", kr160.ARM)
    kr160.make(tmp_path / "kr160-stiff")
    assert "stiffness_scale" not in arm_outcome(tmp_path / "kr160-stiff", tmp_path / "out").names
