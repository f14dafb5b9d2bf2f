"""Clouds in slices: what is spooled, changed, drawn and sampled piece by piece is what it is in one piece."""

import tracemalloc

import numpy as np
import pytest

from metro.surface import points as room
from metro.surface.face import measure_face
from metro.surface.footprint import Window, sample
from metro.surface.plane import fit_plane
from metro.surface.points import Spool, box, changed, drawn

CLOUD = np.random.default_rng(3).normal(size=(1000, 3))


def pieces(cloud, *cuts):
    return (each for each in np.split(cloud, cuts))


@pytest.mark.parametrize("in_memory", [10, 10_000])
def test_a_spooled_cloud_is_read_as_it_was_written(monkeypatch, in_memory):
    monkeypatch.setattr(room, "IN_MEMORY", in_memory)
    spool = Spool(pieces(CLOUD, 1, 400, 400))
    assert len(spool) == 1000
    for rows in (slice(None), slice(390, 410), slice(998, 2000), slice(5, 5)):
        np.testing.assert_array_equal(spool[rows], CLOUD[rows])


def test_points_are_moved_and_left_out_slice_by_slice(monkeypatch):
    monkeypatch.setattr(room, "CHUNK", 64)
    found = changed(Spool([CLOUD]), lambda each: 2.0 * each[each[:, 2] > 0.0])
    np.testing.assert_array_equal(found[:], 2.0 * CLOUD[CLOUD[:, 2] > 0.0])
    np.testing.assert_array_equal(box(found), [found[:].min(axis=0), found[:].max(axis=0)])
    assert np.isinf(box(Spool([]))).all()


def test_of_a_large_cloud_so_many_points_are_drawn_each_once(monkeypatch):
    monkeypatch.setattr(room, "CHUNK", 64)
    np.testing.assert_array_equal(drawn(CLOUD, 1000), CLOUD)
    found = drawn(Spool([CLOUD]), 300)
    assert len(np.unique(found[:, 0])) == 300
    assert np.isin(found[:, 0], CLOUD[:, 0]).all()
    np.testing.assert_array_equal(found, drawn(CLOUD, 300))


def test_a_face_and_its_footprints_do_not_depend_on_the_slices(monkeypatch):
    rng = np.random.default_rng(4)
    x, y = (c.ravel() for c in np.meshgrid(np.arange(0, 0.06, 2e-4), np.arange(0, 0.04, 2e-4)))
    cloud = np.column_stack([x, y, 5.0 + 0.01 * x + 3e-5 * np.sin(200 * x) + rng.normal(0, 1e-5, x.size)])
    at, gone = (
        rng.uniform(0.0, [[0.06], [0.04]], (2, 200)),
        np.array([0, 700, 701, *range(30_000, 33_000, 7)]),
    )
    whole, seen = measure_face(cloud), sample(np.delete(cloud, gone, axis=0), *at)
    monkeypatch.setattr(room, "CHUNK", 1000)
    monkeypatch.setattr(room, "IN_MEMORY", 500)
    spool = Spool(pieces(cloud, 11, 20_000))
    for name, index in measure_face(spool).indices.items():
        assert index.value == pytest.approx(whole.indices[name].value, rel=1e-9), name
    found = sample(spool, *at, without=gone)
    np.testing.assert_array_equal(found.count, seen.count)
    np.testing.assert_array_equal(found.coverage, seen.coverage)
    np.testing.assert_allclose(found.height, seen.height, rtol=1e-14)
    np.testing.assert_allclose(found.sd, seen.sd, rtol=1e-6)


def lattice(across, along, tilt, random):
    """A scan on a lattice of 0.2 mm: every 25th row lies on the border of two cells of the filter's grid."""
    heights = random.normal(0, 1e-5, (along, across))
    if not tilt:  # heights that leave the plane level to the last digit, whatever the noise
        heights = heights + heights[::-1] + heights[:, ::-1] + heights[::-1, ::-1]
    x, y = np.meshgrid(2e-4 * np.arange(across), 2e-4 * np.arange(along))
    return np.column_stack([x.ravel(), y.ravel(), (heights + tilt * x).ravel()])


@pytest.mark.parametrize("shift", [0.0, 0.3])
@pytest.mark.parametrize("tilt", [0.0, 0.01])
@pytest.mark.parametrize("sides", [(300, 200), (301, 201), (251, 251), (200, 300)])
def test_rounding_moves_no_index_of_a_face(sides, tilt, shift):
    random = np.random.default_rng(11)
    cloud = lattice(*sides, tilt, random) + np.array([shift, shift, 5 * shift])
    whole = measure_face(cloud, uncertainty=False)
    rounded = [cloud * (1 + 2.3e-16 * random.integers(-1, 2, cloud.shape)) for _ in range(3)]
    for other in (*rounded, cloud[random.permutation(len(cloud))], cloud[::-1]):
        again = measure_face(other, uncertainty=False)
        assert again.points == whole.points
        for name, index in again.indices.items():
            assert index.value == pytest.approx(whole.indices[name].value, rel=1e-7), name


def test_the_axes_of_a_plane_do_not_turn_with_rounding():
    random = np.random.default_rng(12)
    face = random.uniform(-1, 1, (400, 3)) * [0.05, 0.03, 1e-5]
    for turn in (np.eye(3), np.roll(np.eye(3), 1, axis=0), np.roll(np.eye(3), 2, axis=0)):
        for points in (face @ turn, (face * [1.0, 5 / 3, 1.0]) @ turn):
            plane, again = fit_plane(points), fit_plane(points[random.permutation(len(points))])
            np.testing.assert_allclose(again.axes, plane.axes, atol=1e-9)
            frame = np.vstack([plane.axes, plane.normal])
            np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
            assert np.linalg.det(frame) == pytest.approx(1.0)
            assert np.ptp(plane.coordinates(points)[:, 0]) > 0.99 * np.ptp(plane.coordinates(points)[:, 1])


class Made:
    """A flat face with noise, of which no point is kept."""

    def __init__(self, side):
        self._side = side

    def __len__(self):
        return 2 * self._side**2

    def __getitem__(self, rows):
        first, last, _ = rows.indices(len(self))
        place = np.arange(first, last)
        x, y = np.divmod(place, self._side)
        noise = np.random.default_rng(first).normal(0, 1e-5, len(place))
        return np.column_stack([0.05 * x / self._side, 0.05 * y / self._side, noise])


def test_a_face_takes_no_memory_in_proportion_to_its_points():
    sides, peaks = (700, 1400), []
    for side in sides:
        tracemalloc.start()
        measure_face(Made(side), 1e-5, "known", uncertainty=False)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    more = len(Made(sides[1])) - len(Made(sides[0]))
    assert (peaks[1] - peaks[0]) / more < 8.0  # bytes; suspects and tails take some 3, a whole slice 32


def test_the_deviation_in_a_disc_is_that_of_a_fit_of_one_slope_after_the_other():
    rng = np.random.default_rng(5)
    points = rng.uniform(-1.0, 1.0, (400, 3)) * [1.0, 1.0, 0.01] + [0.0, 0.0, 7.0]
    points[:, 2] += 0.2 * points[:, 0] - 0.1 * points[:, 1]
    inside = points[np.hypot(*points[:, :2].T) <= 1.0]
    rest = inside[:, 2] - inside[:, 2].mean()
    for across in inside[:, :2].T:
        centred = across - across.mean()
        rest = rest - (centred @ rest) / (centred @ centred) * centred
    found = sample(points, np.zeros(1), np.zeros(1), Window(1.0, 1.0))
    assert found.sd[0] == pytest.approx(np.sqrt(rest @ rest / (len(inside) - 3)), rel=1e-9)
