"""Noise of a face by wavelength: what two scans tell, and what is assumed."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from metro.surface.face import measure_face
from metro.surface.face_noise import repeat_noise, spatial_order
from metro.surface.noise_spectrum import assumed
from metro.units import MM, UM

PITCH = 0.5 * MM
X, Y = np.meshgrid(*(np.arange(PITCH / 2, extent, PITCH) for extent in (0.08, 0.06)), indexing="ij")
DOME = 60 * UM * np.cos(2 * np.pi * X / 0.15) * np.cos(np.pi * Y / 0.08)
WHITE, CORRELATED = 15 * UM, 12 * UM


def cloud(z: np.ndarray) -> np.ndarray:
    return np.column_stack([X.ravel(), Y.ravel(), z.ravel()])


def noise(rng: np.random.Generator) -> np.ndarray:
    """White noise and noise of 12 µm that is blurred over a millimetre."""
    blur = 1 * MM / PITCH
    blurred = gaussian_filter(rng.normal(size=X.shape), blur, mode="wrap") * 2 * np.sqrt(np.pi) * blur
    return WHITE * rng.normal(size=X.shape) + CORRELATED * blurred


def test_two_scans_tell_noise_that_one_takes_for_the_surface() -> None:
    rng = np.random.default_rng(3)
    scans = [cloud(DOME + noise(rng)) for _ in range(2)]
    found = repeat_noise(scans, 2.5 * MM)
    assert found.sigma == pytest.approx(np.hypot(WHITE, CORRELATED), rel=0.08)
    assert found.spectrum is not None
    expected = assumed(WHITE, CORRELATED, PITCH**-2).through(2.5 * MM)
    assert found.spectrum.through(2.5 * MM) == pytest.approx(expected, rel=0.1)
    assert measure_face(scans[0]).sigma < 0.9 * found.sigma


def test_the_doubt_of_a_spectrum_is_the_scatter_of_spectra_however_many_scans_they_are_of() -> None:
    rng, found = np.random.default_rng(8), []
    for _ in range(150):
        scans = [cloud(DOME + WHITE * rng.normal(size=X.shape))[X.ravel() < 0.03] for _ in range(4)]
        found.append(repeat_noise(scans, 2.5 * MM).spectrum)
    density = np.array([each.density for each in found])[:, 1:]
    scatter = density.std(axis=0) / density.mean(axis=0)
    assert np.mean(scatter / found[0].doubt[1:]) == pytest.approx(1.0, abs=0.07)


def test_a_declared_blur_passes_the_filter_as_a_simulated_one_does() -> None:
    rng, passed = np.random.default_rng(4), []
    for _ in range(12):
        face = measure_face(cloud(noise(rng)), nesting_index=6 * MM, uncertainty=False)
        passed.append(face.indices["fltq"].value)
    expected = assumed(WHITE, CORRELATED, PITCH**-2).through(6 * MM)
    assert np.sqrt(np.mean(np.square(passed))) == pytest.approx(expected, rel=0.06)


def test_neighbours_alike_are_told_from_noise() -> None:
    rng = np.random.default_rng(5)
    places = rng.uniform(0, 1, (150, 2))
    chances = [spatial_order(places, rng.normal(size=150)) for _ in range(300)]
    assert np.mean(np.array(chances) < 0.05) == pytest.approx(0.05, abs=0.035)
    assert spatial_order(places, np.sin(4 * places[:, 0]) + 0.3 * rng.normal(size=150)) < 1e-6


@pytest.mark.parametrize("change", ["order", "unit", "chunks", "offset", "float32"])
def test_indices_do_not_depend_on(change: str, monkeypatch: pytest.MonkeyPatch) -> None:
    points = np.round(cloud(DOME + noise(np.random.default_rng(6))) * 2**30) / 2**30  # exact at an offset
    before, scale = measure_face(points), 1.0
    if change == "order":
        points = np.random.default_rng(7).permutation(points)
    elif change == "offset":
        points = points + 8192.0
    elif change == "chunks":
        monkeypatch.setattr("metro.surface.points.CHUNK", 1777)
    elif change == "float32":
        points = points.astype(np.float32)
    else:
        scale = 2.0
        points = points * scale
    after = measure_face(points, nesting_index=2.5 * MM * scale)
    for name, index in before.indices.items():
        assert after.indices[name].value == pytest.approx(scale * index.value, rel=2e-4), name
