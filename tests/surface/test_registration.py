"""Where a scanned block lies: against motions that are known, and what must not be told."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from metro.surface.registration import register, see_block

SIZE = np.array([0.1, 0.06, 0.03])
PITCH, NOISE = 0.4e-3, 20e-6


def grid(width, height):
    u, v = np.meshgrid(np.arange(PITCH / 2, width, PITCH), np.arange(PITCH / 2, height, PITCH))
    return u.ravel(), v.ravel()


def block(sides, rng, depth=0.03, bow=0.0, size=SIZE):
    """A block's top and sides in the work frame, noise along the normal of each."""
    x, y = grid(size[0], size[1])
    form = bow * (2 * x / size[0] - 1) ** 2
    parts = [np.column_stack([x, y, form + NOISE * rng.standard_normal(x.size)])]
    for side in sides:
        axis = "xy".index(side[0])
        along, down = grid(size[1 - axis], depth)
        points = np.empty((along.size, 3))
        points[:, axis] = (size[axis] if side[1] == "+" else 0.0) + NOISE * rng.standard_normal(along.size)
        points[:, 1 - axis], points[:, 2] = along, -down
        parts.append(points)
    return np.vstack(parts)


def moved(points, rng, turn=0.2, far=0.5):
    rotation = Rotation.from_rotvec(rng.uniform(-turn, turn, 3) / np.sqrt(3))
    return rotation.apply(points) + rng.uniform(-far, far, 3)


def found(points, size=SIZE):
    return register(see_block(points, size), size)


def worst(registration, scanned, truth):
    """Largest error in x and in y over the corners of the top, by all its points (n of them come first)."""
    top = truth[:, 2] > -1e-3
    return np.abs(registration.apply(scanned) - truth)[top, :2].max()


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("sides", [("x-", "y-"), ("x+", "y-"), ("y+", "x-"), ("x-", "x+", "y-", "y+")])
def test_three_two_one_is_good_to_five_micrometres(sides, seed):
    rng = np.random.default_rng(seed)
    truth = block(sides, rng)
    scanned = moved(truth, rng)
    registration = found(scanned)
    assert registration.method == "3-2-1"
    assert worst(registration, scanned, truth) < 5e-6
    np.testing.assert_allclose(registration.rotation @ registration.rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(registration.rotation) == pytest.approx(1.0)


@pytest.mark.parametrize("size", [SIZE, SIZE[[1, 0, 2]]])
def test_the_longer_side_tells_the_direction_whichever_axis_it_runs_along(size):
    rng = np.random.default_rng(3)
    truth = block(("x-", "y-"), rng, size=size)
    short = int(size[1] > size[0])  # the face of this axis is the short one: sawn off square, it is not
    face = (truth[:, 2] < -1e-3) & (np.abs(truth[:, short]) < 1e-3)
    truth[face, short] += 0.01 * (truth[face, 1 - short] - size[1 - short] / 2)
    scanned = moved(truth, rng)
    error = np.abs(found(scanned, size).apply(scanned) - truth)[truth[:, 2] > -1e-3, 1 - short]
    assert error.max() < 5e-6


@pytest.mark.parametrize(("share", "depth"), [(1.0, 0.01), (0.4, 0.01), (0.4, 0.002)])
def test_the_uncertainty_is_that_of_repeats(share, depth):
    """Of whole sides, and of their first part, about which a turn moves the far corner; of strips, too."""
    errors, stated = [], []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        truth = block(("x-", "y-"), rng, depth=depth)
        near = (truth[:, :2] < share * SIZE[:2]).all(axis=1)
        truth = truth[near | (truth[:, 2] > -1e-3)]
        scanned = moved(truth, rng, turn=0.05)
        registration = found(scanned)
        corners = truth[:, 2] > -1e-3
        errors.append(np.abs(registration.apply(scanned) - truth)[corners, :2].max(axis=0))
        stated.append(registration.sd)
    ratio = np.sqrt(np.mean(np.square(errors), axis=0)) / np.mean(stated, axis=0)
    assert (ratio < 2.0).all()
    assert (ratio > 0.1).all()


@pytest.mark.parametrize(("long", "method"), [(1.0, "3-2-1"), (0.04, "box")])
def test_narrow_strips_of_sides_are_enough(long, method):
    rng = np.random.default_rng(0)
    truth = block(("x-", "y+"), rng, depth=0.002)
    truth = truth[(truth[:, 2] > -1e-3) | (np.abs(truth[:, 0] + truth[:, 1] - SIZE[1]) < long)]
    scanned = moved(truth, rng, turn=0.1)
    registration = found(scanned)
    assert registration.method == method
    # Where a strip ends before the far corner, its error there grows as the lever does.
    assert worst(registration, scanned, truth) < 15e-6 / min(long / SIZE[0], 1.0)
    assert registration.condition > 1e-6


@pytest.mark.parametrize("seed", range(5))
def test_two_rows_of_points_of_each_side_place_a_coarse_scan(seed):
    """A strip as deep as two or three pitches, within cells that hold points of the top as well."""
    rng = np.random.default_rng(seed)
    size, pitch, depth = np.array([0.168, 0.07, 0.01]), 1.24e-3, 3e-3
    top = rng.uniform(0.0, 1.0, (round(size[0] * size[1] / pitch**2), 3)) * size
    top[:, 2] = NOISE * rng.standard_normal(len(top))
    sides = []
    for axis in (0, 1):
        side = rng.uniform(0.0, 1.0, (round(size[1 - axis] * depth / pitch**2), 3)) * size
        side[:, axis] = NOISE * rng.standard_normal(len(side))
        side[:, 2] = -rng.uniform(0.3e-3, depth, len(side))
        sides.append(side)
    truth = np.vstack([top, *sides])
    scanned = moved(truth, rng, turn=0.2)
    registration = found(scanned, size)
    assert {"x-", "y-", "z+"} <= registration.faces.keys()
    assert worst(registration, scanned, truth) < 4 * max(10e-6, registration.sd.max())
    np.testing.assert_array_equal(
        see_block(scanned, size).on_top(scanned, 1e-3)[: len(top)].mean() > 0.97, True
    )


@pytest.mark.parametrize("sides", [(), ("y-",), ("y-", "y+"), ("x+",)])
def test_a_lone_face_and_sides_of_one_direction_are_refused_with_what_to_scan(sides):
    rng = np.random.default_rng(0)
    scanned = moved(block(sides, rng), rng)
    with pytest.raises(ValueError, match="scan the top together with") as caught:
        found(scanned)
    message = str(caught.value)
    assert "to_work" in message
    assert "condition 0" in message or "e-1" in message  # 1e-10 or less, not just below the gate
    if not sides:
        assert "half a pitch (200 um)" in message


def test_the_outline_of_a_lone_face_is_biased_by_half_a_pitch():
    """What the message says, for a raster that begins anywhere."""
    rng = np.random.default_rng(0)
    first = [(np.arange(-2, 300) + rng.uniform()) * PITCH for _ in range(500)]
    inside = [raster[(raster >= 0) & (raster <= SIZE[0])] for raster in first]
    assert np.mean([raster.min() for raster in inside]) == pytest.approx(PITCH / 2, rel=0.1)
    assert np.mean([SIZE[0] - raster.max() for raster in inside]) == pytest.approx(PITCH / 2, rel=0.1)


def test_a_waved_lone_face_is_not_taken_for_sides():
    rng = np.random.default_rng(2)
    scanned = moved(block((), rng, bow=300e-6), rng)
    with pytest.raises(ValueError, match="do not determine the place of the block"):
        found(scanned)


def test_a_few_patches_of_something_beside_a_lone_face_are_no_datum():
    rng = np.random.default_rng(7)
    along, down = grid(0.004, 0.004)
    wall = np.column_stack([along + 0.03, np.full(along.size, -0.0003), -down - 0.0005])
    truth = np.vstack([block((), rng), wall, wall[:, [1, 0, 2]]])
    assert {"x-", "y-"} <= see_block(truth, SIZE).faces.keys()
    with pytest.raises(ValueError, match="do not determine the place of the block"):
        found(moved(truth, rng, turn=0.02))


def test_a_scan_turned_by_a_right_angle_is_refused():
    rng = np.random.default_rng(1)
    turned = block(("x-", "y-"), rng) @ np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    with pytest.raises(ValueError, match="turn the scan") as caught:
        found(turned)
    assert "expected" not in str(caught.value)


def test_clamps_beside_the_block_and_burrs_on_its_edges_do_not_move_it():
    rng = np.random.default_rng(4)
    truth = block(("x-", "y-"), rng)
    along, down = grid(0.03, 0.015)
    clamp = np.column_stack([np.full(along.size, -0.008), along + 0.01, -down])
    edge = rng.uniform(0, SIZE[0], 3000)
    burr = np.column_stack([edge, rng.normal(0, 50e-6, 3000), np.abs(rng.normal(0, 100e-6, 3000))])
    truth = np.vstack([truth, clamp, burr])
    scanned = moved(truth, rng)
    assert worst(found(scanned), scanned, truth) < 10e-6


def test_points_of_the_sides_are_told_from_those_of_the_top():
    rng = np.random.default_rng(5)
    truth = block(("x-", "y-"), rng)
    scanned = moved(truth, rng)
    kept = see_block(scanned, SIZE).on_top(scanned, 1e-3)
    np.testing.assert_array_equal(kept, (truth[:, :2] > 0.5e-3).all(axis=1) & (truth[:, 2] > -1e-3))
    lone = truth[: len(grid(*SIZE[:2])[0])]
    assert see_block(lone, SIZE).on_top(lone, 1e-6).all()
