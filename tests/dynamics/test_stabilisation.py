"""Normal equations of all orders at once, and poles in clusters by distance and shape."""

import numpy as np
import pytest

from metro.dynamics.plscf import normal_equations, poles
from metro.dynamics.refine import Data
from metro.dynamics.stabilisation import Cluster, Diagram, clustered, stabilisation

FREQUENCY = np.arange(20.0, 120.0, 0.25)
OMEGA = 2 * np.pi * np.array([40.0, 70.0, 100.0])
ZETA = np.array([0.03, 0.02, 0.015])


def true_poles(omega=OMEGA, zeta=ZETA):
    return omega * (-zeta + 1j * np.sqrt(1 - zeta**2))


def responses(left, right, omega=OMEGA, zeta=ZETA, noise=0.0):
    """FRFs (n, outputs, inputs) of modes with shapes left (outputs, m) and right (inputs, m)."""
    ratio = 2 * np.pi * FREQUENCY[:, None] / omega
    frf = np.einsum("nm,om,im->noi", 1 / (1 - ratio**2 + 2j * zeta * ratio), left, right)
    rng = np.random.default_rng(5)
    return frf + noise * (rng.normal(size=frf.shape) + 1j * rng.normal(size=frf.shape))


def random_shapes(outputs, inputs, modes=3):
    rng = np.random.default_rng(2)
    return rng.normal(size=(outputs, modes)), rng.normal(size=(inputs, modes))


def reduced_by_hand(frf, weight, order):
    """Sum over outputs of Y'Y - Y'X (X'X)^-1 X'Y with the equations written out."""
    powers = np.exp(2j * np.pi * FREQUENCY[:, None] * 0.5 / FREQUENCY[-1] * np.arange(order + 1))
    total = 0.0
    for output in range(frf.shape[1]):
        x = powers * weight[:, output, None]
        y = (x[:, :, None] * -frf[:, output, None, :]).reshape(len(FREQUENCY), -1)
        X, Y = np.vstack([x.real, x.imag]), np.vstack([y.real, y.imag])
        total += Y.T @ (Y - X @ np.linalg.lstsq(X, Y, rcond=None)[0])
    return total


@pytest.mark.parametrize("order", [1, 4, 7])
def test_lower_orders_come_out_of_the_highest(order):
    frf = responses(*random_shapes(4, 2), noise=0.05)
    weight = np.random.default_rng(3).uniform(0.5, 2.0, (len(FREQUENCY), 4))
    equations = normal_equations(FREQUENCY, frf, weight, 7)
    size = 2 * (order + 1)
    expected = reduced_by_hand(frf, weight, order)
    np.testing.assert_allclose(
        equations.reduced[order][:size, :size], expected, atol=1e-6 * np.abs(expected).max()
    )


def test_lines_may_be_missing():
    frf = responses(*random_shapes(3, 2))
    keep = np.delete(np.arange(len(FREQUENCY)), np.r_[10:15, 100, 200:230])
    found = poles(normal_equations(FREQUENCY[keep], frf[keep], np.ones((len(keep), 3)), 6), 6)
    for pole in true_poles():
        assert np.min(np.abs(found - pole)) < 2e-3 * abs(pole)


def diagram(frf, orders=range(4, 21, 2)):
    flat = frf.reshape(len(FREQUENCY), -1)
    return stabilisation(Data(2 * np.pi * FREQUENCY, flat, np.full(flat.shape, 100.0), frf.shape[2]), orders)


def test_the_poles_of_the_structure_recur_and_those_of_the_noise_do_not():
    found = diagram(responses(*random_shapes(4, 2), noise=0.01)).recurring()
    assert len(found) == 3
    for pole in true_poles():
        assert np.min(np.abs(np.array(found) - pole)) < 5e-3 * abs(pole)


@pytest.mark.parametrize("order", [12, 30])
def test_the_poles_of_the_noise_are_unstable_so_that_none_of_them_is_kept(order):
    # with the highest coefficient as the identity nearly all of them are stable
    frf = responses(*random_shapes(3, 2), noise=0.05)
    found = poles(normal_equations(FREQUENCY, frf, np.ones((len(FREQUENCY), 3)), order), order)
    assert len(found) == 3


def test_two_modes_of_one_frequency_and_damping_are_told_apart_by_their_shapes():
    """A symmetric structure has such pairs; a single reference cannot see more than one of them."""
    omega, zeta = 2 * np.pi * np.array([70.0, 70.1]), np.array([0.02, 0.02])
    left = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, -1.0]])
    frf = responses(left, np.array([[1.0, 0.1], [0.1, 1.0]]), omega, zeta, noise=0.01)
    found = np.array(diagram(frf).recurring())
    assert np.sum(np.abs(np.abs(found) / omega[0] - 1) < 0.003) == 2


A, B = np.array([1.0, 1.0j]), np.array([1.0, -1.0j])
P, Q = complex(-2.0, 100.0), complex(-2.1, 100.5)


def test_a_pole_of_another_shape_does_not_join():
    assert [len(c) for c in clustered([(2, np.array([P]), A[None]), (4, np.array([Q]), A[None])])] == [2]
    assert [len(c) for c in clustered([(2, np.array([P]), A[None]), (4, np.array([Q]), B[None])])] == [1, 1]


def test_two_poles_of_one_order_never_join():
    assert [len(c) for c in clustered([(2, np.array([P, Q]), np.stack([A, A]))])] == [1, 1]


@pytest.mark.parametrize(
    ("frequency", "damping", "joins"),
    [(1.015, 1.0, True), (1.03, 1.0, False), (1, 1.2, True), (1, 1.5, False)],
)
def test_a_pole_joins_within_2_percent_of_frequency_and_30_of_damping(frequency, damping, joins):
    zeta = 0.02 * np.array([1.0, damping])
    first, second = 100.0 * np.array([1.0, frequency]) * (-zeta + 1j * np.sqrt(1 - zeta**2))
    found = clustered([(2, np.array([first]), A[None]), (4, np.array([second]), A[None])])
    assert (len(found) == 1) == joins


def test_the_nearest_of_two_clusters_is_joined():
    found = clustered([(2, np.array([P, Q]), np.stack([A, A])), (4, np.array([Q * 1.001]), A[None])])
    assert [len(c) for c in found] == [1, 2]


def test_a_cluster_takes_one_pole_of_each_order():
    found = diagram(responses(*random_shapes(4, 2), noise=0.02))
    pairs = set(zip(found.order.tolist(), found.member.tolist(), strict=True))
    assert len(pairs) == len(found.poles)
    counts = np.bincount(found.member)
    assert counts.tolist() == [cluster.count for cluster in found.clusters]
    np.testing.assert_array_equal(found.recurs, counts >= 0.25 * 9)


@pytest.mark.parametrize(("share", "joins"), [(0.85, True), (0.75, False), (0.3, False)])
def test_shapes_join_from_an_assurance_of_four_fifths_on(share, joins):
    """The modal assurance criterion of unit vectors is the square of their product."""
    one, across = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    turned = np.sqrt(share) * one + np.sqrt(1 - share) * across
    pole = np.array([100.0 * (-0.02 + 1j)])
    found = clustered([(2, pole, one[None].astype(complex)), (4, pole, turned[None].astype(complex))])
    assert (len(found) == 1) == joins


def test_a_pole_of_a_quarter_of_the_orders_recurs_and_one_of_fewer_does_not():
    clusters = tuple(Cluster(100j, count) for count in (1, 4, 5, 20))
    found = Diagram(np.zeros(0), np.zeros(0), np.zeros(0), clusters, 20)
    assert found.recurs.tolist() == [False, False, True, True]
    assert len(found.recurring()) == 2
