"""Batches of faces of the harder world: what the seed decides, what hidden causes change, what truth says."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest

from virtual_cell.blind import RECIPES
from virtual_cell.recipes import faces, faces_world
from virtual_cell.recipes.faces_world_draws import drawn
from virtual_cell.recipes.faces_world_programme import PROGRAMMES
from virtual_cell.world.faces import fixture
from virtual_cell.world.faces.causes import FACE_CAUSES, LIBRARY, applied
from virtual_cell.world.faces.troubles import TROUBLES

CELLS = {}


def cell(seed=5, style="c"):
    if (seed, style) not in CELLS:
        CELLS[seed, style] = drawn(np.random.default_rng([seed, 47]), style)
    return CELLS[seed, style]


def small(seed=5, style="c"):
    """Two faces of one configuration on a small plate, scanned coarsely."""
    whole = cell(seed, style)
    first = replace(whole.cases[0], replicates=2)
    width = whole.milling.width
    scanner = replace(whole.scanner, spacing=3e-3)
    poses = {first.pose: whole.poses[first.pose]}
    return replace(
        whole, cases=(first,), size=(5 * width, 4 * width), scanner=scanner, poses=poses, hammered=True
    )


def made(folder, hidden, seed=5, style="c"):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(faces_world, "drawn", lambda _rng, _style: small(seed, style))
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


@pytest.mark.parametrize("name", FACE_CAUSES)
def test_what_is_hidden_changes_scans_and_nothing_else(name, clean, tmp_path):
    values = FACE_CAUSES[name].draw(np.random.default_rng(4), small())
    values |= {"share": 1.0} if "share" in values else {}
    values |= {"per_min": 30.0} if "per_min" in values else {}
    truth = made(tmp_path / "one", {name: values})
    before, after = digests(clean), digests(tmp_path / "one")
    assert before.keys() == after.keys()
    changed = {file for file in before if before[file] != after[file]}
    assert changed
    assert changed <= {"scan/r01.ply", "scan/r02.ply"}
    assert truth["effects"] == {name: values}
    assert set(truth["translation_error"]) <= set(LIBRARY)
    assert set(values) == {word.split("=")[0] for word in RECIPES["flatness"].hides("c")[name].split()}
    json.dumps(truth)


def test_the_library_knows_the_effects_and_none_of_the_troubles():
    library = pytest.importorskip("metro.effects.library").library("flatness")
    assert set(LIBRARY) == {effect.name for effect in library if not effect.resembled}
    assert len(TROUBLES) >= 10
    assert not set(TROUBLES) & {effect.name for effect in library}


def test_a_tip_of_other_stiffness_has_the_factor_over_the_plate_in_least_squares():
    whole, rng = cell(), np.random.default_rng(6)
    session = faces_world.planned(whole, faces_world.ordered(whole, rng), rng)
    made_soft, _, errors = applied(whole, session, {"stiffness_scale": {"factor": 0.7}}, rng)
    at, tests, in_cut = fixture.grid(whole.size)[::60], [], []
    for pose, force in {
        f"{r.wrist}{r.location}": r.force(np.array([r.passes.length / 2]))[0] for r in session
    }.items():
        was, now = whole.poses[pose], made_soft.poses[pose]
        beside = was.tested(at) - was.in_tests(at)
        tests.append(was.tested(at)[:, 2] @ force)
        in_cut.append((now.in_cut(at) + beside)[:, 2] @ force)
    before, after = np.concatenate(tests), np.concatenate(in_cut)
    assert before @ before / (before @ after) == pytest.approx(0.7, rel=0.02)
    assert np.sqrt(np.mean((0.7 * after - before) ** 2) / np.mean(before**2)) == pytest.approx(
        errors["stiffness_scale"], abs=0.02
    )
    assert errors["stiffness_scale"] > 0.003


def test_a_face_is_cut_by_another_force_each_time_and_later_ones_by_a_blunter_tool():
    whole, rng = cell(), np.random.default_rng(7)
    order = [(whole.cases[0], i) for i in range(14)]
    steady = replace(whole, metal=replace(whole.metal, drift=0.0, other_bar=(0.0, 0.5), blunts=0.02))
    steady = replace(steady, depth_error=0.0)
    session = faces_world.planned(steady, order, rng)
    axial = np.array([one.force(np.array([one.passes.length / 2]))[0, 2] for one in session])
    slope, start = np.polyfit(np.arange(14), axial, 1)
    metres = len(session[0].passes.axes) * session[0].passes.length
    assert slope / start == pytest.approx(0.02 * metres * session[0].edge_share, rel=0.25)
    rest = axial - np.polyval([slope, start], np.arange(14))
    assert 0.5 * whole.metal.common < rest.std() / start < 3.0 * (whole.metal.common + whole.metal.own)
    assert all(b.started > a.started + a.duration for a, b in pairwise(session))


def test_the_styles_cut_other_programmes_in_other_orders():
    c, d = PROGRAMMES["c"], PROGRAMMES["d"]
    assert not set(c.cutters) & set(d.cutters)
    assert not set(c.feeds) & set(d.feeds)
    assert not set(c.rpm) & set(d.rpm)
    rng = np.random.default_rng(1)
    clumped = faces_world.ordered(replace(cell(), clumped=True), rng)
    names = [case.condition for case, _ in clumped]
    assert len({name for i, name in enumerate(names) if i == 0 or names[i - 1] != name}) == len(set(names))
    assert sum(a != b for a, b in pairwise(names)) == len(set(names)) - 1
    assert {case.role for case, _ in clumped} == {"identify", "validate"}


def test_what_is_declared_is_near_what_is_true_and_not_it():
    off, masses = [], []
    for seed in range(5):
        one = drawn(np.random.default_rng([seed, 47]), "d")
        true = one.milling.metal.ktc / 1e6
        off.append(one.milling.declared["ktc_n_mm2"] / true - 1.0)
        pose = next(iter(one.poses))
        masses.append(one.masses[pose][2, 2] / one.poses[pose].mass[2, 2] - 1.0)
    for errors in (np.array(off), np.array(masses)):
        assert 0.003 < np.abs(errors).mean() < 0.1


@pytest.mark.parametrize(("seed", "style"), [(3, "c"), (4, "d")])
def test_a_batch_passes_the_pipelines_check(seed, style, tmp_path):
    check = pytest.importorskip("metro.batch.check", reason="the pipeline's check is not there")
    made(tmp_path / "one", {}, seed, style)
    report = check.check(tmp_path / "one", tmp_path)
    assert not [
        problem for problem in report.problems if problem.level == "error" and "role" not in str(problem)
    ]


def test_the_truth_says_what_the_world_was(clean, tmp_path):
    truth = made(tmp_path / "one", {"spindle_tilt": None})
    world = truth["world"]
    assert set(world) == {"scanner", "load_tests", "arm", "metal", "cutting", "setup"}
    tilts = np.mean(list(world["setup"]["tilt_urad_by_wrist"].values()), axis=0) / 1e3
    asked = truth["effects"]["spindle_tilt"]
    np.testing.assert_allclose(tilts, [asked["about_x_mrad"], asked["about_y_mrad"]], atol=1e-3)
    loads = pd.read_csv(clean / "loads.csv")
    assert loads.groupby(["pose", "point"]).ngroups >= 9


def test_a_study_is_not_made_in_the_harder_world(tmp_path):
    with pytest.raises(ValueError, match="styles a and b"):
        faces.make_study(tmp_path / "study", {}, 1, "c")


def test_the_run_table_says_how_long_returns_take(clean):
    """With the way of the path file it gives the period of the passes to the hundredth of a second."""
    one = small()
    rng = np.random.default_rng([5, 47])
    runs = pd.read_csv(clean / "runs.csv")
    path = pd.read_csv(clean / runs.path[0])
    first = path[path["pass"] == 1]
    way = np.hypot(np.ptp(first.x_mm), np.ptp(first.y_mm)) / 1e3
    session = faces_world.planned(one, faces_world.ordered(one, rng), rng)
    for run, back in zip(session, runs.return_s, strict=True):
        assert way / run.passes.speed + back == pytest.approx(np.diff(run.begun).mean(), abs=0.006)
        assert back > way / 0.2 + 0.55
