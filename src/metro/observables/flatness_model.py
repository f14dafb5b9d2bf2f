"""The flatness model: the mean force on the tip's compliance, as the cutter's rim leaves it in the face."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from metro.observables.face_path import Pace, Passages
from metro.observables.face_ringing import Ringing
from metro.observables.face_setup import Setup, swung
from metro.observables.problem import Block, Parameter
from metro.observables.waviness_model import Vibration
from metro.structure import Structure
from metro.surface.tip_stiffness import POWERS, Basis, Rows, heights_design
from metro.units import UM, Array

ENTRIES = ("zx", "zy", "zz")
# Places across the feed, in radii of a disc, and their weights: Gauss's rule for the mean over a disc.
ACROSS, WEIGHTS = (-math.sqrt(0.5), 0.0, math.sqrt(0.5)), (0.25, 0.5, 0.25)
NODES = 0.1  # apart, of the logarithm of the damping ratio between which the ringing is interpolated
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
    pose : of the arm. x, y : (3 n,) places of n points, m: each one's middle between two to its sides, which
        stand for its disc. first : index of the first point of each bin that is compared.
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

    def mean(self, values: Array) -> Array:
        """Average the values of places, (3 n,) or (3 n, p), over the discs, and these over the bins."""
        discs = values.reshape(-1, len(ACROSS), *values.shape[1:])
        return self.binned(np.tensordot(WEIGHTS, discs, axes=(0, 1)))

    def binned(self, values: Array) -> Array:
        """Average the values of points, (n,) or (n, p), over the bins."""
        count = np.diff(np.append(self.first, len(self.x) // len(ACROSS)))
        return np.asarray((np.add.reduceat(values, self.first, axis=0).T / count).T)


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
        """Return starts of what a face has to tell, (k, m): for its transients, and a vibration's phase."""
        if not isinstance(block.setting, FaceSetting):
            return np.zeros((1, 0))
        ringing = block.setting.ringing
        starts = np.zeros((1, 0)) if ringing is None else ringing.starts
        phases = PHASES if self.vibration.amplitude else PHASES[:1]
        return np.array([[*start, phase] for phase in phases for start in starts])

    def design(self, block: Block, nuisance: Array, _beta: Array | None = None) -> tuple[Array, Array]:
        """Matrix (n, p) in m per (m/N), and what rings, swings or is set up otherwise (n,) m."""
        setting = block.setting
        if isinstance(setting, LoadSetting):
            parts = [self._own(part, setting.pose, setting.rows.design(part.basis)) for part in self.fields]
            return np.hstack(parts), np.zeros(len(block.measured))
        chosen, rest = self.finished(setting, nuisance)
        x, y = setting.passages.x[chosen], setting.passages.y[chosen]
        parts = [
            self._own(
                part,
                setting.pose,
                setting.mean(self.structure.in_cut(heights_design(part.basis, x, y, setting.force))),
            )
            for part in self.fields
        ]
        bowed = self.setup.bowed(setting.x, setting.y, setting.size)
        return np.hstack(parts), setting.mean(rest[chosen] + bowed)

    def _own(self, part: PoseField, pose: str, columns: Array) -> Array:
        return columns[:, part.used] * float(part.pose == pose)

    def finished(self, setting: FaceSetting, nuisance: Array) -> tuple[tuple[np.ndarray, np.ndarray], Array]:
        """Index of the passage that finished each point, and what each cuts over the static height, (n, k) m.

        The passages whose cut is lowest; ``nuisance`` as :meth:`nuisance_starts` has it.
        """
        passages = setting.passages
        rest = self.setup.cuts(setting.x, setting.y, passages, setting.pace)
        rest = rest + swung(self.vibration, float(nuisance[-1]), passages, setting.pace)
        if setting.ringing is not None:
            own = tuple(float(value) for value in nuisance[:-1])
            rest = rest + _rung(setting.ringing, self.structure, own, passages)
        static = self.structure.in_cut(self._static(setting))
        lowest = np.where(passages.valid, static + rest, np.inf).argmin(axis=1)
        return (np.arange(len(lowest)), lowest), rest

    def _static(self, setting: FaceSetting) -> Array:
        basis = next(part.basis for part in self.fields if part.pose == setting.pose)
        return _static(basis, setting)


@lru_cache(maxsize=64)
def _static(basis: Basis, setting: FaceSetting) -> Array:
    """Return the static height of the tip by the load tests, at each passage, (n, k) m."""
    at = setting.passages
    rows = heights_design(basis, at.x.ravel(), at.y.ravel(), setting.force)
    return np.asarray((rows @ setting.loaded).reshape(at.x.shape))


def _rung(ringing: Ringing, structure: Structure, own: tuple[float, ...], passages: Passages) -> Array:
    """Return the height over the static one at passages.

    With the stiffness of the load tests, which most fits keep, by cubic interpolation over the logarithm of
    the damping: to 1e-5 of the ringing.
    """
    if not own or structure != Structure():
        return _rung_at(ringing, structure, own, passages)
    place = own[0] / NODES
    first = math.floor(place) - 1
    share = place - first
    weights = [math.prod((share - j) / (i - j) for j in range(4) if j != i) for i in range(4)]
    nodes = [_rung_at(ringing, structure, ((first + i) * NODES,), passages) for i in range(4)]
    return np.asarray(sum(weight * node for weight, node in zip(weights, nodes, strict=True)))


@lru_cache(maxsize=512)
def _rung_at(ringing: Ringing, structure: Structure, own: tuple[float, ...], passages: Passages) -> Array:
    """Whatever else shapes the face, this is the same, and slow to have."""
    return ringing.rest(structure, np.array(own), passages)
