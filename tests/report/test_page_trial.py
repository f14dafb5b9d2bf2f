"""The cut that is tried in the page: its script's force against the Python model, and what it starts from."""

import json
import math
import shutil
import subprocess
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest
import synthetic_results as synthetic

from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import engagement
from metro.cutting.force import force_basis
from metro.cutting.law import EdgeLaw
from metro.report.page.compare import quantities
from metro.report.page.trial import trial_cut

NODE = shutil.which("node")
SCRIPT = files("metro.report.page") / "assets" / "cutting.js"
COEFFICIENTS = [850.0, 320.0, 180.0, 14.0, 18.0, 4.0]  # N/mm² and N/mm
ODD = tuple(math.radians(angle) for angle in (0.0, 80.0, 190.0, 265.0))
CUTS = {  # teeth, helix °, operation, direction, radial depth, axial depth, feed mm, runout µm, its angle °
    "slot": (evenly_pitched(2), 45.0, "slot", "slot", 25.0, 3.0, 0.05, 0.0, 0.0),
    "down, runout": (evenly_pitched(4), 40.0, "side", "down", 4.0, 5.0, 0.06, 8.2, 127.0),
    "up, odd pitch": (ODD, 30.0, "side", "up", 8.0, 2.0, 0.03, 0.0, 0.0),
    "a tooth that cuts no chip": (evenly_pitched(3), 10.0, "slot", "slot", 25.0, 6.0, 0.02, 30.0, 300.0),
}


@pytest.mark.skipif(NODE is None, reason="node is not installed")
@pytest.mark.parametrize("name", CUTS)
def test_the_force_in_the_page_is_that_of_the_model(name):
    teeth, helix, operation, direction, radial, depth, feed, runout, towards = CUTS[name]
    radius, arc = 12.5, engagement(operation, direction, 1e-3 * radial, 12.5e-3)
    tool = {"radius": radius, "helix": math.radians(helix), "teeth": teeth, "coefficients": COEFFICIENTS}
    tool |= {"entry": arc.entry, "exit": arc.exit}
    asked = [tool, {"depth": depth, "feed": feed}, {"radius": 1e-3 * runout, "angle": math.radians(towards)}]
    call = f"{SCRIPT.read_text()}; console.log(JSON.stringify(cutForce(...{json.dumps(asked)})))"
    said = subprocess.run([NODE, "-e", call], capture_output=True, text=True, check=True)
    found = json.loads(said.stdout)
    cutter = Cutter(1e-3 * radius, math.radians(helix), teeth, 1e-6 * runout, math.radians(towards))
    si = np.array(COEFFICIENTS) * ([1e6] * 3 + [1e3] * 3)
    force = force_basis(cutter, EdgeLaw(), Cut(1e-3 * feed, 1e-3 * depth, arc), False) @ si
    there = np.column_stack([found[axis] for axis in "xyz"])
    largest = np.abs(force).max()
    apart = np.abs(there - force[::2])
    assert apart.max() < 0.02 * largest  # where an edge enters or leaves
    assert math.sqrt(float(np.mean(apart**2))) < 0.003 * largest
    assert there.mean(axis=0) == pytest.approx(force.mean(axis=0), abs=0.001 * largest)
    if not runout:  # the mean torque of a tool without runout has a formula (Altintas)
        chip = feed * (math.cos(arc.entry) - math.cos(arc.exit))
        around = COEFFICIENTS[0] * chip + COEFFICIENTS[3] * (arc.exit - arc.entry)
        expected = 1e-3 * radius * depth * around * len(teeth) / (2.0 * math.pi)
        assert found["torque"] == pytest.approx(expected, rel=0.002)


@pytest.mark.skipif(NODE is None, reason="node is not installed")
def test_the_interval_of_a_cut_is_that_of_drawn_coefficients_and_the_error_on_held_out_runs():
    rng = np.random.default_rng(1)
    root = rng.normal(size=(6, 6)) * np.array([20.0, 15.0, 10.0, 1.0, 1.0, 0.5])[:, None]
    parts = [
        {axis: rng.normal(size=5).tolist() for axis in "xyz"} | {"torque": rng.normal()} for _ in range(6)
    ]
    tool = {"coefficients": list(COEFFICIENTS), "covariance": (root @ root.T).tolist(), "error": 0.1}
    scripts = "".join(SCRIPT.with_name(name).read_text() for name in ("cutting.js", "trial.js"))
    call = f"{scripts}; console.log(JSON.stringify(composed(...{json.dumps([tool, parts])})))"
    found = json.loads(subprocess.run([NODE, "-e", call], capture_output=True, text=True, check=True).stdout)
    drawn = np.array(COEFFICIENTS) + rng.normal(size=(200_000, 6)) @ root.T
    basis = np.array([[part[axis] for axis in "xyz"] for part in parts])
    force = np.einsum("k,kai->ai", np.array(COEFFICIENTS), basis)
    error = 0.1 * math.sqrt(float(np.mean(force**2)))
    for i, axis in enumerate("xyz"):
        assert found["force"][axis] == pytest.approx(force[i])
        spread = np.hypot(np.std(drawn @ basis[:, i], axis=0), error)
        assert found["halves"][axis] == pytest.approx(1.96 * spread, rel=0.01)
    torques = np.array([part["torque"] for part in parts])
    torque = float(np.array(COEFFICIENTS) @ torques)
    spread = 1.96 * math.hypot(np.std(drawn @ torques), 0.1 * torque)
    assert found["torque"] == pytest.approx([torque, spread], rel=0.01)


def results_with_feeds():
    results = synthetic.results()
    runs = results.batch.runs.assign(feed_per_tooth_mm=0.05)
    return replace(results, batch=replace(results.batch, runs=runs))


def test_the_sliders_start_at_a_run_with_the_runout_that_was_found():
    made = trial_cut(results_with_feeds())
    starts = {slider["key"]: slider["value"] for slider in made["sliders"]}
    first = synthetic.results().batch.runs.iloc[0]
    assert (starts["depth"], starts["rpm"]) == (first["axial_depth_mm"], first["spindle_rpm"])
    assert starts["feed"] == 0.05
    assert starts["runout"] == pytest.approx(9.83, abs=0.06)
    assert made["tool"]["runout"] == pytest.approx(math.radians(41.2))
    assert made["tool"]["coefficients"][0] == pytest.approx(
        synthetic.identified()["force"]["waveform"]["ktc"]["value"]
    )
    for slider in made["sliders"]:
        assert slider["low"] <= slider["value"] <= slider["high"]


def test_a_cut_is_not_tried_where_its_force_cannot_be_computed():
    results = results_with_feeds()
    assert trial_cut(results) is not None
    assert trial_cut(replace(results, identified={})) is None
    wide = results.batch.runs.assign(operation="side", direction="up", radial_depth_mm=40.0)
    assert trial_cut(replace(results, batch=replace(results.batch, runs=wide))) is None
    tool = {**results.batch.manifest["tool"], "end": "ball"}
    ball = replace(results.batch, manifest={**results.batch.manifest, "tool": tool})
    assert trial_cut(replace(results, batch=ball)) is None


def test_quantities_to_compare_are_those_that_were_identified():
    found = {row["name"]: row for row in quantities(synthetic.results())}
    ktc = synthetic.identified()["force"]["waveform"]["ktc"]
    assert found["K_tc"]["value"] == ktc["value"]
    assert found["K_tc"]["half"] == pytest.approx(0.5 * (ktc["ci95"][1] - ktc["ci95"][0]))
    assert found["K_tc"]["text"].endswith(" N/mm²")
    assert "error on held-out runs: cutting force" in found
    assert quantities(replace(synthetic.results(), identified={}, verdict={}, loop={})) == []
