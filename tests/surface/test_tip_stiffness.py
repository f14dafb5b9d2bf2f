"""Tip compliance from load tests: recovery, blanks, reciprocity, non-linearity, interpolation."""

import numpy as np
import pytest

from metro.surface.tip_stiffness import (
    TERMS,
    choose_basis,
    fit_z_row,
    heights_design,
    nonlinearity,
    point_compliance,
    points_compliance,
    visible_entries,
    z_rows,
)

C = np.array([[3.0, -0.4, 0.8], [-0.4, 1.4, 0.2], [0.8, 0.2, 1.1]]) * 1e-6
AXES = np.repeat(np.eye(3), 2, axis=0) * np.tile([150.0, 250.0], 3)[:, None]


def compliance(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Varies linearly over the face, a different slope for each entry."""
    slope = np.array([[1.0, 0.2, 0.5], [0.2, 0.8, 0.1], [0.5, 0.1, 0.9]]) * 1e-6
    return C + (x[:, None, None] - 0.1) * slope * 2 + (y[:, None, None] - 0.05) * slope


def loads_over_the_face(noise: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    x, y = (c.ravel() for c in np.meshgrid([0.0, 0.1, 0.2], [0.0, 0.05, 0.1]))
    place = np.repeat(np.column_stack([x, y, np.zeros(9)]), len(AXES), axis=0)
    force = np.tile(AXES, (9, 1))
    moved = np.einsum("nij,nj->ni", compliance(place[:, 0], place[:, 1]), force)
    return place, force, moved + np.random.default_rng(0).normal(0, noise, moved.shape) if noise else moved


def test_the_matrix_comes_back_from_loads_along_the_axes() -> None:
    np.testing.assert_allclose(point_compliance(AXES, AXES @ C).matrix, C, atol=1e-18)


def test_displacements_that_were_not_measured_are_made_up_for_by_reciprocity() -> None:
    moved = AXES @ C
    moved[AXES[:, 2] == 0, 2] = np.nan  # dz only under z loads: C_xz and C_yz are seen as dx, dy there
    np.testing.assert_allclose(point_compliance(AXES, moved).matrix, C, atol=1e-18)


def test_entries_that_no_load_shows_are_not_a_number() -> None:
    found = point_compliance(AXES[:2], AXES[:2] @ C).matrix
    assert np.isfinite(found[0]).all()
    assert np.isnan([found[1, 1], found[1, 2], found[2, 2]]).all()


def test_the_standard_deviation_is_that_of_repeated_experiments() -> None:
    rng = np.random.default_rng(1)
    found = [point_compliance(AXES, AXES @ C + rng.normal(0, 2e-6, (6, 3))) for _ in range(400)]
    spread = np.std([f.matrix for f in found], axis=0)
    stated = np.sqrt(np.mean([f.sd**2 for f in found], axis=0))
    np.testing.assert_allclose(stated, spread, rtol=0.15)


def test_a_compliance_that_falls_with_the_load_is_reported_not_averaged_away() -> None:
    # 2.9 µm/N at 150 N, 2.7 µm/N at 250 N
    force = np.array([[150.0, 0, 0], [150.0, 0, 0], [250.0, 0, 0]])
    moved = np.array([[0.436e-3, np.nan, 0], [0.434e-3, np.nan, 0], [0.675e-3, np.nan, 0]])
    (found,) = nonlinearity(force, moved)
    assert found.loads == (150.0, 250.0)
    assert found.compliance[0][0] == pytest.approx(2.9e-6)
    assert found.relative[0] == pytest.approx(2.7 / 2.9 - 1)
    assert nonlinearity(force[:2], moved[:2]) == []


def test_the_field_predicts_heights_between_the_load_points() -> None:
    place, force, moved = loads_over_the_face()
    rows = z_rows(place[:, 0], place[:, 1], force, moved)
    entries = visible_entries(rows)
    basis, error = choose_basis(rows, entries)
    assert entries.all()
    assert basis.terms == TERMS[1]
    assert error < 1e-12
    values, _ = fit_z_row(rows, basis, entries)
    x, y, f = np.array([0.03, 0.17]), np.array([0.09, 0.02]), np.array([20.0, -110.0, 90.0])
    expected = (compliance(x, y) @ f)[:, 2]
    np.testing.assert_allclose(heights_design(basis, x, y, f) @ values, expected, rtol=1e-9)


def test_leaving_a_point_out_costs_more_than_the_noise_only_where_the_field_is_too_simple() -> None:
    place, force, moved = loads_over_the_face(noise=2e-6)
    rows = z_rows(place[:, 0], place[:, 1], force, moved)
    basis, error = choose_basis(rows, np.full(3, True))
    assert basis.terms == TERMS[1]
    assert error == pytest.approx(2e-6, rel=0.2)


def test_one_load_point_gives_a_constant() -> None:
    rows = z_rows(np.full(6, 0.1), np.full(6, 0.05), AXES, AXES @ C)
    basis, error = choose_basis(rows, visible_entries(rows))
    assert (basis.terms, error) == (1, np.inf)


def test_a_load_direction_that_was_never_applied_leaves_its_entry_out() -> None:
    force = AXES[2:]
    moved = force @ C
    moved[:, :2] = np.nan
    rows = z_rows(np.zeros(4), np.zeros(4), force, moved)
    assert visible_entries(rows).tolist() == [False, True, True]


def test_the_compliance_of_each_load_point_is_that_of_its_own_tests() -> None:
    place, force, moved = loads_over_the_face()
    mixed = np.random.default_rng(4).permutation(len(place))
    places, found = points_compliance(place[mixed], force[mixed], moved[mixed])
    np.testing.assert_allclose([each.matrix for each in found], compliance(*places.T), rtol=1e-9)
