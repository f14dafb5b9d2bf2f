"""Planes, groups, outliers and poses in clouds that were built with them."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from metro.surface.scene import clusters_of, outliers_of, planes_of, register_clouds

NOISE = 0.01


def face(rng, count, sides, axes, corner=(0, 0, 0)):
    """Points on a rectangle along two ``axes`` (rows of a frame), with noise across it."""
    frame = np.eye(3)[list(axes)]
    across = np.cross(*frame)
    at = rng.uniform(0, sides, (count, 2))
    return np.array(corner, float) + at @ frame + rng.normal(0, NOISE, (count, 1)) * across


def block(seed=0, clutter=0):
    """The top 100 × 60, the front 100 × 30 and the side 60 × 30 of a block, and points at random about it."""
    rng = np.random.default_rng(seed)
    faces = [
        face(rng, 6000, (100, 60), (0, 1)),
        face(rng, 3000, (100, 30), (0, 2), (0, 0, -30)),
        face(rng, 1800, (60, 30), (1, 2), (0, 0, -30)),
    ]
    return np.vstack([*faces, rng.uniform([-50, -50, -80], [150, 110, 50], (clutter, 3))]), rng


def turn(axis, angle):
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


@pytest.mark.parametrize("clutter", [0, 2000])
def test_the_faces_of_a_block_are_found_with_their_sides_normals_and_points(clutter):
    points, _ = block(clutter=clutter)
    planes = planes_of(points, 5 * NOISE)
    assert len(planes) == 3
    for seen, normal, sides, count, start in zip(
        planes,
        np.eye(3)[[2, 1, 0]],
        ([100, 60], [100, 30], [60, 30]),
        (6000, 3000, 1800),
        (0, 6000, 9000),
        strict=True,
    ):
        assert np.abs(seen.plane.normal) == pytest.approx(normal, abs=1e-3)
        # points of the clutter that happen to lie on a plane lengthen it
        assert seen.sides == pytest.approx(sides, abs=0.5 if not clutter else 60)
        own = np.isin(np.arange(start, start + count), seen.members)
        assert own.mean() > 0.99
        assert seen.rms == pytest.approx(NOISE, rel=0.05 if not clutter else 0.2)


def test_a_plane_is_found_in_any_frame_and_unit():
    points, _ = block()
    rotation = turn([1, 2, 3], 0.9)
    for scale in (1.0, 1e-3):
        moved = scale * (points @ rotation.T + [500.0, -300.0, 80.0])
        planes = planes_of(moved, scale * 5 * NOISE)
        assert [len(seen.members) for seen in planes] == pytest.approx([6000, 3000, 1800], rel=0.01)
        assert np.abs(planes[0].plane.normal @ rotation[:, 2]) == pytest.approx(1.0, abs=1e-6)


def test_points_at_random_have_no_plane_nor_have_those_on_a_line():
    rng = np.random.default_rng(1)
    assert planes_of(rng.uniform(0, 100, (3000, 3)), 0.5, least_share=0.1) == []
    line = np.outer(np.linspace(0, 1, 500), [100.0, 20.0, 5.0])
    assert planes_of(line, 0.5) == []
    assert planes_of(np.zeros((2, 3)), 0.5) == []


def test_only_as_many_planes_as_asked_for_and_none_below_the_share():
    points, _ = block()
    assert len(planes_of(points, 5 * NOISE, most=1)) == 1
    assert len(planes_of(points, 5 * NOISE, least_share=0.2)) == 2


def test_the_same_cloud_gives_the_same_planes_in_another_process():
    planes = "[(len(p.members), p.plane.normal.tolist()) for p in planes_of(block(clutter=4000)[0], 0.05)]"
    path = f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})"
    script = f"{path}; from test_scene import block, planes_of; print({planes})"
    there = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    here = [(len(p.members), p.plane.normal.tolist()) for p in planes_of(block(clutter=4000)[0], 0.05)]
    assert there == f"{here}\n"


def test_groups_apart_are_numbered_by_their_size():
    rng = np.random.default_rng(2)
    sizes, corners = (300, 2000, 700), ([0, 0, 0], [200, 0, 0], [0, 300, 50])
    points = np.vstack(
        [rng.uniform(0, 20, (n, 3)) + corner for n, corner in zip(sizes, corners, strict=True)]
    )
    points = np.vstack([points, [[900.0, 900.0, 900.0]]])
    label = clusters_of(points, 10.0)
    np.testing.assert_array_equal(label, np.repeat([2, 0, 1, -1], [*sizes, 1]))
    assert set(clusters_of(points, 3000.0)) == {0}
    assert set(clusters_of(points[-1:], 1.0)) == {-1}


def test_points_far_from_their_neighbours_are_outliers_and_others_are_not():
    points, rng = block()
    wild = rng.uniform([-100, -100, 100], [200, 200, 300], (40, 3))
    mask = outliers_of(np.vstack([points, wild]))
    assert mask[len(points) :].all()
    assert mask[: len(points)].mean() < 0.001


@pytest.mark.parametrize("angle", [0.0, 0.05])
def test_a_cloud_is_moved_back_onto_the_surfaces_it_was_taken_from(angle):
    """Another sample of the same block, displaced: the pose is known to the noise over √n."""
    fixed, _ = block(3)
    other, _ = block(4)
    rotation, shift = turn([1, -1, 2], angle), np.array([0.8, -0.5, 0.6])
    pose = register_clouds((other - shift) @ rotation, fixed, 5.0)
    assert pose.rotation == pytest.approx(rotation, abs=2e-4)
    assert pose.shift == pytest.approx(shift, abs=1e-2)
    np.testing.assert_allclose(pose.apply((other - shift) @ rotation), other, atol=0.02)
    assert pose.share > 0.99
    assert pose.spread < 2 * NOISE


def test_a_cloud_far_away_needs_a_pose_to_start_from():
    fixed, _ = block(5)
    rotation, shift = turn([0, 0, 1], 1.2), np.array([400.0, -100.0, 30.0])
    away = (fixed - shift) @ rotation
    with pytest.raises(ValueError, match="0 points of the clouds come within 5 of each other"):
        register_clouds(away, fixed, 5.0)
    near = turn([1, 0, 0], 0.02) @ rotation, shift + np.array([0.5, -0.5, 0.3])
    pose = register_clouds(away, fixed, 5.0, near)
    assert pose.rotation == pytest.approx(rotation, abs=2e-4)


def test_a_lone_plane_slides_and_is_refused():
    points, _ = block(6)
    with pytest.raises(ValueError, match="do not determine the pose"):
        register_clouds(points[:6000], points[:6000] + np.array([0.0, 0.0, 0.2]), 5.0)
