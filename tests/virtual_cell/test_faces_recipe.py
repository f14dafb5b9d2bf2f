"""Batches of faces that hide effects: what is drawn, what each effect changes, and what the files say."""

from __future__ import annotations

import hashlib
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import yaml

from virtual_cell.face_effects import FACE_EFFECTS, INSIDE, OUTSIDE, applied, pass_gains, pass_levels
from virtual_cell.recipes import faces
from virtual_cell.recipes.faces_draws import FACTORS, drawn, eight_cases

CELLS = {}


def cell(seed, style="b"):
    if (seed, style) not in CELLS:
        CELLS[seed, style] = drawn(np.random.default_rng([seed, 41]), style)
    return CELLS[seed, style]


def made(folder, hidden, seed=3, style="a"):
    """Make a batch whose programme is one face, at a coarse scan."""

    def small(_rng, _style):
        whole = cell(seed, style)
        first = replace(whole.cases[0], replicates=1)
        poses = {first.pose: whole.poses[first.pose]}
        scanner = replace(whole.scanner, spacing=3e-3)
        return replace(whole, cases=(first,), poses=poses, scanner=scanner, hammered=True)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(faces, "drawn", small)
        return faces.make(folder, hidden, seed, style)


def digests(folder):
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    folder = tmp_path_factory.mktemp("faces") / "one"
    made(folder, {})
    return folder


def test_the_seed_decides_all_bytes(clean, tmp_path):
    made(tmp_path / "one", {})
    assert digests(tmp_path / "one") == digests(clean)


@pytest.mark.parametrize("name", FACE_EFFECTS)
def test_an_effect_changes_the_scans_and_nothing_else(name, clean, tmp_path):
    truth = made(tmp_path / "one", {name: None})
    before, after = digests(clean), digests(tmp_path / "one")
    assert before.keys() == after.keys()
    assert {file for file in before if before[file] != after[file]} == {"scan/r01.ply"}
    assert list(truth["effects"]) == [name]
    assert all(np.isfinite(value) for value in truth["effects"][name].values())


def test_no_parameter_of_a_drawn_effect_is_lost():
    """Half a drawn effect is not the effect: every parameter changes the cell by itself."""
    whole, rng = cell(3), np.random.default_rng(8)
    for name, effect in FACE_EFFECTS.items():
        values = effect.draw(rng, whole)
        one = effect.apply(whole, values)
        for key, value in values.items():
            assert effect.apply(whole, {**values, key: 1.5 * value}) != one, (name, key)


def test_every_library_effect_of_faces_is_hidden_and_eight_others():
    shared = {"spindle_tilt", "thermal_growth", "fixture_bow", "path_vibration", "stiffness_scale"}
    assert set(INSIDE) == shared | {"entry_transient"}
    assert len(OUTSIDE) == 8
    with pytest.raises(KeyError, match="no_such_thing"):
        applied(cell(3), {"no_such_thing": None}, np.random.default_rng(0))


def test_cells_of_style_b_differ_in_plate_tool_programme_and_scanner():
    cells = [cell(seed) for seed in range(9)]
    for one in cells:
        x, y = one.size
        assert 0.09 < x < 0.31
        assert 0.055 < y < 0.16
        assert x * y / one.scanner.spacing**2 < 31_000
        assert 4 <= len(one.cases) <= 8
        assert {case.replicates for case in one.cases} <= {2, 3}
        assert {case.role for case in one.cases} == {"identify", "validate"}
        assert len({case.condition for case in one.cases}) == len(one.cases)
        assert round(x / one.milling.width, 6).is_integer()
        assert round(y / one.milling.width, 6).is_integer()
    assert len({one.size for one in cells}) == len(cells)
    assert len({one.milling.tool.radius for one in cells}) > 1
    assert {one.hammered for one in cells} == {True, False}
    assert cell(1, "a").size == cell(2, "a").size == (0.2, 0.1)


def test_load_tests_read_the_compliance_and_repeats_scatter_by_the_gauge(tmp_path):
    made(tmp_path / "one", {"stiffness_scale": {"factor": 0.5}})
    loads, whole = pd.read_csv(tmp_path / "one/loads.csv"), cell(3, "a")
    for pose, table in loads.groupby("pose"):
        matrix = whole.poses[pose].compliance(table[["x_mm", "y_mm"]].to_numpy() / 1e3)
        force = table[["fx_n", "fy_n", "fz_n"]].to_numpy(float)
        rest = table[["dx_mm", "dy_mm", "dz_mm"]].to_numpy() / 1e3 - np.einsum("nij,nj->ni", matrix, force)
        assert rest.std() == pytest.approx(2e-6, rel=0.2)
    assert set(loads.replicate) == {1, 2}


def test_a_hammer_finds_the_static_compliance_below_and_the_mass_far_above_the_modes(clean):
    pose = cell(3, "a").poses[cell(3, "a").cases[0].pose]
    at = np.array([0.1, 0.05])
    low, high = faces.receptance(pose, at, np.array([1e-4, 1e4]))
    np.testing.assert_allclose(low.real, pose.compliance(at[None])[0], rtol=1e-5, atol=1e-14)
    omega = 2e4 * np.pi
    stiff_and_lossy = pose.mass - 1j / omega * (
        pose.a0 * pose.mass + pose.a1 * np.linalg.inv(pose.compliance(at[None])[0])
    )
    np.testing.assert_allclose(-np.linalg.inv(high) / omega**2, stiff_and_lossy, rtol=1e-3, atol=0.1)
    impacts = pd.read_csv(clean / "impacts.csv")
    assert set(impacts.reference) == {"1x", "1y", "1z"}
    read = pd.read_csv(clean / impacts.file[2])
    true = faces.receptance(pose, at, read.frequency_hz.to_numpy())[:, 2, 2]
    off = np.abs(read.real + 1j * read.imag - true)
    assert 0.005 * np.abs(true).mean() < np.sqrt(np.mean(off**2)) < 0.02 * np.abs(true).mean()


def test_a_scan_is_of_the_face_that_the_declared_transform_places_over_the_plate(clean):
    manifest = yaml.safe_load((clean / "batch.yaml").read_text())
    raw = (clean / "scan/r01.ply").read_bytes()
    cloud = np.frombuffer(raw[raw.index(b"end_header\n") + 11 :], "<f4").reshape(-1, 3).astype(float)
    to_work = np.array(manifest["instruments"]["scanner"]["to_work"])
    work = cloud @ to_work[:3, :3].T + to_work[:3, 3]
    x, y, _ = manifest["work"]["size_mm"]
    np.testing.assert_allclose(work[:, :2].min(axis=0), 0.0, atol=3.0)
    np.testing.assert_allclose(work[:, :2].max(axis=0), [x, y], atol=3.0)
    assert np.abs(work[:, 2]).max() < 1.0
    assert work[:, 2].std() > 0.01


def test_passes_are_set_and_loaded_as_what_is_hidden_says():
    rng, count = np.random.default_rng(0), 10
    stepped = replace(cell(3), step=(0.4, 5e-6))
    np.testing.assert_allclose(pass_levels(stepped, count, rng), np.repeat([0.0, 5e-6], [4, 6]))
    missed = replace(cell(3), missed=(0.3, 20e-6))
    np.testing.assert_allclose(pass_levels(missed, count, rng), -20e-6 * (np.arange(count) == 3))
    np.testing.assert_allclose(pass_gains(missed, count, 2e-3), 1.0 + 0.01 * (np.arange(count) == 3))
    worn = pass_gains(replace(cell(3), wear=0.3), count, 2e-3)
    assert worn[0] == 1.0
    np.testing.assert_allclose(np.diff(worn), 0.3 / 9)
    walks = np.array([pass_levels(replace(cell(3), walk=4e-6), count, rng) for _ in range(500)])
    assert walks[:, -1].std() == pytest.approx(4e-6 * np.sqrt(count), rel=0.1)


def test_eight_cases_are_all_configurations_half_of_them_held_out_evenly():
    cases = eight_cases(3)
    assert {(c.wrist, c.location, c.orientation) for c in cases} == set(FACTORS)
    for level in ("wrist", "location", "orientation"):
        held = [getattr(c, level) for c in cases if c.role == "validate"]
        assert len(held) == 4
        assert all(held.count(value) == 2 for value in held)


def test_a_batch_of_style_b_passes_the_pipelines_check(tmp_path):
    check = pytest.importorskip("metro.batch.check", reason="the pipeline's check is not there")
    made(tmp_path / "one", {}, seed=4, style="b")
    report = check.check(tmp_path / "one", tmp_path)
    assert not [problem for problem in report.problems if "role" not in str(problem)]


def test_a_study_has_nine_faces_of_each_of_the_eight_configurations(tmp_path):
    """The scans are the whole of the work, and are left out here."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(faces, "_cut", lambda *_: np.zeros((1, 3)))
        truth = faces.make_study(tmp_path / "study", {}, 1)
    runs = pd.read_csv(tmp_path / "study/runs.csv")
    counts = runs.groupby(["wrist", "location", "orientation"]).size()
    assert len(runs) == 72
    assert set(counts) == {9}
    assert len(counts) == 8
    assert truth["effects"] == {}
    assert runs.groupby("condition").role.nunique().max() == 1
