"""Targets to be corrected, as joints and as places of the tip, from their files to the tables."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from scipy.spatial.transform import Rotation
from simulated_poses import ROWS, drawn, measured
from test_poses_end_to_end import batch, checked, series

from metro.robot.kinematics import arm_of_cell
from metro.stages.identify import identify
from metro.stages.ingest import ingest

ROOT = Path(__file__).resolve().parents[2]
TOOL = [30.0, -20.0, 180.0]
WORK = {"xyz_mm": [400.0, 100.0, 50.0], "rpy_deg": [5.0, -10.0, 30.0]}
JOINTS, PLACE = [f"q{i}_deg" for i in range(1, 7)], ["x_mm", "y_mm", "z_mm", "rx_deg", "ry_deg", "rz_deg"]


def with_targets(root, tables):
    """Return a batch with a series of poses, and a run for each table of targets."""
    folder = batch(root, series())
    rows = ["run,poses,targets", "r01,tracker.csv,"]
    for name, table in tables.items():
        table.to_csv(folder / f"{name}.csv", index=False)
        rows.append(f"{name},,{name}.csv")
    (folder / "runs.csv").write_text("\n".join(rows) + "\n")
    with (folder / "batch.yaml").open("a") as stream:
        yaml.safe_dump({"tool_in_flange_mm": TOOL, "work_in_base": WORK}, stream)
    return folder


def declared():
    cell = {"arm": {"dh": (ROWS * (1, 1, 1e3, 1e3)).tolist()}}
    return arm_of_cell(cell, {"tool_in_flange_mm": TOOL, "work_in_base": WORK})


def places_of(q):
    arm = declared()
    angles = Rotation.from_matrix(arm.flange_axes(q)).as_euler("xyz", degrees=True)
    return np.hstack([1e3 * arm.tip(q), angles])


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """Return the joints that were asked for, and what is written of them."""
    root = tmp_path_factory.mktemp("targets")
    ends = drawn(2, seed=31)
    q = ends[0] + np.linspace(0.0, 1.0, 12)[:, None] * 0.5 * (ends[1] - ends[0])
    places = pd.DataFrame(places_of(q), columns=PLACE)
    far = places.copy()
    far.loc[3, "x_mm"] = 9000.0
    tables = {"joints": pd.DataFrame(np.rad2deg(q), columns=JOINTS), "places": places, "far": far}
    folder = with_targets(root, tables | {"level": places[PLACE[:3]]})
    ingest(folder, root, root / "processed", {}, "c0de")
    settings = yaml.safe_load((ROOT / "config/config.yaml").read_text())["loop"]
    identify(root / "processed", settings, "c0de")
    table = pd.read_parquet(root / "processed/pose_targets.parquet")
    block = json.loads((root / "processed/identified.json").read_text())["pose"]
    return q, {str(run): rows for run, rows in table.groupby("run")}, block


def test_places_are_corrected_to_the_joints_that_joint_targets_are(found):
    q, tables, block = found
    same = [*JOINTS, "before_mm", "after_mm"]
    start = tables["places"][[name.replace("_deg", "_target_deg") for name in JOINTS]].to_numpy()
    # The posture is that of the nearest measured pose; here it is that of the joints asked for.
    assert start == pytest.approx(np.rad2deg(q), abs=1e-4)
    assert tables["places"][same].to_numpy() == pytest.approx(tables["joints"][same].to_numpy(), abs=1e-4)
    assert block["r01"]["targets"]["places"]["before"] == block["r01"]["targets"]["joints"]["before"] | {
        "value": pytest.approx(block["r01"]["targets"]["joints"]["before"]["value"], abs=1e-4)
    }


def test_places_to_command_are_where_the_declared_arm_has_the_corrected_joints(found):
    q, tables, _ = found
    rows = tables["places"]
    commanded = places_of(np.deg2rad(rows[JOINTS].to_numpy()))
    assert rows[PLACE].to_numpy() == pytest.approx(commanded, abs=1e-6)
    asked = rows[[name.replace("_", "_target_") for name in PLACE]].to_numpy()
    assert asked == pytest.approx(places_of(q), abs=1e-4)
    assert np.abs(commanded - asked)[:, :3].max() > 0.1  # mm, which the longer link makes
    assert tables["joints"][PLACE].isna().all().all()


def test_the_true_arm_comes_to_where_the_nominal_one_has_the_tracked_point(found):
    """A wrong link 2, which the batch does not say; the base is that of the best fit to the tracker."""
    q, tables, _ = found
    errors = np.zeros((6, 4))
    errors[1, 3] = 8e-4
    own = np.deg2rad(tables["places"][JOINTS].to_numpy())
    before, after = measured(q, errors), measured(own, errors)
    # Where they are apart, by what the correction moves the point: as far as was predicted that they miss.
    moved = 1e3 * np.linalg.norm(after - before, axis=1)
    assert moved == pytest.approx(tables["places"]["before_mm"].to_numpy(), abs=0.03)


def test_without_angles_the_flange_stays_turned_as_in_the_nearest_pose(found):
    _, tables, _ = found
    asked = np.deg2rad(tables["level"][[name.replace("_deg", "_target_deg") for name in JOINTS]].to_numpy())
    turns = declared().flange_axes(asked)
    assert turns == pytest.approx(np.repeat(turns[:1], len(turns), axis=0), abs=1e-6)


def test_a_place_that_the_arm_does_not_reach_is_named(found):
    reason = found[2]["not_identified"]["targets of far"]
    assert reason.startswith("target 4: the declared arm comes to ")
    assert "check tool_in_flange_mm" in reason


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        (
            ["x_mm", "y_mm"],
            "lacks of targets: q1_deg, q2_deg, … of the joints, or x_mm, y_mm, z_mm of the tip",
        ),
        (["x_mm", "y_mm", "z_mm", "rx_deg"], "lacks of targets: ry_deg, rz_deg beside rx_deg"),
    ],
)
def test_half_a_place_is_refused(tmp_path, columns, words):
    folder = with_targets(tmp_path, {"places": pd.DataFrame([[1.0] * len(columns)], columns=columns)})
    said = checked(folder)
    assert said.exit_code == 1
    assert words in " ".join(said.output.replace("│", " ").split())
