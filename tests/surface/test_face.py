"""A whole face from its cloud: indices with and without noise, outliers, edges, contact points."""

import numpy as np
import pytest

from metro.surface.face import measure_face
from metro.units import MM, UM

SIGMA = 19 * UM


def dome(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return 60 * UM * np.cos(2 * np.pi * x / 0.15) * np.cos(np.pi * y / 0.08)


def cloud(sigma: float, seed: int = 0, pitch: float = 0.4 * MM, size: tuple = (0.15, 0.08)) -> np.ndarray:
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(*(np.arange(pitch / 2, extent, pitch) for extent in size))
    x, y = (c.ravel() + rng.uniform(-0.1, 0.1, c.size) * pitch for c in (x, y))
    return (
        np.column_stack([x, y, dome(x, y) + rng.normal(0.0, sigma, x.size)])
        if sigma
        else np.column_stack([x, y, dome(x, y)])
    )


def turned(points: np.ndarray) -> np.ndarray:
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    return points @ turn.T + np.array([2.0, -1.0, 0.5])


def test_without_noise_raw_and_filtered_indices_agree() -> None:
    face = measure_face(cloud(0.0), None, "")
    assert face.indices["fltt"].value == pytest.approx(face.indices["xm"].value, rel=0.01)
    assert face.indices["minimum_zone"].value <= face.indices["fltt"].value
    assert face.crop_holds


@pytest.mark.parametrize("name", ["xm", "xa", "xg", "fltt", "fltq", "minimum_zone"])
def test_the_noise_correction_brings_back_the_index_of_the_true_surface(name: str) -> None:
    true = measure_face(cloud(0.0), None, "").indices[name].value
    found = [measure_face(cloud(SIGMA, seed), SIGMA, "manifest").indices[name] for seed in range(4)]
    corrected = np.mean([index.corrected for index in found])
    read = np.mean([index.value for index in found])
    assert abs(corrected - true) < max(0.2 * abs(read - true), 0.5 * UM)


def test_without_a_declared_sigma_the_local_residual_stands_in_and_says_so() -> None:
    face = measure_face(cloud(SIGMA), None, "")
    assert face.sigma == pytest.approx(SIGMA, rel=0.03)
    assert "lower bound" in face.sigma_source


def test_the_frame_does_not_matter() -> None:
    points = cloud(SIGMA)
    here, there = (measure_face(p, SIGMA, "manifest") for p in (points, turned(points)))
    for name in ("xm", "xa", "xg", "fltt", "minimum_zone"):
        assert there.indices[name].value == pytest.approx(here.indices[name].value, rel=1e-6), name


def test_one_point_half_a_millimetre_off_changes_nothing() -> None:
    points = cloud(SIGMA)
    clean = measure_face(points, SIGMA, "manifest")
    points[12_345, 2] += 0.5 * MM
    spiked = measure_face(points, SIGMA, "manifest")
    assert spiked.outliers.tolist() == [12_345]
    assert spiked.indices["xm"].value == pytest.approx(clean.indices["xm"].value, rel=1e-3)


def test_a_burr_along_the_edge_is_cropped() -> None:
    points = cloud(0.0)
    points[points[:, 0] < 0.8 * MM, 2] += 0.2 * MM
    assert measure_face(points, None, "").indices["xm"].value == pytest.approx(
        measure_face(cloud(0.0), None, "").indices["xm"].value, rel=0.05
    )


def test_a_rim_that_reaches_further_in_than_the_crop_is_noticed() -> None:
    points = cloud(SIGMA)
    points[:, 2] += 0.5 * MM * np.exp(-points[:, 0] / (2 * MM))
    assert not measure_face(points, None, "").crop_holds


def test_a_coarse_cloud_raises_the_nesting_index() -> None:
    face = measure_face(cloud(SIGMA, pitch=1 * MM), SIGMA, "manifest")
    assert face.nesting_index == pytest.approx(6 * MM, rel=0.02)


def test_the_zone_touches_the_points_it_names() -> None:
    face = measure_face(cloud(SIGMA), SIGMA, "manifest")
    heights = face.map_points @ face.zone.normal
    assert heights[face.zone.upper] == pytest.approx(heights.max(), abs=1e-9)
    assert heights[face.zone.lower] == pytest.approx(heights.min(), abs=1e-9)


def test_a_face_narrower_than_its_rim_is_refused() -> None:
    with pytest.raises(ValueError, match="narrower"):
        measure_face(cloud(0.0, size=(0.05, 0.0024)), None, "")
