"""A scan in the work frame: declared, by its sides, as it lies, or not at all."""

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from metro.batch.batch import Batch
from metro.observables.flatness.placing import place
from metro.observables.flatness.scan import measured_run

SIZE_MM = (100.0, 60.0, 30.0)
SIZE = np.array(SIZE_MM) * 1e-3
PITCH = 0.5e-3


def make_batch(size=SIZE_MM, **scanner):
    manifest = {"instruments": {"scanner": scanner}} | ({"work": {"size_mm": list(size)}} if size else {})
    return Batch("b", manifest, {}, pd.DataFrame(index=["r"]), {})


def face(rng):
    x, y = np.meshgrid(*(np.arange(PITCH / 2, side, PITCH) for side in SIZE[:2]))
    height = 60e-6 * np.sin(2 * np.pi * x / 0.04) + 10e-6 * rng.standard_normal(x.shape)
    return np.column_stack([x.ravel(), y.ravel(), height.ravel()])


def sides(rng):
    x, y = (np.arange(PITCH / 2, side, PITCH) for side in SIZE[:2])
    z = -np.arange(PITCH / 2, 0.02, PITCH)
    long = np.array([(a, 0.0, c) for a in x for c in z])
    short = np.array([(0.0, b, c) for b in y for c in z])
    return np.vstack([long, short]) + 10e-6 * rng.standard_normal((len(long) + len(short), 3))


def away(points):
    return Rotation.from_euler("zyx", [0.1, -0.05, 0.08]).apply(points) + np.array([0.2, -0.1, 0.4])


def path_table():
    x, y = np.meshgrid(np.arange(5.0, 96.0, 5.0), [10.0, 30.0, 50.0])
    number = np.repeat([1, 2, 3], x.shape[1])
    columns = {
        "point": np.arange(x.size) + 1,
        "pass": number,
        "x_mm": x.ravel(),
        "y_mm": y.ravel(),
        "z_mm": 0.0,
    }
    return pd.DataFrame(columns)


def test_side_faces_place_a_scan_and_are_taken_off_it():
    rng = np.random.default_rng(0)
    top = face(rng)
    placed = place(make_batch(), away(np.vstack([top, sides(rng)])), None)
    assert placed.method == "3-2-1"
    assert (placed.sd < 5e-6).all()
    inside = (top[:, :2] > 0.5e-3).all(axis=1)
    assert np.abs(placed.cloud[:][:, :2] - top[inside, :2]).max() < 10e-6
    assert placed.cloud[:][:, 2].min() > -1.1e-3
    assert "sides x-, y-" in placed.remark
    assert "points of side faces and edges are left out" in placed.remark


def test_a_face_placed_by_its_sides_has_its_own_heights_at_the_path_points():
    rng = np.random.default_rng(1)
    scan = away(np.vstack([face(rng), sides(rng)]))
    tables, reason = measured_run(make_batch(sigma_mm=0.01), "r", scan, path_table())
    assert reason is None
    assert tables["face_placed"]["method"].tolist() == ["3-2-1"]
    points = tables["face_points"]
    true = 0.06 * np.sin(2 * np.pi * points["x_mm"].to_numpy() / 40.0)
    design = np.column_stack([np.ones(len(points)), points[["x_mm", "y_mm"]]])
    rest = points["z_mm"].to_numpy() - true
    rest = rest - design @ np.linalg.lstsq(design, rest, rcond=None)[0]
    assert np.sqrt(np.mean(rest**2)) < 2.5e-3  # mm: 10 µm of noise over the 28 points of a disc is 1.9 µm
    index = tables["face_indices"].set_index("index_name")["value_um"]
    assert 110 < index["fltt"] < 150  # a sine of ±60 µm, not the 20 mm of the sides


def test_without_sides_a_scan_on_the_outline_is_taken_as_it_lies():
    top = face(np.random.default_rng(2))
    placed = place(make_batch(), top, None)
    assert placed.method == "outline"
    assert placed.cloud is top
    assert "within 0.25 mm" in placed.remark


def test_a_lone_face_elsewhere_has_indices_and_says_what_to_scan():
    top = away(face(np.random.default_rng(3)))
    tables, reason = measured_run(make_batch(sigma_mm=0.01), "r", top, path_table())
    assert "face_points" not in tables
    assert "face_indices" in tables
    assert "scan the top together with" in reason
    assert "half a pitch (250 um)" in reason


@pytest.mark.parametrize("with_sides", [True, False])
def test_a_declared_transform_is_kept_and_sides_are_still_taken_off(with_sides):
    rng = np.random.default_rng(4)
    top = face(rng)
    cloud = np.vstack([top, sides(rng)]) if with_sides else top
    placed = place(make_batch(to_work=np.eye(4).tolist()), cloud, None)
    assert placed.method == "to_work"
    inside = (top[:, :2] > 0.5e-3).all(axis=1) if with_sides else np.ones(len(top), dtype=bool)
    np.testing.assert_array_equal(placed.cloud[:], top[inside])
    assert ("left out" in placed.remark) == with_sides


def test_without_a_size_the_path_stands_for_the_outline():
    top = face(np.random.default_rng(5))
    path = np.array([[0.001, 0.002, 0.0], [0.099, 0.059, 0.0]])
    assert place(make_batch(size=None), top, path).method == "outline"
    assert place(make_batch(size=None), top + 0.01, path).method == ""
    assert "size_mm" in place(make_batch(size=None), top, None).remark
