"""The flatness model: the mean force on the tip's compliance, as the cutter's rim leaves it in the face."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from metro.observables.face_path import Pace, Passages
from metro.observables.face_ringing import Ringing
from metro.observables.face_setup import Setup, swung
from metro.observables.problem import Block, Parameter
from metro.observables.waviness_model import Vibration
from metro.structure import Structure
from metro.surface.footprint import RADIUS
from metro.surface.tip_stiffness import POWERS, Basis, Rows, heights_design
from metro.units import UM, Array

if TYPE_CHECKING:
    from scipy.sparse import csr_array

ENTRIES = ("zx", "zy", "zz")
# Places across and along the feed, in radii of a disc, whose mean is that over the disc: exact for a cubic,
# and to 0.2 % of a wave of three radii or more.
ACROSS, AHEAD = np.sqrt(0.5) * np.array([[-1.0, 1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 1.0]])
STIFF_NODES = 0.02  # apart, of the logarithm of the stiffness; the ringing is interpolated between
PHASES = tuple(2 * math.pi * third / 3 for third in range(3))


@dataclass(frozen=True, eq=False)
class PoseField:
    """The z row of the tip compliance over the face at one pose; ``entries`` (3,): those that loads show."""

    pose: str
    basis: Basis
    entries: tuple[bool, ...]

    @property
    def used(self) -> np.ndarray:
        """Mask of the coefficients (3 · terms) that are parameters of the model."""
        return np.repeat(self.entries, self.basis.terms)


@dataclass(frozen=True, eq=False)
class FaceSetting:
    """A face at the points of its path, and beside it.

    Attributes
    ----------
    pose : of the arm. x, y : (4 n,) places of n points, m: four about each one, which stand for its disc.
    first : index of the first point of each bin that is compared.
    passages : of the rim over the points; ``pace``: when. size : of the work along x and y, m; NaN where
        it is not known.
    force : (3,) mean force on the tool in full engagement, N, work frame.
    loaded : (3 · terms,) coefficients of the compliance by the load tests alone: they say which passage was
        the lowest.
    ringing : None where the mass of the arm is not known; the tip then follows the force statically.
    """

    pose: str
    x: Array
    y: Array
    first: np.ndarray
    passages: Passages
    pace: Pace
    size: tuple[float, float]
    force: Array
    loaded: Array
    ringing: Ringing | None

    @cached_property
    def middle(self) -> Passages:
        """The passages with the way of the axis where it is over the middle of the disc."""
        ahead = np.tile(RADIUS * AHEAD, len(self.x) // len(AHEAD))
        return replace(self.passages, along=self.passages.along - ahead[:, None])

    def mean(self, values: Array) -> Array:
        """Average the values of places, (4 n,) or (4 n, p), over the discs, and these over the bins."""
        return np.asarray(self._weights @ values)

    def binned(self, values: Array) -> Array:
        """Average the values of points, (n,) or (n, p), over the bins."""
        return np.asarray((np.add.reduceat(values, self.first, axis=0).T / self._count).T)

    @property
    def _count(self) -> np.ndarray:
        """Points in each bin."""
        return np.diff(np.append(self.first, len(self.x) // len(ACROSS)))

    @cached_property
    def _weights(self) -> csr_array:
        """Weight of each place in the mean of each bin: whatever is fitted averages many times."""
        from scipy.sparse import csr_array

        weight = np.repeat(1.0 / self._count, self._count * len(ACROSS)) / len(ACROSS)
        begins = np.append(len(ACROSS) * self.first, len(weight))
        return csr_array((weight, np.arange(len(weight)), begins))


@dataclass(frozen=True, eq=False)
class LoadSetting:
    """The static load tests of one pose."""

    pose: str
    rows: Rows


@dataclass(frozen=True)
class FlatnessModel:
    """Height of the face over its programmed plane: that of the tip, (C(P) F)_z and what rings about it.

    Of all passages of the rim over a point the lowest has the last word: what it removes does not come back.
    The static part is linear in the coefficients of C; the ringing is computed with C by the load tests, and
    is the model's offset.

    Attributes
    ----------
    fields : the compliance over (x, y) at each pose, known from load tests.
    structure : how stiff the arm is in the cut, relative to these tests.
    setup : how spindle, tool and work depart from what is programmed.
    vibration : of the tip, from the start of the first pass; its phase is each face's own.
    """

    fields: tuple[PoseField, ...]
    structure: Structure = field(default_factory=Structure)
    setup: Setup = field(default_factory=Setup)
    vibration: Vibration = field(default_factory=Vibration)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Coefficients of C_zx, C_zy, C_zz in the terms of each pose's basis, um/N."""
        return tuple(
            Parameter(f"c_{entry}_u{i}v{j}_{part.pose}", "um/N", UM)
            for part in self.fields
            for entry, seen in zip(ENTRIES, part.entries, strict=True)
            if seen
            for i, j in POWERS[: part.basis.terms]
        )

    def nuisance_starts(self, block: Block) -> Array:
        """Return starts of what a face has to tell, (k, 1): a vibration's phase."""
        if not isinstance(block.setting, FaceSetting):
            return np.zeros((1, 0))
        return np.array(PHASES if self.vibration.amplitude else PHASES[:1])[:, None]

    def design(self, block: Block, nuisance: Array, _beta: Array | None = None) -> tuple[Array, Array]:
        """Matrix (n, p) in m per (m/N), and what rings, swings or is set up otherwise (n,) m."""
        setting = block.setting
        if isinstance(setting, LoadSetting):
            return _loaded(self.fields, setting), np.zeros(len(block.measured))
        # The phase of no vibration changes nothing.
        terms, offset = _shaped(self, setting, float(nuisance[0]) if self.vibration.amplitude else 0.0)
        columns = self.structure.in_cut((setting.force[:, None] * terms[:, None, :]).reshape(len(terms), -1))
        parts = [_own(part, setting.pose, columns) for part in self.fields]
        return np.hstack(parts), offset.copy()

    def finished(self, setting: FaceSetting, nuisance: Array) -> tuple[tuple[np.ndarray, np.ndarray], Array]:
        """Index of the passage that finished each point, and what each cuts over the static height, (n, k) m.

        The passages whose cut is lowest; ``nuisance`` as :meth:`nuisance_starts` has it.
        """
        height, rest = self._heights(setting, nuisance)
        lowest = height.argmin(axis=1)
        return (np.arange(len(lowest)), lowest), rest

    def heights(self, setting: FaceSetting, nuisance: Array) -> Array:
        """Height of the cut at each passage by the load tests, (n, k) m; infinite where there is none."""
        return self._heights(setting, nuisance)[0]

    def _heights(self, setting: FaceSetting, nuisance: Array) -> tuple[Array, Array]:
        passages = setting.passages
        rest = self.setup.cuts(setting.x, setting.y, passages, setting.pace)
        rest = rest + swung(self.vibration, float(nuisance[0]), passages, setting.pace)
        if setting.ringing is not None:
            rest = rest + _ringing(setting, setting.ringing, self.structure)
        static = self.structure.in_cut(self._static(setting))
        return np.where(passages.valid, static + rest, np.inf), rest

    def _static(self, setting: FaceSetting) -> Array:
        return _static(self._basis(setting), setting)

    def _basis(self, setting: FaceSetting) -> Basis:
        return next(part.basis for part in self.fields if part.pose == setting.pose)


def _own(part: PoseField, pose: str, columns: Array) -> Array:
    """Return those ``columns``, (n, 3 · terms) of a face at ``pose``, that are parameters; else zeros."""
    count = int(part.used.sum())
    return columns[:, part.used] if part.pose == pose else np.zeros((len(columns), count))


@lru_cache(maxsize=16)
def _loaded(fields: tuple[PoseField, ...], setting: LoadSetting) -> Array:
    """Return the matrix of load tests, which no effect of a cut changes."""
    rows = {part.pose: setting.rows.design(part.basis) for part in fields if part.pose == setting.pose}
    none = np.zeros((len(setting.rows.displacement), 0))
    return np.hstack([_own(part, setting.pose, rows.get(part.pose, none)) for part in fields])


@lru_cache(maxsize=512)
def _shaped(model: FlatnessModel, setting: FaceSetting, phase: float) -> tuple[Array, Array]:
    """Return the mean of the basis' terms over each bin, (bins, terms), and of all else, (bins,) m.

    Noise and parameters are estimated in turn, so that the same is asked for many times.
    """
    chosen, rest = model.finished(setting, np.array([phase]))
    bowed = model.setup.bowed(setting.x, setting.y, setting.size)
    finished_by = chosen[1].astype(np.int8).tobytes()
    return _terms(model._basis(setting), setting, finished_by), setting.mean(rest[chosen] + bowed)


@lru_cache(maxsize=512)
def _terms(basis: Basis, setting: FaceSetting, finished_by: bytes) -> Array:
    """Mean of the basis' terms where the tool was, (bins, terms); ``finished_by``: index of each passage.

    A little change of an effect leaves nearly always the same passage the lowest.
    """
    lowest = np.frombuffer(finished_by, dtype=np.int8).astype(np.intp)
    rows = np.arange(len(lowest))
    return setting.mean(basis(setting.passages.x[rows, lowest], setting.passages.y[rows, lowest]))


@lru_cache(maxsize=64)
def _static(basis: Basis, setting: FaceSetting) -> Array:
    """Return the static height of the tip by the load tests, at each passage, (n, k) m."""
    at = setting.passages
    rows = heights_design(basis, at.x.ravel(), at.y.ravel(), setting.force)
    return np.asarray((rows @ setting.loaded).reshape(at.x.shape))


@lru_cache(maxsize=128)
def _ringing(setting: FaceSetting, ringing: Ringing, structure: Structure) -> Array:
    """Return what rings at each passage, (n, k) m: whatever else shapes the face, it is the same.

    It is a mean along the feed already: its waves may be shorter than a disc.
    """
    rung = ringing.at(_rung(ringing, structure), setting.middle)
    return rung + ringing.of_teeth(structure, setting.passages)


@lru_cache(maxsize=64)
def _rung(ringing: Ringing, structure: Structure) -> Array:
    """Return the height over the static one along the passes, (passes, n) m.

    By cubic interpolation over the logarithm of the stiffness: to 1e-3 of the ringing.
    """
    if structure.stiffness_factor == 1.0:
        return _rung_at(ringing, structure)
    place = math.log(structure.stiffness_factor) / STIFF_NODES
    parts = [
        weight * _rung_at(ringing, Structure(math.exp(node * STIFF_NODES))) for node, weight in _cubic(place)
    ]
    return np.asarray(sum(parts))


def _cubic(place: float) -> list[tuple[int, float]]:
    """Return the four integers about a place, each with its weight in Lagrange's cubic interpolation."""
    first = math.floor(place) - 1
    share = place - first
    return [(first + i, math.prod((share - j) / (i - j) for j in range(4) if j != i)) for i in range(4)]


@lru_cache(maxsize=512)
def _rung_at(ringing: Ringing, structure: Structure) -> Array:
    """Whatever else shapes the face, this is the same, and slow to have."""
    return ringing.moved(structure)
