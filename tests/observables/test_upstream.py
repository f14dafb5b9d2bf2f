"""The measured and the predicted force, put into walls and faces."""

import numpy as np
import pandas as pd
import pytest

from metro.observables.arm.tip_force import SYSTEMATIC
from metro.observables.cut.upstream import OFF, mean_forces, with_forces
from metro.observables.deformation.setting import CutWall
from metro.observables.flatness.face_setting import FaceSetting
from metro.observables.problem import Block

FORCES = {name: np.array([10.0, 20.0, 30.0]) * share for name, share in (("measured", 1.0), ("before", 1.2))}
ALONG = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])  # of the wall: rises and falls about its mean


def block(setting):
    return Block(
        run="w1", condition="c", role="validate", order=1, measured=np.zeros(2), sigma=np.ones(2),
        setting=setting, axis=np.full(2, "n"), zeros=np.zeros((2, 0)), zero_sd=np.zeros(0), coordinates={},
    )  # fmt: skip


def test_the_force_of_a_wall_is_changed_by_what_the_prediction_is_off_where_it_was_measured():
    wall = block(CutWall(*np.zeros((3, 2, 6)), ALONG, np.eye(3)[1], 1e-3, 1e-2, np.arange(2)))
    fed = with_forces(wall, FORCES, {"w1": "dynamometer"})
    assert fed["measured"].setting.force == pytest.approx(ALONG)
    assert fed["before"].setting.force == pytest.approx(ALONG + np.array([2.0, 4.0, 6.0]))
    assert with_forces(wall, FORCES, {"w1": "prediction"}) is None


def test_the_measured_force_is_off_by_a_share_of_the_whole_along_each_axis():
    wall = block(CutWall(*np.zeros((3, 2, 6)), ALONG, np.eye(3)[1], 1e-3, 1e-2, np.arange(2)))
    fed = with_forces(wall, FORCES, {"w1": "dynamometer"})
    off = SYSTEMATIC["dynamometer"] * np.linalg.norm(FORCES["measured"])
    moved = [fed[name].setting.force - fed["measured"].setting.force for name in OFF]
    assert np.array(moved) == pytest.approx(np.repeat(off * np.eye(3)[:, None], 2, axis=1))


def test_a_face_takes_the_mean_force_and_what_has_no_force_takes_none():
    face = FaceSetting(
        "P",
        *np.zeros((2, 3)),
        1.5e-3,
        np.zeros(1, int),
        None,
        None,
        (np.nan, np.nan),
        np.ones(3),
        np.ones(3),
        None,
    )
    fed = with_forces(block(face), FORCES, {})
    assert fed["before"].setting.force == pytest.approx([12.0, 24.0, 36.0])
    assert with_forces(block(3.0), FORCES, {}) is None


def test_rows_of_other_observables_have_no_part_in_the_mean_force():
    rows = pd.DataFrame(
        {"run": "a", "axis": [*"xyz"] * 2, "angle_deg": 0.0, "measured": [1.0, 2.0, 3.0, 9.0, 9.0, 9.0]}
    ).assign(observable=["force"] * 3 + ["joint_force"] * 3, before=0.0, after=0.0)
    assert mean_forces(rows)["a"]["measured"] == pytest.approx([1.0, 2.0, 3.0])
    assert mean_forces(rows[rows["axis"] != "z"]) == {}
