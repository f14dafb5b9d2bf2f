"""The cutting force of a batch under another bookkeeping: a fast fit of the order averages of all runs.

The prediction is linear in the six cutting coefficients, and the phase of a run turns its orders, so that the
normal matrix of a run holds for every phase. One fit takes some milliseconds, and every slip of a list can be
tried.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from metro.cutting.cutter import Cutter
from metro.cutting.force import force_basis
from metro.cutting.law import EdgeLaw
from metro.observables.force.coefficients import AXES
from metro.observables.force.model import ForceSetting
from metro.observables.problem import Block
from metro.signals.orders import to_orders
from metro.units import Array, ComplexArray

PHASES = 96  # of a run's start: a step of 3.75 degrees is a thirtieth of the pitch of three teeth
ROUNDS = 6  # of coefficients and phases by turns
RIDGE = 1e-9  # of the scaled normal matrix: decides where the runs do not, and nowhere else


@dataclass(frozen=True, eq=False)
class Record:
    """The order amplitudes of a run's force on the tool, work frame: (orders, 3), from order 0 on."""

    run: str
    setting: ForceSetting
    force: ComplexArray

    def mapped(self, matrix: Array) -> Record:
        """Return the record with its force multiplied by a (3, 3) ``matrix``."""
        return replace(self, force=self.force @ matrix.T)

    @cached_property
    def power(self) -> Array:
        """Power of each axis (3,), all orders."""
        return np.asarray(np.sum(np.abs(self.force) ** 2, axis=0))


@dataclass(frozen=True, eq=False)
class Design:
    """Order amplitudes (orders, 3, 6) of a run's force per unit of each coefficient, at phase 0."""

    basis: ComplexArray

    @cached_property
    def gram(self) -> Array:
        """Normal matrix of each axis (3, 6, 6), at every phase."""
        by_axis = np.swapaxes(self.basis, 0, 1)
        return np.asarray((np.swapaxes(by_axis.conj(), 1, 2) @ by_axis).real)


@dataclass(frozen=True, eq=False)
class Coefficients:
    """Cutting coefficients (6,), SI, and what they become (runs, 6) as each run is left out."""

    value: Array
    without: Array

    def of(self, combination: Array) -> tuple[float, float]:
        """Value of a linear ``combination`` (6,), and its deviation by jackknife; infinite for one run."""
        count = len(self.without)
        value = float(combination @ self.value)
        if count < 2:
            return value, float("inf")
        moves = self.without @ combination - value
        return value, float(np.sqrt((count - 1) / count * np.sum(moves**2)))


@dataclass(frozen=True, eq=False)
class WaveFit:
    """The coefficients of all runs together.

    Attributes
    ----------
    wave, mean : by waveform; by the mean forces alone, which no phase and no resonance changes.
    misfit : residual relative to the signal, rms, each axis by its own power. by_run : the same of each run.
    """

    wave: Coefficients
    mean: Coefficients
    misfit: float
    by_run: dict[str, float]


def record_of(block: Block) -> Record:
    """Return the mean order amplitudes of a block of the force."""
    setting: ForceSetting = block.setting
    mean = block.measured.reshape(block.repeats, len(AXES), -1).mean(axis=0)
    return Record(block.run, setting, _amplitudes(mean.T))


@lru_cache(maxsize=1024)
def design(cutter: Cutter, setting: ForceSetting) -> Design:
    """Return the force on the tool per unit of each coefficient, work frame."""
    basis = to_orders(force_basis(cutter, EdgeLaw(), setting.cut), setting.highest)
    basis = basis * np.repeat([setting.feed_ratio, 1.0], 3)
    c, s = np.cos(setting.feed_direction), np.sin(setting.feed_direction)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return Design(_amplitudes(turn @ basis))


def fit(records: Sequence[Record], designs: Sequence[Design]) -> WaveFit:
    """Fit the coefficients and each run's phase to all records, by turns, from each run's own best phase."""
    power = np.array([record.power for record in records])
    weight = 1.0 / np.maximum(power.sum(axis=0), 1e-300)
    normal = np.array([np.tensordot(weight, one.gram, 1) for one in designs])
    right = np.array([_right(*pair, weight) for pair in zip(records, designs, strict=True)])
    size = np.sqrt(np.maximum(np.einsum("rpp->p", normal), 1e-300))
    normal, right = normal / np.outer(size, size), right / size
    alone = _solved(normal[:, None], right)
    runs = np.arange(len(records))
    chosen = right[runs, np.argmax(np.sum(right * alone, axis=2), axis=1)]
    for _ in range(ROUNDS):
        beta = _solved(normal.sum(axis=0), chosen.sum(axis=0))
        chosen = right[runs, np.argmax(right @ beta, axis=1)]
    wave = _coefficients(normal, chosen)
    beta, signal = wave.value, power @ weight
    left = np.maximum(signal - 2.0 * chosen @ beta + np.einsum("p,rpq,q->r", beta, normal, beta), 0.0)
    by_run = np.sqrt(left / np.maximum(signal, 1e-300))
    return WaveFit(
        Coefficients(beta / size, wave.without / size),
        _by_means(records, designs),
        float(np.sqrt(left.sum() / signal.sum())),
        {record.run: float(share) for record, share in zip(records, by_run, strict=True)},
    )


def residual_with(record: Record, one: Design, beta: Array) -> float:
    """Share of a record's power that known coefficients leave at the best phase; each axis by its power.

    Infinite where the two do not have the same orders.
    """
    if one.basis.shape[:2] != record.force.shape:
        return float("inf")
    weight = 1.0 / np.maximum(record.power, 1e-300)
    signal = float(record.power @ weight)
    found = float((_right(record, one, weight) @ beta).max())
    return (signal - 2.0 * found + float(beta @ np.tensordot(weight, one.gram, 1) @ beta)) / signal


def _by_means(records: Sequence[Record], designs: Sequence[Design]) -> Coefficients:
    """Coefficients of the mean forces; shear and edge share what one feed cannot distinguish."""
    matrix = np.array([one.basis[0].real for one in designs])
    target = np.array([record.force[0].real for record in records])
    size = np.sqrt(np.maximum((matrix**2).sum(axis=(0, 1)), 1e-300))
    matrix = matrix / size
    found = _coefficients(
        np.swapaxes(matrix, 1, 2) @ matrix, (np.swapaxes(matrix, 1, 2) @ target[..., None])[..., 0]
    )
    return Coefficients(found.value / size, found.without / size)


def _amplitudes(orders: Array) -> ComplexArray:
    """Amplitudes (orders, …) with the power of coefficients [mean, cosine, sine, …] (2H+1, …)."""
    return np.asarray(np.concatenate([orders[:1].astype(complex), orders[1::2] - 1j * orders[2::2]]))


@lru_cache(maxsize=16)
def _turns(orders: int) -> ComplexArray:
    return np.asarray(np.exp(-2j * np.pi * np.outer(np.arange(PHASES) / PHASES, np.arange(orders))))


def _right(record: Record, one: Design, weight: Array) -> Array:
    """Right side (PHASES, 6) of the normal equations of a run at every phase."""
    cross = np.sum(one.basis.conj() * (record.force * weight)[:, :, None], axis=1)
    return np.asarray((_turns(len(cross)) @ cross).real)


def _solved(normal: Array, right: Array) -> Array:
    return np.asarray(np.linalg.solve(normal + RIDGE * np.eye(normal.shape[-1]), right[..., None])[..., 0])


def _coefficients(normal: Array, right: Array) -> Coefficients:
    """Solve for all runs (runs, 6, 6), (runs, 6), and without each."""
    whole = normal.sum(axis=0), right.sum(axis=0)
    without = _solved(whole[0] - normal, whole[1] - right) if len(normal) > 1 else np.zeros((1, 6))
    return Coefficients(_solved(*whole), without)
