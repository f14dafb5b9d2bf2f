"""The stabilisation diagram without a human: poles of all model orders, and which of them recur."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from metro.dynamics.plscf import NormalEquations, normal_equations, poles
from metro.dynamics.refine import Data
from metro.dynamics.shapes import mac, residues
from metro.units import Array, ComplexArray

# Two poles of neighbouring orders are one mode's when they differ by less than this; damping of a weakly
# excited mode scatters by so much, and merging by frequency alone would lose close pairs.
_FREQUENCY = 0.02
_DAMPING = 0.3
_MAC = 0.8
_LARGEST_DAMPING = 0.4
_RECURS = 0.25


@dataclass(frozen=True)
class Cluster:
    """A recurring pole (rad/s, the median over ``count`` orders)."""

    pole: complex
    count: int


@dataclass(frozen=True)
class Diagram:
    """Poles of every order.

    Attributes
    ----------
    order : (k,) model order of each pole.
    poles : (k,) rad/s.
    member : (k,) index of its cluster.
    clusters : by rising index.
    orders : number of orders that were solved.
    """

    order: np.ndarray
    poles: ComplexArray
    member: np.ndarray
    clusters: tuple[Cluster, ...]
    orders: int

    @property
    def recurs(self) -> np.ndarray:
        """(clusters,) whether each was found at a quarter of the orders or more."""
        return np.array([cluster.count >= _RECURS * self.orders for cluster in self.clusters], dtype=bool)

    def recurring(self) -> list[complex]:
        """Poles of the clusters that recur, frequent first."""
        kept = [cluster for cluster, recurs in zip(self.clusters, self.recurs, strict=True) if recurs]
        return [cluster.pole for cluster in sorted(kept, key=lambda cluster: -cluster.count)]


def stabilisation(data: Data, orders: range) -> Diagram:
    """Poles of all ``orders`` in clusters of alike frequency, damping and shape (MAC over the responses)."""
    frequency = data.omega / (2.0 * np.pi)
    by_input = data.frf.reshape(len(frequency), -1, data.inputs)
    variance = np.mean((1.0 / data.weight**2).reshape(by_input.shape), axis=2)
    equations = normal_equations(frequency, by_input, 1.0 / np.sqrt(variance), orders[-1])
    line_weight = 1.0 / np.sqrt(np.mean(1.0 / data.weight**2, axis=1))
    members = clustered(_of_order(data, equations, line_weight, order) for order in orders)
    flat = [(order, pole, i) for i, cluster in enumerate(members) for order, pole in cluster]
    return Diagram(
        np.array([order for order, _, _ in flat], dtype=int),
        np.array([pole for _, pole, _ in flat], dtype=np.complex128),
        np.array([i for _, _, i in flat], dtype=int),
        tuple(Cluster(_median([pole for _, pole in cluster]), len(cluster)) for cluster in members),
        len(orders),
    )


def _of_order(
    data: Data, equations: NormalEquations, weight: Array, order: int
) -> tuple[int, ComplexArray, ComplexArray]:
    """Order, its poles near the band, and their shapes (k, c)."""
    near_band = poles(equations, order)
    inside = (np.abs(near_band) > 0.7 * data.omega[0]) & (np.abs(near_band) < 1.3 * data.omega[-1])
    near_band = near_band[inside & (-near_band.real < _LARGEST_DAMPING * np.abs(near_band))]
    return order, near_band, residues(data.omega, data.frf, weight, near_band)


def clustered(
    poles_by_order: Iterable[tuple[int, ComplexArray, ComplexArray]],
) -> list[list[tuple[int, complex]]]:
    """Put poles in clusters, by rising order: (order, pole) of each member.

    A pole joins the nearest cluster whose last pole, of a lower order, it resembles in frequency, damping and
    shape; else it starts one.

    Parameters
    ----------
    poles_by_order : order, its poles (k,), rad/s, and their shapes (k, c).
    """
    members: list[list[tuple[int, complex]]] = []
    last: list[ComplexArray] = []
    for order, all_poles, shapes in poles_by_order:
        for pole, shape in zip(all_poles.tolist(), shapes, strict=True):
            near = [
                i
                for i, cluster in enumerate(members)
                if cluster[-1][0] < order
                and _alike(cluster[-1][1], pole)
                and mac(shape[None], last[i][None])[0, 0] > _MAC
            ]
            if near:
                best = min(near, key=lambda i: abs(members[i][-1][1] - pole))
                members[best].append((order, pole))
                last[best] = shape
            else:
                members.append([(order, pole)])
                last.append(shape)
    return members


def _alike(a: complex, b: complex) -> bool:
    damping_a, damping_b = -a.real / abs(a), -b.real / abs(b)
    return abs(abs(a) / abs(b) - 1.0) < _FREQUENCY and abs(damping_a / damping_b - 1.0) < _DAMPING


def _median(values: list[complex]) -> complex:
    return complex(np.median(np.real(values)), np.median(np.imag(values)))
