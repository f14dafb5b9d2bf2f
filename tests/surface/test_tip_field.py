"""Matrices over a face: polynomials that say how well they predict a point that was left out."""

import numpy as np
import pytest

from metro.surface.tip_field import choose_field, field_in, least_eigenvalue
from metro.surface.tip_stiffness import basis_over

X, Y = (c.ravel() for c in np.meshgrid([0.0, 0.1, 0.2], [0.0, 0.05, 0.1]))
BASE = np.array([[650.0, 3.0, 380.0], [3.0, 900.0, 5.0], [380.0, 5.0, 270.0]])


def linear(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return BASE * (1 + 2 * np.asarray(x) - np.asarray(y))[:, None, None]


def test_a_linear_field_is_found_and_followed_between_its_points() -> None:
    found = choose_field(X, Y, linear(X, Y))
    assert found.basis.terms == 3
    assert found.error < 1e-12
    x, y = np.array([0.03, 0.17]), np.array([0.09, 0.02])
    np.testing.assert_allclose(found(x, y), linear(x, y))


def test_one_point_is_a_constant_of_unknown_error() -> None:
    found = choose_field(X[:1], Y[:1], BASE[None])
    assert np.isnan(found.error)
    np.testing.assert_allclose(found(X, Y), np.tile(BASE, (9, 1, 1)))


def test_two_points_give_their_mean_and_an_error_that_says_so() -> None:
    found = choose_field(X[:2], Y[:2], np.stack([0.9 * BASE, 1.1 * BASE]))
    np.testing.assert_allclose(found(X[:1], Y[:1])[0], BASE)
    assert found.error == pytest.approx(0.2 / np.sqrt((0.9**2 + 1.1**2) / 2))


def test_the_error_of_a_noisy_field_is_that_at_points_it_has_not_seen() -> None:
    rng = np.random.default_rng(2)
    x, y = rng.uniform(0, 0.2, (2, 40))
    noise = np.array([_symmetric(rng) for _ in x])
    found = choose_field(x, y, linear(x, y) * (1 + 0.01 * noise))
    fresh = np.array([_symmetric(rng) for _ in x])
    new_x, new_y = rng.uniform(0, 0.2, (2, 40))
    truth = linear(new_x, new_y)
    off = np.linalg.norm(found(new_x, new_y) - truth * (1 + 0.01 * fresh)) / np.linalg.norm(truth)
    assert found.error == pytest.approx(off, rel=0.25)


def _symmetric(rng: np.random.Generator) -> np.ndarray:
    draw = rng.standard_normal((3, 3))
    return (draw + draw.T) / 2


def test_too_few_points_for_a_basis_give_no_error_and_the_smallest_terms() -> None:
    found = field_in(basis_over(X[:2], Y[:2], 3), X[:2], Y[:2], linear(X[:2], Y[:2]))
    assert np.isnan(found.error)
    np.testing.assert_allclose(found(X[:2], Y[:2]), linear(X[:2], Y[:2]))


def test_the_least_eigenvalue_tells_a_matrix_that_no_structure_has() -> None:
    turned = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    given = turned @ np.diag([4.0, -1.0, 2.0]) @ turned.T
    assert least_eigenvalue(np.stack([given, BASE]))[0] == pytest.approx(-0.25)
    assert least_eigenvalue(np.stack([given, BASE]))[1] > 0
