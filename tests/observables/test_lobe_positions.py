"""Modes at the positions where they were measured, and between these."""

import numpy as np
import pandas as pd
import pytest

from metro.batch.batch import Batch
from metro.dynamics.system import Structure
from metro.observables.stability.positions import Tip, from_others, pairs, places, tips

WHERE = {
    "1": np.array([0.0, 0.0, 0.0]),
    "2": np.array([0.4, 0.0, 0.0]),
    "3": np.array([0.0, 0.3, 0.0]),
    "4": np.array([0.0, 0.0, 0.2]),
    "in": np.array([0.1, 0.1, 0.05]),
    "far": np.array([3.0, 0.0, 0.0]),
}
GRADIENT = np.array([0.3, -0.2, 0.5])


def tip(position, bend=0.0, where=WHERE):
    """One mode in x and one in y whose logarithms are linear over the workspace (but for ``bend``)."""
    change = float(np.exp(where[position.split("/")[0]] @ GRADIENT + bend))
    omega = 2 * np.pi * np.array([40.0, 60.0]) * change
    structure = Structure(np.array([0, 1]), omega, np.array([0.05, 0.04]) / change, np.array([4e6, 6e6]))
    return Tip(position, structure, ("x1", "y1"), np.full(6, 0.01))


def batch(poses):
    runs = pd.DataFrame(
        {"axial_depth_mm": 1.0, "spindle_rpm": 900.0, "pose": poses},
        index=pd.Index([f"r{i}" for i in range(len(poses))], name="run"),
    )
    return Batch("b", {}, {}, runs, {})


def test_modes_are_numbered_by_frequency_in_each_direction():
    rows = pd.DataFrame(
        {"position": "1", "direction": ["y", "x", "x"], "frequency_hz": [50.0, 70.0, 40.0],
         "frequency_sd_hz": 0.1, "damping": 0.05, "damping_sd": 0.001, "stiffness_n_m": [6e6, 5e6, 4e6],
         "stiffness_sd": 1e5, "used": True}
    )  # fmt: skip
    found = tips(rows, [])[0]
    assert found.names == ("x1", "x2", "y1")
    np.testing.assert_allclose(found.structure.omega / 2 / np.pi, [40.0, 70.0, 50.0])
    np.testing.assert_allclose(found.structure.stiffness, [4e6, 5e6, 6e6])
    np.testing.assert_allclose(found.sd[:3], [0.1 / 40, 0.1 / 70, 0.1 / 50])


def test_between_stations_log_linear_modes_are_told_exactly():
    measured = [tip(name) for name in "1234"]
    told, true = from_others("in", measured, WHERE), tip("in")
    assert told.interpolated
    np.testing.assert_allclose(told.structure.omega, true.structure.omega, rtol=1e-9)
    np.testing.assert_allclose(told.structure.zeta, true.structure.zeta, rtol=1e-9)


def test_what_the_stations_do_not_tell_of_each_other_widens_the_interval():
    line = {name: np.array([x, 0.0, 0.0]) for name, x in (("1", 0.0), ("2", 0.4), ("3", 0.2), ("in", 0.1))}
    plain = from_others("in", [tip(name, 0.0, line) for name in "123"], line)
    bent = from_others("in", [tip(name, 0.1 * (name == "3"), line) for name in "123"], line)
    assert np.all(bent.sd[:4] > plain.sd[:4] + 0.02)


@pytest.mark.parametrize("where", ["far", "nowhere"])
def test_outside_the_stations_nothing_is_told(where):
    assert from_others(where, [tip(name) for name in "1234"], WHERE) is None


def test_stations_with_other_numbers_of_modes_tell_nothing():
    odd = Tip("2", tip("2").structure.mode(0), ("x1",), np.full(3, 0.01))
    assert from_others("in", [tip("1"), odd, tip("3")], WHERE) is None


def test_one_structure_serves_every_pose():
    notes = []
    [(runs, used)] = pairs(batch(["1", "2"]), [tip("1")], WHERE, notes)
    assert len(runs) == 2
    assert not used.interpolated
    assert "used at pose 2 too" in notes[0]


def test_poses_between_stations_get_interpolated_modes_and_others_are_named():
    notes = []
    found = pairs(batch(["1", "in", "far"]), [tip(name) for name in "1234"], WHERE, notes)
    assert [(one.position, one.interpolated, len(runs)) for runs, one in found] == [
        ("1", False, 1),
        ("in", True, 1),
    ]
    assert any("interpolated between the stations" in note for note in notes)
    assert any("no modes at pose far" in note for note in notes)


def test_places_are_in_metres():
    table = pd.DataFrame({"position": [1], "x_mm": [100.0], "y_mm": [-20.0], "z_mm": [5.0]})
    np.testing.assert_allclose(places(table)["1"], [0.1, -0.02, 0.005])
