"""Advice before cutting: planned runs, predicted by brute force written here, and a bundled batch uncut."""

import math
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from fake_tables import FakeTables
from load_rows import load_table

from metro.batch.batch import Batch
from metro.batch.processed import COLUMNS, Processed, read_batch
from metro.loop.fitting.held_out import identified_fit
from metro.observables.cut import conditions as cutting_force
from metro.observables.flatness import observable as flatness
from metro.observables.flatness.advice import after_loop, planned_points, planned_runs
from metro.observables.flatness.repeats import cloud_of
from metro.observables.flatness.scan import measured_run
from metro.observables.flatness.study import study
from metro.observables.problem import Refusal
from metro.stages.identify import base_fit
from metro.surface.ranking import agreement, posterior_draws

ROOT = Path(__file__).resolve().parents[2]
SIMULATED = ROOT / "data/raw/irb6640-face"
SIZE = (120.0, 60.0)
RADIUS = 8.0
MANIFEST = {
    "format": 1,
    "tool": {"diameter_mm": 2 * RADIUS, "teeth": 4, "helix_deg": 30},
    "work": {"size_mm": [*SIZE, 10.0]},
    "coefficients": {"ktc_n_mm2": 900.0, "krc_n_mm2": 400.0, "kac_n_mm2": 460.0}
    | {"kte_n_mm": 16.0, "kre_n_mm": 20.0, "kae_n_mm": 22.0},
}
LANES = np.arange(5.0, SIZE[1], 10.0)


def compliance(x):
    """C (3, 3) mm/N at x mm, bent along x."""
    base = np.array([[2.9, 0.1, 0.7], [0.1, 1.4, -0.3], [0.7, -0.3, 1.2]]) * 1e-3
    return base + 5e-8 * (x - 40.0) ** 2 * np.array([[1.0, 0.1, 0.6], [0.1, 0.8, 0.2], [0.6, 0.2, 1.0]])


def path():
    s = np.arange(-10.0, SIZE[0] + 10.1, 2.0)
    way, lane = np.tile(s, len(LANES)), np.repeat(LANES, len(s))
    number = np.repeat(np.arange(1, len(LANES) + 1), len(s))
    return pd.DataFrame(
        {"point": np.arange(len(way)), "pass": number, "x_mm": way, "y_mm": lane, "z_mm": 0.0}
    )


def loads(noise=0.0):
    rng = np.random.default_rng(3)
    rows = []
    for number, (x, y) in enumerate(
        (x, y) for x in (5.0, 30.0, 60.0, 90.0, 115.0) for y in (5.0, 30.0, 55.0)
    ):
        for force in np.vstack([150 * np.eye(3), 250 * np.eye(3)]):
            moved = compliance(x) @ force + rng.normal(0, noise, 3)
            rows.append(["A", f"P{number}", x, y, 0.0, *force, *moved, 1])
    return load_table(rows)


def make_batch(depths=(1.0, 2.0), manifest=MANIFEST):
    rows = [
        {"run": f"p{i}", "role": "", "condition": f"d{depth:g}", "order": i, "operation": "face"}
        | {"direction": "down", "spindle_rpm": 12000.0, "feed_per_tooth_mm": 0.05, "axial_depth_mm": depth}
        | {"radial_depth_mm": 10.0, "feed_direction_deg": 0.0, "pose": "A", "scan": "", "path": "p.csv"}
        for i, depth in enumerate(depths)
    ]
    return Batch("plan", manifest, {"cell": "c"}, pd.DataFrame(rows).set_index("run"), {})


def reader(tests):
    def read(name, run=None):
        made = {"path": path, "loads": lambda: tests}
        return made[name]() if name in made else pd.DataFrame(columns=list(COLUMNS[name]))

    return FakeTables(read)


def advised(batch, tests, systematic=flatness.SYSTEMATIC):
    observed = flatness.observe(batch, reader(tests), {})
    task = flatness.problem(batch, observed, {})
    fit = None if isinstance(task, Refusal) else identified_fit(task, base_fit(task, 0.007))
    task = task if isinstance(task, Refusal) else replace(task, systematic=systematic)
    return flatness.report(batch, observed, {}, task, fit)["study"]


def brute_force_xm(batch, run):
    """Range of the lowest cut of the rim about the plane, at the points that a scan would be compared at."""
    force = cutting_force.mean_force_on_tool(batch, run, cutting_force.coefficients(batch, {}))
    start, end = -10.0, SIZE[0] + 10.0
    points = []
    for lane in LANES:
        for beside in (0.0, 10.0 / 3, -10.0 / 3):
            for x in np.arange(10.0, 110.1, 2.0):
                y, heights = lane + beside, []
                for other in LANES:
                    if abs(y - other) < RADIUS:
                        half = math.sqrt(RADIUS**2 - (y - other) ** 2)
                        at = [c for c in (x - half, x + half) if start <= c <= end]
                        heights += [(compliance(c) @ force)[2] for c in at]
                points.append((x, y, min(heights)))
    x, y, z = np.array(points).T
    basis = np.column_stack([np.ones_like(x), x, y])
    return 1e3 * np.ptp(z - basis @ np.linalg.lstsq(basis, z, rcond=None)[0])


def test_a_run_is_planned_where_it_has_a_path_and_nothing_that_a_cut_leaves():
    batch = make_batch((1.0, 2.0, 3.0, 4.0, 5.0))
    runs = batch.runs.assign(dynamometer=["", "f.csv", "", "", ""], stable=["", "", "yes", "", ""])
    runs.loc["p3", "scan"] = "s.ply"
    runs.loc["p4", "path"] = ""
    assert planned_runs(replace(batch, runs=runs)) == ["p0"]


def test_planned_points_are_those_of_the_path_on_the_work():
    table = planned_points(make_batch((1.0,)), reader(loads()))
    seen = table[table["coverage"] > 0]
    assert seen["x_mm"].between(1.5, SIZE[0] - 1.5).all()
    assert seen["y_mm"].between(1.5, SIZE[1] - 1.5).all()
    assert (~table["aside"]).sum() == len(path())
    assert table["aside"].sum() == 2 * len(path())
    assert table["z_mm"].notna().sum() == len(seen)


def test_the_predicted_range_is_that_of_the_lowest_cuts_of_the_rim():
    batch = make_batch()
    found = advised(batch, loads())["advice"]
    assert found["measured"] is False
    assert "Nothing was measured" in found["statement"]
    for row, run in zip(found["configurations"], ("p0", "p1"), strict=True):
        assert row["runs"] == [run]
        assert row["xm_predicted"]["value"] == pytest.approx(brute_force_xm(batch, run), rel=0.02)


def test_where_the_force_is_what_is_not_known_the_interval_is_its_share():
    row = advised(make_batch(), loads(), systematic=0.2)["advice"]["configurations"][0]["xm_predicted"]
    half = (row["ci95"][1] - row["ci95"][0]) / 2
    assert half == pytest.approx(1.96 * 0.2 * row["value"], rel=0.08)


def test_the_lighter_cut_is_the_better_one_whatever_the_common_force_is():
    rows = advised(make_batch(), loads())["advice"]["configurations"]
    assert [row["levels"] for row in rows] == [{"axial depth (mm)": "1"}, {"axial depth (mm)": "2"}]
    assert rows[0]["probability_best"] == 1.0
    assert rows[0]["xm_predicted"]["ci95"][1] < rows[1]["xm_predicted"]["ci95"][0]


def test_poor_load_tests_widen_the_interval():
    halves = []
    for noise in (0.002, 0.02):
        row = advised(make_batch((2.0,)), loads(noise))["advice"]["configurations"][0]["xm_predicted"]
        halves.append(row["ci95"][1] - row["ci95"][0])
    assert halves[1] > 3 * halves[0]


def test_the_compliance_of_loads_alone_is_as_sure_as_least_squares_makes_it():
    batch = make_batch()
    observed = flatness.observe(batch, reader(loads(0.002)), {})
    task = flatness.problem(batch, observed, {})
    fit = identified_fit(task, base_fit(task, 0.0))
    believed, block = task.blocks
    design = task.base.design(block, np.zeros(0))[0][:, len(believed.measured) :]
    values = np.linalg.lstsq(design, block.measured, rcond=None)[0]
    rest = block.measured - design @ values
    covariance = rest @ rest / (len(rest) - len(values)) * np.linalg.inv(design.T @ design)
    of_loads = slice(len(believed.measured), None)
    assert fit.beta[of_loads] == pytest.approx(values, rel=1e-3, abs=1e-9)
    assert np.diag(fit.covariance)[of_loads] == pytest.approx(np.diag(covariance), rel=0.25)


def test_repeats_of_one_condition_are_one_configuration():
    (row,) = advised(make_batch((2.0, 2.0)), loads())["advice"]["configurations"]
    assert row["runs"] == ["p0", "p1"]
    assert row["configuration"] == "d2"


@pytest.mark.parametrize(("lacking", "words"), [("coefficients", "coefficients"), ("tool", "tool")])
def test_what_lacks_for_advice_is_named(lacking, words):
    manifest = {key: value for key, value in MANIFEST.items() if key != lacking}
    assert words in advised(make_batch(manifest=manifest), loads())["not_identified"]["advice"]


def test_advice_without_load_tests_names_them():
    assert "loads.csv" in advised(make_batch(), loads().iloc[:0])["not_identified"]["advice"]


def test_errors_of_identified_coefficients_go_into_the_interval():
    batch = make_batch((2.0,), {key: value for key, value in MANIFEST.items() if key != "coefficients"})
    names = {"ktc": 900.0, "krc": 400.0, "kac": 460.0, "kte": 16.0, "kre": 20.0, "kae": 22.0}

    def width(share):
        block = {n: {"value": v, "ci95": [v * (1 - share), v * (1 + share)]} for n, v in names.items()}
        identified = {"force": {"waveform": block}}
        observed = flatness.observe(batch, reader(loads()), {})
        task = flatness.problem(batch, observed, identified)
        told = flatness.report(
            batch, observed, identified, task, identified_fit(task, base_fit(task, 0.007))
        )["study"]["advice"]
        low, high = told["configurations"][0]["xm_predicted"]["ci95"]
        return high - low

    assert width(0.8) == pytest.approx(2 * width(0.4), rel=0.1)


def test_only_the_rankings_of_a_report_with_effects_are_kept_beside_those_of_the_base_model():
    told = {"study": {"terms": [1], "ranking": [2], "agreement": {"alike": 1.0}}}
    assert after_loop(told) == {"study": {"after_loop": {"ranking": [2], "agreement": {"alike": 1.0}}}}
    assert after_loop({}) == {}


@pytest.mark.skipif(not SIMULATED.is_dir(), reason="data/raw/irb6640-face is not there")
def test_faces_that_were_not_cut_rank_as_they_do_when_they_are(tmp_path):
    """The simulator's scans are deleted: loads and mass alone rank the settings as its scans do."""
    from metro.stages.ingest import ingest

    plan = tmp_path / "face-planned"
    shutil.copytree(SIMULATED, plan, ignore=shutil.ignore_patterns("scan"))
    text = (plan / "batch.yaml").read_text().replace("batch: irb6640-face", "batch: face-planned")
    (plan / "batch.yaml").write_text(text)
    runs = pd.read_csv(plan / "runs.csv")
    runs.assign(scan="", role="").to_csv(plan / "runs.csv", index=False)
    for folder, name in ((SIMULATED, "cut"), (plan, "plan")):
        ingest(folder, ROOT / "config/cells", tmp_path / name, {}, "test")
    batch = read_batch(tmp_path / "plan")
    assert not (batch.runs["role"] != "").any()
    observed = flatness.observe(batch, Processed(tmp_path / "plan"), {})
    task = flatness.problem(batch, observed, {})
    rows = flatness.report(batch, observed, {}, task, identified_fit(task, base_fit(task, 0.007)))["study"][
        "advice"
    ]["configurations"]

    cut, none = read_batch(tmp_path / "cut"), pd.DataFrame(columns=list(COLUMNS["path"]))
    tables = [
        measured_run(cut, run, cloud_of(Processed(tmp_path / "cut"), run), none)[0]["face_indices"]
        for run in cut.runs.index
    ]
    measured = {row["configuration"]: row for row in study(cut, pd.concat(tables), {})["ranking"]}
    predicted = np.array([row["xm_predicted"]["value"] for row in rows])
    xm = np.log([measured[row["configuration"]]["xm"]["value"] for row in rows])
    high = np.log([measured[row["configuration"]]["xm"]["ci95"][1] for row in rows])
    draws = posterior_draws(xm, np.diag(((high - xm) / 2.447) ** 2), 6)
    found = agreement(predicted, xm, draws)
    assert found.sure_pairs > 8
    assert found.sure_alike == 1.0
    assert found.p_value < 0.05
    assert rows[0]["levels"]["orientation"] == "T"
