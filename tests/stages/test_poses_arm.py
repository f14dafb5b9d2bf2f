"""A machining robot with a pose test: its calibrated arm takes the place of a wrong declared one."""

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from simulated_poses import TRACKER, frames

from metro.stages.identify import identify
from metro.stages.ingest import ingest

ROOT = Path(__file__).resolve().parents[2]
KR160 = ROOT / "data/raw/kr160-side"
WRONG = np.zeros((6, 4))  # rad, m
WRONG[1, 3], WRONG[2, 0], WRONG[3, 1] = 2e-3, 3e-3, 2e-3
DEGREES = (180 / np.pi, 180 / np.pi, 1e3, 1e3)


def batch(root, rows, poses=None):
    """Return a batch of the load tests and one cut of the KR160, its cell with these rows."""
    folder = root / "kr160-side"
    folder.mkdir(parents=True)
    for name in ("force", "robot", "profile", "batch.yaml", "loads.csv"):
        copy = shutil.copytree if (KR160 / name).is_dir() else shutil.copy
        copy(KR160 / name, folder / name)
    cell = yaml.safe_load((KR160 / "cell.yaml").read_text())
    cell["arm"]["dh"] = (rows * DEGREES).tolist()
    (folder / "cell.yaml").write_text(yaml.safe_dump(cell))
    runs = pd.read_csv(KR160 / "runs.csv", dtype=str).head(1)
    if poses is not None:
        poses.to_csv(folder / "tracker.csv", index=False)
        runs = pd.concat([runs, pd.DataFrame([{"run": "p1", "poses": "tracker.csv"}])])
    runs.to_csv(folder / "runs.csv", index=False)
    return folder


def tracked(rows, count=120):
    """Return poses of an arm of these rows, a point off its flange, under a tracker of 0.03 mm."""
    rng = np.random.default_rng(0)
    q = rng.uniform([-1, -2, 0.3, -2, -1.5, -2], [1, -0.5, 2, 2, 1.5, 2], (count, 6))
    last = [frames(rows, pose)[-1] for pose in q]
    at = np.array([TRACKER.apply(origin + turn.apply([0.09, -0.05, 0.11])) for turn, origin in last])
    at = at + rng.normal(0.0, 3e-5, at.shape)
    columns = [*(f"q{i}_deg" for i in range(1, 7)), "x_mm", "y_mm", "z_mm"]
    return pd.DataFrame(np.column_stack([np.rad2deg(q), at * 1e3]), columns=columns)


def identified(folder, root):
    settings = yaml.safe_load((ROOT / "config/config.yaml").read_text())["loop"]
    ingest(folder, root, root / "processed", {}, "c0de")
    identify(root / "processed", settings, "c0de")
    return json.loads((root / "processed/identified.json").read_text())


def test_a_pose_test_mends_what_a_wrong_geometry_does_to_the_stiffness_of_joints(tmp_path):
    """The load tests are of an arm of the true rows; with wrong ones the stiffness is wrong by a percent."""
    arm = yaml.safe_load((KR160 / "cell.yaml").read_text())["arm"]
    true = np.array(arm["dh"], dtype=float) / DEGREES
    calls = {"true": (true, None), "wrong": (true + WRONG, None), "mended": (true + WRONG, tracked(true))}
    stiffness = {}
    for name, (rows, poses) in calls.items():
        found = identified(batch(tmp_path / name, rows, poses), tmp_path / name)
        stiffness[name] = np.array([one["value"] for one in found["arm"]["joint_stiffness"]])
        assert found.get("pose", {}).get("p1", {}).get("serves", False) is (name == "mended")
    off = {name: np.max(np.abs(each / stiffness["true"] - 1)) for name, each in stiffness.items()}
    assert off["wrong"] > 5e-3
    assert off["mended"] < 5e-4
    assert stiffness["mended"] == pytest.approx(stiffness["true"], rel=5e-4)
