"""Cutting force: identified coefficients and the closed loop, on real, simulated and drawn data."""

import math
import os
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d

from metro.batch.processed import Processed, read_batch
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement
from metro.cutting.force import COEFFICIENTS, Cut
from metro.cutting.law import EdgeLaw
from metro.effects import tool_runout
from metro.effects.library import library, with_declared
from metro.loop.ceiling import ceiling
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit
from metro.loop.fitting.held_out import comparison, held_out, identified_fit
from metro.loop.fitting.noise import first_noise
from metro.loop.search.search import search
from metro.loop.search.trial import Gates
from metro.loop.verdict.verdict import judge
from metro.observables.force import observable as force
from metro.observables.force.coefficients import correlation
from metro.observables.force.dynamometer import Recording
from metro.observables.force.mean_forces import mean_forces
from metro.observables.force.model import ForceModel, ForceSetting
from metro.observables.problem import BaseFit, Block, Problem, Refusal
from metro.observables.quantity import quantity
from metro.signals.orders import order_matrix
from metro.stages.ingest import ingest

ROOT = Path(__file__).parents[2]
REAL = Path(os.environ.get("METRO_REAL_DATA", ROOT / "../shared/real")) / "batches"
real = pytest.mark.skipif(not REAL.is_dir(), reason="the real data (METRO_REAL_DATA) are not there")
RECORDING = Recording((0.5,), 1.0, 100.0)
GATES = Gates(model_form_budget=0.007, materiality=0.004, false_additions=0.05, held_out_gain=3.0, seed=1)
PUBLISHED = {"ktc": 958.86, "krc": 250.86, "kac": 146.36, "kte": 15.758, "kre": 19.434, "kae": 18.208}


class Observed:
    """A batch as the stages see it, up to its force problem."""

    def __init__(self, folder, out):
        ingest(folder, ROOT / "config" / "cells", out, {}, "test")
        self.batch = read_batch(out)
        self.observed = force.observe(self.batch, Processed(out), {})
        self.task = force.problem(self.batch, self.observed, {})

    def identified(self):
        blocks = self.task.role("identify")
        base = fit(Candidate(self.task.base), blocks, first_noise(0.007, self.task.scatter, blocks))
        return force.report(self.batch, self.observed, {}, self.task, identified_fit(self.task, base))[
            "force"
        ]

    def closed(self):
        outcome = search(self.task, library("force"), GATES)
        rows = comparison(self.task, held_out(self.task, outcome.base), held_out(self.task, outcome.final))
        return outcome, rows, judge(self.task, outcome, rows, GATES)


@pytest.fixture(scope="module")
def slotting(tmp_path_factory):
    return Observed(REAL / "slotting-d25", tmp_path_factory.mktemp("slotting") / "out")


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    return Observed(ROOT / "data" / "raw" / "clean-slot", tmp_path_factory.mktemp("clean") / "out")


@real
@pytest.mark.xdist_group("slotting")
def test_of_the_real_slot_nearly_all_that_the_base_model_leaves_could_be_explained(slotting):
    """By hand: harmonics linear in the feed predict feed 0.075 to 6 % of the signal, 0.125 to 19 %."""
    blocks = slotting.task.role("identify")
    base = fit(Candidate(slotting.task.base), blocks, first_noise(0.007, slotting.task.scatter, blocks))
    found = ceiling(slotting.task, base)
    assert found["share"] > 0.8
    assert found["parts"]["alone"] < 0.1
    left = {one["run"]: one["of_signal"] for one in found["held_out"]}
    assert left["f0900"] < 1.5 * 0.06
    assert left["f1500"] < 1.5 * 0.19
    assert {place["label"] for place in found["places"]} <= {f"order {k}" for k in (1, 4, 6, 8, 10)}


@real
@pytest.mark.xdist_group("slotting")
def test_mean_forces_of_all_five_feeds_give_the_published_coefficients(slotting):
    found = slotting.identified()["mean_all_runs"]
    assert {name: entry["value"] for name, entry in found.items()} == pytest.approx(PUBLISHED, rel=1e-3)


def missed(observed):
    """What the base model leaves of the runs of the fit, rms, N."""
    blocks = observed.task.role("identify")
    base = fit(Candidate(observed.task.base), blocks, first_noise(0.007, observed.task.scatter, blocks))
    model = base.candidate.model(base.theta)
    left = []
    for block in blocks:
        matrix, offset = model.design(block, base.nuisance[block.run], base.beta)
        left.append(np.mean((block.measured - offset - matrix @ base.beta) ** 2))
    return math.sqrt(np.mean(left))


@pytest.mark.parametrize("wander", [0.0005, 0.005])
def test_a_spindle_that_wanders_without_a_tacho_is_followed(clean, wander, tmp_path):
    """Its speed changes by a relative standard deviation over 0.3 s; the record is 0.9 s long."""
    folder = tmp_path / "clean-slot"
    shutil.copytree(ROOT / "data" / "raw" / "clean-slot", folder)
    rng = np.random.default_rng(7)
    for file in sorted((folder / "force").glob("*.parquet")):
        record = pd.read_parquet(file)
        time = record["t_s"].to_numpy()
        step = time[1] - time[0]
        slow = gaussian_filter1d(rng.standard_normal(len(time)), 0.3 / step)
        ahead = np.cumsum(wander * (slow - slow.mean()) / slow.std()) * step
        for axis in ("fx_n", "fy_n", "fz_n"):
            record[axis] = CubicSpline(time, record[axis].to_numpy())(time + ahead)
        record.to_parquet(file)
    assert missed(Observed(folder, tmp_path / "out")) < 1.15 * missed(clean)


def test_mean_forces_lie_on_the_lines_of_the_coefficients_that_made_them(clean):
    """The simulator's coefficients put the measured means where they are, but for noise and gain."""
    found = clean.identified()
    identified = {"force": found}
    task = force.problem(clean.batch, clean.observed, identified)
    table = mean_forces(clean.batch, clean.observed["spindle"], identified, task)["mean_forces"]
    assert sorted(table["run"].unique()) == sorted(clean.batch.runs.index)
    rest = table["measured_n"] - table["fitted_n"]
    assert np.sqrt(np.mean(rest**2) / np.mean(table["measured_n"] ** 2)) < 0.02
    slots = table[(table["operation"] == "slot") & (table["axis"] == "y")]
    slope, start = np.polyfit(slots["feed_per_tooth_mm"], slots["fitted_n"], 1)
    value = {name: entry["value"] for name, entry in found["mean_all_runs"].items()}
    teeth, depth = 3, 2.0  # Altintas: the mean across a slot is N a/4 (Ktc c + 4/π Kte)
    assert slope == pytest.approx(teeth * depth / 4.0 * value["ktc"], rel=1e-3)
    assert start == pytest.approx(teeth * depth / np.pi * value["kte"], rel=1e-3)


def test_without_coefficients_there_are_no_lines(clean):
    task = force.problem(clean.batch, clean.observed, {})
    assert mean_forces(clean.batch, clean.observed["spindle"], {}, task) == {}
    assert mean_forces(clean.batch, clean.observed["spindle"], {"force": clean.identified()}, None) == {}


@real
@pytest.mark.slow  # the workflow's loop on the same batch is in every run of the main job
@pytest.mark.xdist_group("slotting")
def test_told_nothing_the_loop_predicts_two_feeds_of_the_real_slots_to_a_part_of_the_signal(slotting):
    outcome, rows, _ = slotting.closed()
    assert {"tool_runout", "dynamometer_resonance", "entry_exit_force"} <= set(outcome.names)
    feed = rows["run"].map(slotting.batch.runs["feed_per_tooth_mm"])
    for held, most in ((0.075, 0.23), (0.125, 0.35)):
        one = rows[np.isclose(feed, held)]
        assert len(one) > 0
        assert np.sum((one["measured"] - one["after"]) ** 2) < most**2 * np.sum(one["measured"] ** 2)


@pytest.mark.xdist_group("clean")
def test_the_coefficients_of_the_clean_batch_lie_within_their_intervals(clean):
    truth = {"ktc": 842.0, "krc": 317.0, "kac": 176.0, "kte": 14.2, "kre": 17.8, "kae": 3.9}
    found = clean.identified()
    off = []
    for name, value in truth.items():
        low, high = found["waveform"][name]["ci95"]
        off.append(abs(2.0 * value - low - high) / (high - low))
        assert found["mean"][name]["value"] == pytest.approx(value, rel=0.06)
    assert sorted(off)[-2] < 1.0
    assert max(off) < 1.5  # of six intervals one may miss: they hold 95 %
    assert all(
        entry["unit"] == ("N/mm2" if name.endswith("c") else "N/mm")
        for name, entry in found["waveform"].items()
    )


@pytest.mark.xdist_group("clean")
def test_nothing_is_added_to_the_clean_batch(clean):
    outcome, _, verdict = clean.closed()
    assert outcome.names == ()
    assert verdict["status"] == "clean"
    assert verdict["before"] == verdict["after"]


@pytest.mark.xdist_group("clean")
def test_the_comparison_is_the_revolution_average_of_the_record(clean):
    rows = comparison(clean.task, held_out(clean.task, fit_of(clean)))
    block = clean.task.role("validate")[0]
    own = rows[(rows["run"] == block.run) & (rows["axis"] == "y")]
    assert own.groupby("t_s")["angle_deg"].nunique().min() >= 120
    highest = block.setting.highest
    y = block.measured.reshape(block.repeats, 3, -1)[0, 1]
    wave = order_matrix(2 * math.pi * np.arange(120) / 120, highest) @ y
    assert own["measured"].to_numpy()[:120] == pytest.approx(wave)
    spindle = clean.observed["spindle"].set_index("run")
    assert wave.mean() == pytest.approx(spindle.loc[block.run, "mean_y_n"], rel=0.02)


def fit_of(observed):
    blocks = observed.task.role("identify")
    return fit(Candidate(observed.task.base), blocks, first_noise(0.007, observed.task.scatter, blocks))


def test_helical_runs_give_their_coefficients_once_the_runout_is_known(tmp_path):
    out = tmp_path / "out"
    helical = Observed(ROOT / "data" / "raw" / "trimule-helical", out)
    radius, angle = search(helical.task, (tool_runout.EFFECT,), GATES).final.theta
    known = {"tool_runout": {"radius_um": radius, "angle_deg": angle}}
    batch = replace(helical.batch, manifest=helical.batch.manifest | {"known": known})
    task = with_declared(force.problem(batch, helical.observed, {}), known)
    blocks = task.role("identify")
    found = fit(Candidate(task.base), blocks, first_noise(0.007, task.scatter, blocks))
    truth = np.array([10145.0, 11036.5, 5000.0, 591.92, 100.03, 214.32])
    value = found.beta / [parameter.si for parameter in task.base.parameters]
    assert value[:3] == pytest.approx(truth[:3], rel=0.03)
    assert value[3] == pytest.approx(truth[3], rel=0.05)
    assert [parameter.name for parameter in task.base.parameters][6:] == ["kfae"]
    # Two records of one hole begin anywhere on the orbit: ψ₀ is found so that the prediction holds.
    helices = [block for block in blocks if block.setting.helix is not None]
    for block in helices:
        rest = block.measured - found.predict(block)
        assert np.linalg.norm(rest) < 0.05 * np.linalg.norm(block.measured)
        turned = found.nuisance[block.run] + np.array([0.0, 0.5])
        wrong = block.measured - task.base.design(block, turned)[0] @ found.beta
        assert np.linalg.norm(wrong) > 5 * np.linalg.norm(rest)


TOOL = Cutter(6e-3, math.radians(30), evenly_pitched(2))
BETA = np.array([842e6, 317e6, 176e6, 14.2e3, 17.8e3, 3.9e3])


def drawn(seed, highest=8, scatter=0.01, budget=0.005):
    """A force problem drawn from its own model: coefficients scattered by run, one model-form error."""
    rng = np.random.default_rng(seed)
    model, blocks = ForceModel(TOOL, EdgeLaw()), []
    elements = 2 * highest + 1
    axis = np.repeat(["x", "y", "z"], elements)
    mean = np.tile(np.arange(elements) == 0, 3)
    form = rng.normal(size=3 * elements)  # what the model gets wrong is alike in all conditions
    for i, feed in enumerate((0.04e-3, 0.07e-3, 0.1e-3, 0.13e-3) * 2):
        setting = ForceSetting(Cut(feed, 2e-3, Engagement(0.0, math.pi)), 0.0, highest, RECORDING, 0.0)
        blank = Block(
            run=f"r{i}",
            condition=f"{feed:g}",
            role="identify",
            order=i,
            measured=np.zeros(3 * elements),
            sigma=np.full(3 * elements, 0.3),
            setting=setting,
            axis=axis,
            zeros=np.stack([(axis == name) & mean for name in "xyz"], axis=1).astype(float),
            zero_sd=np.full(3, 0.3),
            coordinates={},
            symmetries=np.array(TOOL.tooth_angles)[:, None],
        )
        matrix, _ = model.design(blank, rng.uniform(0, 2 * math.pi, 1))
        clean = matrix @ (BETA * (1 + scatter * rng.normal(size=6)))
        rms = np.sqrt(np.mean(clean.reshape(3, -1) ** 2, axis=1))[np.repeat([0, 1, 2], elements)]
        measured = clean + budget * rms * form + 0.3 * rng.normal(size=3 * elements)
        measured += blank.zeros @ (0.3 * rng.normal(size=3))
        blocks.append(replace(blank, measured=measured))
    return Problem("force", "N", 1.0, model, tuple(blocks), np.full(6, 0.01))


def test_intervals_of_the_coefficients_cover_the_truth_and_are_not_needlessly_wide():
    inside, error, told = [], [], []
    for seed in range(40):
        task = drawn(seed)
        prior = first_noise(0.005, task.scatter, task.blocks)
        found = identified_fit(task, fit(Candidate(task.base), task.blocks, prior))
        sd = np.sqrt(np.diag(found.covariance))
        for value, own, truth in zip(found.beta, sd, BETA, strict=True):
            low, high = quantity(value, own, "N/m2", found.dof)["ci95"]
            inside.append(low < truth < high)
        error.append(found.beta / BETA - 1)
        told.append(sd / BETA)
    assert 0.88 <= np.mean(inside) <= 0.99
    assert np.mean(told) < 1.5 * np.sqrt(np.mean(np.square(error)))


def test_mean_forces_of_one_feed_cannot_part_shear_from_edge(clean):
    blocks = [block for block in clean.task.role("identify") if block.condition == "slot-0.06"]
    refused = force.mean_coefficients(clean.task.base, tuple(blocks), clean.observed["spindle"])
    assert "second feed" in refused.reason


def test_shear_and_edge_terms_that_the_data_cannot_part_carry_a_warning():
    sd = 0.1 * BETA

    def told(together):
        shape = np.eye(6)
        shape[0, 3] = shape[3, 0] = together
        return correlation(ForceModel(TOOL, EdgeLaw()), BaseFit(BETA, shape * np.outer(sd, sd), 9.0, {}))

    assert "warnings" not in told(-0.9)
    (warning,) = told(-0.99)["warnings"]
    assert warning.startswith("ktc and kte")
    assert np.array(told(-0.99)["correlation"]["matrix"])[0, 3] == pytest.approx(-0.99)


def test_runs_that_chattered_are_no_evidence_of_a_steady_cut(clean):
    runs = clean.batch.runs
    labelled = runs.assign(stable=np.where(np.arange(len(runs)) == 0, "no", "yes"))
    task = force.problem(replace(clean.batch, runs=labelled), clean.observed, {})
    first = str(runs.index[0])
    assert {block.run for block in task.blocks} == {block.run for block in clean.task.blocks} - {first}
    assert f"Left out: {first}, which chattered (column stable): the model is of a steady cut." in task.notes
    assert not any("chattered" in note for note in clean.task.notes)
    none = force.problem(replace(clean.batch, runs=runs.assign(stable="no")), clean.observed, {})
    assert isinstance(none, Refusal)
    assert "every run with a record chattered" in none.reason


def test_a_batch_without_records_says_so(clean):
    batch = replace(clean.batch, runs=clean.batch.runs.assign(dynamometer=""))
    assert "dynamometer" in force.observe(batch, None, {}).reason


def test_coefficients_come_in_the_contracts_order():
    assert tuple(parameter.name for parameter in ForceModel(TOOL, EdgeLaw()).parameters) == COEFFICIENTS


def test_holes_alone_do_not_tell_tangential_from_radial(tmp_path):
    holes = Observed(ROOT / "data" / "raw" / "trimule-helical", tmp_path / "out")
    blocks = tuple(block for block in holes.task.blocks if block.setting.helix is not None)
    holes.task = replace(holes.task, blocks=blocks)
    found = holes.identified()
    assert set(found["waveform"]) == {"kac", "kae", "kfae"}
    assert "cut one slot" in found["not_identified"]["krc"]
    assert found["not_identified"]["mean"].startswith("all runs are helical")
