"""The flatness model: the mean force on the tip's compliance, as the cutter's rim leaves it in the face."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from metro.observables.problem import Block, Parameter
from metro.structure import Structure
from metro.surface.tip_response import tip_heights
from metro.surface.tip_stiffness import POWERS, Basis, Rows, heights_design
from metro.units import UM, Array

ENTRIES = ("zx", "zy", "zz")
DAMPING_RATIOS = (0.02, 0.05, 0.12)


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
class Passages:
    """Every time that the cutter's rim went over each point of a face.

    Attributes
    ----------
    x, y : (n, k) where the tool's centre then was, m.
    number : (n, k) index of the pass; along : (n, k) way from the start of the pass, m.
    valid : (n, k) whether there is such a passage (points are passed over a different number of times).
    """

    x: Array
    y: Array
    number: np.ndarray
    along: Array
    valid: np.ndarray


@dataclass(frozen=True, eq=False)
class Ringing:
    """What the transients of a face follow from.

    ``mass`` (3, 3) kg; ``compliance`` (passes, 3, 3) m/N of the load tests at the middle of each pass;
    ``force`` (n, 3) N on the tip over one ``period`` (s) of pass and return, at the feed ``speed`` (m/s);
    ``disc`` radius of the footprint, m.
    """

    mass: Array
    compliance: Array
    force: Array
    period: float
    speed: float
    disc: float

    def heights(self, structure: Structure, damping: float) -> Array:
        """Height of the tip less the static one under the full force, (passes, n) m."""
        compliance = structure.in_cut(self.compliance)
        stiffness = np.asarray(np.linalg.inv(compliance), dtype=np.float64)
        disc = self.disc / self.speed
        return tip_heights(self.mass, stiffness, damping, force=self.force, period=self.period, disc=disc)

    def at(self, heights: Array, passages: Passages) -> Array:
        """Interpolate ``heights`` (passes, n) at passages, (points, k)."""
        place = passages.along / self.speed / self.period * heights.shape[1]
        before = np.clip(np.floor(place).astype(np.intp), 0, heights.shape[1] - 2)
        share = place - before
        low, high = heights[passages.number, before], heights[passages.number, before + 1]
        return np.asarray(low + share * (high - low))


@dataclass(frozen=True, eq=False)
class FaceSetting:
    """A face at the points of its path.

    Attributes
    ----------
    pose : of the arm. x, y : (n,) the points, m; ``first``: index of the first point of each bin that is
        compared.
    passages : of the rim over the points.
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
    force: Array
    loaded: Array
    ringing: Ringing | None

    def mean(self, values: Array) -> Array:
        """Average the values of points, (n,) or (n, p), over the bins."""
        count = np.diff(np.append(self.first, len(self.x)))
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
    """

    fields: tuple[PoseField, ...]
    structure: Structure = field(default_factory=Structure)

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
        """Logarithm of the damping ratio, (3, 1), where transients are predicted; else nothing, (1, 0)."""
        if isinstance(block.setting, FaceSetting) and block.setting.ringing is not None:
            return np.log(DAMPING_RATIOS)[:, None]
        return np.zeros((1, 0))

    def design(self, block: Block, nuisance: Array, _beta: Array | None = None) -> tuple[Array, Array]:
        """Matrix (n, p) in m per (m/N), and the ringing (n,) m."""
        setting = block.setting
        if isinstance(setting, LoadSetting):
            parts = [self._own(part, setting.pose, setting.rows.design(part.basis)) for part in self.fields]
            return np.hstack(parts), np.zeros(len(block.measured))
        x, y, rest = self._finished(setting, nuisance)
        parts = [
            self._own(
                part,
                setting.pose,
                setting.mean(self.structure.in_cut(heights_design(part.basis, x, y, setting.force))),
            )
            for part in self.fields
        ]
        return np.hstack(parts), setting.mean(rest)

    def _own(self, part: PoseField, pose: str, columns: Array) -> Array:
        return columns[:, part.used] * float(part.pose == pose)

    def _finished(self, setting: FaceSetting, nuisance: Array) -> tuple[Array, Array, Array]:
        """Centre of the tool when its rim finished each point, and the tip's height over the static one."""
        passages = setting.passages
        basis = next(part.basis for part in self.fields if part.pose == setting.pose)
        shape = passages.x.shape
        rows = heights_design(basis, passages.x.ravel(), passages.y.ravel(), setting.force)
        static = self.structure.in_cut((rows @ setting.loaded).reshape(shape))
        rest = np.zeros(shape)
        if setting.ringing is not None:
            ringing = setting.ringing
            full = self.structure.in_cut(ringing.compliance) @ setting.force
            moved = ringing.heights(self.structure, math.exp(nuisance[0])) - full[:, 2:]
            rest = ringing.at(moved, passages)
        lowest = np.where(passages.valid, static + rest, np.inf).argmin(axis=1)
        chosen = (np.arange(shape[0]), lowest)
        return passages.x[chosen], passages.y[chosen], rest[chosen]
