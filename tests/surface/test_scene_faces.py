"""Faces of scenes whose geometry is known, and what is no face."""

import os
from pathlib import Path

import numpy as np
import pytest

from metro.formats.gocator import read_gocator
from metro.formats.kinds import KINDS
from metro.surface.face import measure_face
from metro.surface.plane import fit_plane
from metro.surface.scene_faces import _goes_on, scene_of

ROOT = Path(__file__).resolve().parents[2]
FIELD = Path(os.environ.get("METRO_REAL_DATA", ROOT / "../shared/real")).parent / "field/scan-gocator"
NOISE = 0.02


def raster(length, width, pitch=1.0):
    x, y = np.meshgrid(np.arange(0.0, length, pitch), np.arange(0.0, width, pitch))
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])


def noisy(points):
    return points + np.random.default_rng(1).normal(0.0, NOISE, points.shape)


def test_a_part_on_its_table_is_two_faces_and_each_keeps_its_points_alone():
    table, part = raster(300, 200, 2.0) - np.array([100, 70, 30]), raster(100, 60)
    found = scene_of(noisy(np.vstack([table, part])), 1.0)
    assert [tuple(face.sides) for face in found.faces] == [
        pytest.approx((298, 198), abs=1.0),
        pytest.approx((99, 59), abs=1.0),
    ]
    cut = found.faces[1].cut(noisy(np.vstack([table, part])))
    assert len(cut) == len(part)
    assert np.abs(cut[:][:, 2]).max() < 6 * NOISE


def test_two_faces_in_one_plane_are_told_apart():
    found = scene_of(noisy(np.vstack([raster(100, 60), raster(80, 60) + np.array([300, 0, 0])])), 1.0)
    assert [round(face.share, 2) for face in found.faces] == [0.56, 0.44]


def test_a_cylinder_beside_a_face_is_no_face_and_the_reason_says_so():
    about = np.radians(np.linspace(-60, 60, 200))
    places = np.linspace(0, 100, 80)
    angle, along = (each.ravel() for each in np.meshgrid(about, places))
    cylinder = np.column_stack([along, 150 + 30 * np.sin(angle), 30 * np.cos(angle)])
    found = scene_of(noisy(np.vstack([raster(100, 100), cylinder])), 1.0)
    assert len(found.faces) == 1
    assert found.faces[0].sides == pytest.approx((99, 99), abs=1.0)
    assert "cuts through a curved or a tilted surface" in found.refused[0]


def test_a_slice_of_a_curved_surface_goes_on_beside_itself_and_a_face_at_the_foot_of_a_wall_does_not():
    """Asked of the slice itself: which plane the search finds first differs from call to call."""
    width = 0.2
    x, y = (c.ravel() for c in np.meshgrid(np.arange(0.0, 100.0), np.arange(-20.0, 20.0, 0.25)))
    curved = np.column_stack([x, y, y**2 / 60.0])
    slice_of_it = curved[curved[:, 2] <= 2 * width] - [0.0, 0.0, width]  # about a plane in mid-height
    assert _goes_on(curved - [0.0, 0.0, width], slice_of_it, fit_plane(slice_of_it), width, 8.0)
    face = noisy(raster(100, 100))
    height, along = (c.ravel() for c in np.meshgrid(np.arange(0.0, 30.0, 0.25), np.arange(0.0, 100.0, 0.25)))
    wall = np.column_stack([np.full(height.size, 100.0), along, height])
    assert not _goes_on(np.vstack([face, wall]), face, fit_plane(face), 6 * NOISE, 8.0)
    assert not _goes_on(face, face, fit_plane(face), 6 * NOISE, 8.0)


def test_points_at_one_place_are_no_scene():
    assert scene_of(np.tile([[1.0, 2.0, 3.0]], (50, 1)), 1.0).faces == ()


@pytest.mark.skipif(not FIELD.is_dir(), reason="the folder field beside METRO_REAL_DATA is absent")
def test_the_plane_of_a_structured_light_scan_has_the_noise_of_its_sensor():
    points = read_gocator(next(FIELD.glob("*.csv")), KINDS["cloud"], None).frame.to_numpy() * 1e-3
    (face,) = scene_of(points, 1e-3).faces
    measured = measure_face(face.cut(points), None, "", 2.5e-3, 1e-8)
    assert measured.sigma == pytest.approx(43e-6, rel=0.1)
