"""Joint batches: walls and faces of one arm; what is hidden acts in all of them, and the files say so."""

from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pytest
import yaml

from virtual_cell.arm import rotation_rpy
from virtual_cell.recipes import joint
from virtual_cell.recipes.arm_draws import drawn
from virtual_cell.recipes.joint import CASES, SHOWN
from virtual_cell.recipes.kr160 import ARM, NEAR_DEG
from virtual_cell.tip_compliance import tip_compliance

DEG = np.pi / 180.0
FORCE, MOVED = ["fx_n", "fy_n", "fz_n"], ["dx_mm", "dy_mm", "dz_mm"]


@cache
def one_wall(seed):
    """Return an arm, and a bench with one wall on its programme."""
    cell, bench = drawn(np.random.default_rng(seed), "a")
    return cell, replace(bench, plans=tuple(replace(plan, replicates=1) for plan in bench.plans[:1]))


def made(folder, hidden, seed=3):
    """Make a batch of one wall and one face, held out, at a coarse scan."""

    whole = joint.scanner_of
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(joint, "drawn", lambda *_: one_wall(seed))
        patch.setattr(joint, "CASES", (CASES[-2],))
        patch.setattr(joint, "scanner_of", lambda *given: replace(whole(*given), spacing=4e-3))
        return joint.make(folder, hidden, seed)


@pytest.fixture(scope="module")
def batches(tmp_path_factory):
    """Return batches of one seed by what they hide: folder and truth."""
    root = tmp_path_factory.mktemp("joint")
    asked = {
        "nothing": {},
        "softer": {"stiffness_scale": {"factor": 0.5, "joint": "all"}},
        "torn": {"stiffness_scale": {"factor": 1.25, "factor_of_faces": 0.8, "joint": "all"}},
        "runout": {"tool_runout": {"radius_um": 20.0, "angle_deg": 40.0}},
    }
    return {name: (root / name, made(root / name, hidden)) for name, hidden in asked.items()}


def last(batch):
    """The truth of the face, which is cut after the walls."""
    return list(batch[1]["runs"].values())[-1]


def test_one_arm_cuts_walls_and_faces_with_one_tool_in_one_cell(batches):
    folder, truth = batches["nothing"]
    runs = pd.read_csv(folder / "runs.csv")
    assert set(runs["operation"]) == {"side", "face"}
    assert runs["order"].tolist() == list(range(1, len(runs) + 1))
    assert set(runs["run"]) == set(truth["runs"])
    loads = pd.read_csv(folder / "loads.csv")
    assert set(runs["pose"]) <= set(loads["pose"])
    manifest = yaml.safe_load((folder / "batch.yaml").read_text())
    assert {"dynamometer", "robot_log", "profiler", "scanner"} == set(manifest["instruments"])
    assert "coefficients" not in manifest


def test_the_dynamometer_reads_the_force_that_the_truth_tells_of_a_face(batches):
    folder, _ = batches["nothing"]
    row = pd.read_csv(folder / "runs.csv").iloc[-1]
    sensor = yaml.safe_load((folder / "batch.yaml").read_text())["instruments"]["dynamometer"]
    rows = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    assert sensor["axes"] == {"x": "-y", "y": "-x", "z": "-z"}
    assert sensor["reads"] == "work"
    read = pd.read_parquet(folder / row["dynamometer"])[FORCE].to_numpy()
    count = len(read)
    mean = read[int(0.4 * count) : int(0.6 * count)].mean(axis=0) - read[:100].mean(axis=0)
    assert -rows.T @ mean == pytest.approx(last(batches["nothing"])["force_n"], abs=1.5)


def test_the_load_tests_of_a_face_show_what_a_force_moves(batches):
    folder, _ = batches["nothing"]
    loads = pd.read_csv(folder / "loads.csv")
    middle = loads[(loads["pose"] == "A1") & (loads["point"] == "P5")]
    slope = np.linalg.lstsq(middle[FORCE].to_numpy(), middle["dz_mm"].to_numpy(), rcond=None)[0]
    assert slope == pytest.approx(last(batches["nothing"])["mm_per_n"], abs=1.5e-5)


def test_a_softer_arm_gives_way_more_in_walls_and_faces_alike_and_not_in_the_load_tests(batches):
    plain, soft = (batches[name][1]["runs"] for name in ("nothing", "softer"))
    for run, told in plain.items():
        assert np.array(soft[run]["mm_per_n"]) == pytest.approx(2.0 * np.array(told["mm_per_n"]), rel=0.02)
    loads = [pd.read_csv(batches[name][0] / "loads.csv") for name in ("nothing", "softer")]
    assert loads[0][MOVED].to_numpy() == pytest.approx(loads[1][MOVED].to_numpy())


def test_a_stiffness_that_differs_acts_on_walls_and_faces_by_factors_of_its_own(batches):
    plain, torn = (batches[name][1]["runs"] for name in ("nothing", "torn"))
    *walls, face = plain
    share = {run: np.array(torn[run]["mm_per_n"]) / np.array(plain[run]["mm_per_n"]) for run in plain}
    assert share[face] == pytest.approx(1.0 / 0.8, rel=1e-6)
    for run in walls:
        assert share[run] == pytest.approx(1.0 / 1.25, rel=0.02)


def test_a_tool_that_runs_out_does_so_in_walls_and_faces(batches):
    for column in (0, -1):
        once = []
        for name in ("nothing", "runout"):
            row = pd.read_csv(batches[name][0] / "runs.csv").iloc[column]
            record = pd.read_parquet(batches[name][0] / row["dynamometer"])
            y = record["fy_n"].to_numpy()[len(record) // 3 : 2 * len(record) // 3]
            spectrum = np.abs(np.fft.rfft((y - y.mean()) * np.hanning(len(y)))) / len(y)
            hz = np.fft.rfftfreq(len(y), float(np.diff(record["t_s"].to_numpy(dtype=float)).mean()))
            once.append(spectrum[np.abs(hz - row["spindle_rpm"] / 60.0) < 2.0].max())
        assert once[1] > 5.0 * once[0]


def test_a_cause_that_is_not_known_is_refused(tmp_path):
    with pytest.raises(KeyError, match="haste"):
        made(tmp_path / "one", {"haste": None})
    assert "haste" not in SHOWN


def test_the_compliance_of_a_plate_is_along_its_own_axes():
    turn, near = rotation_rpy(0.0, 0.0, 190.0 * DEG), np.array(NEAR_DEG) * DEG
    origin = np.array([1.51, -0.21, 0.59])
    q = ARM.reach(origin + turn @ np.array([0.05, 0.04, 0.0]), turn, near)
    found = tip_compliance(ARM, origin, turn, (0.1, 0.08), near, turn=turn)(np.array([[0.05, 0.04]]))[0]
    for force in np.eye(3):
        assert found @ force == pytest.approx(turn.T @ ARM.yields(q, turn @ force), rel=1e-3, abs=1e-10)
