"""The ringing in a pass: the tip's motion about its static height, at every passage of the cutter's rim."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from metro.batch.batch import Batch
from metro.cutting.cutter import Cutter
from metro.cutting.force import COEFFICIENTS, force_basis
from metro.cutting.law import EdgeLaw
from metro.observables.cut import conditions as cutting_force
from metro.observables.flatness.dynamics import ArmMode, TipDynamics
from metro.observables.flatness.path import STEP, Passages, Path, force_over_period
from metro.observables.problem import Refusal
from metro.structure import Structure
from metro.surface.tip_damping import Damping, SharedRatio
from metro.surface.tip_harmonics import SLOW, at_rim, tooth_heights
from metro.surface.tip_response import TipModes, disc_weights, respond, swing, tip_modes
from metro.units import MM, Array

SEGMENT = 4 * MM  # M, C, K are constant over it
PER_CYCLE = 4  # samples in a period of the fastest mode, and in the time that the footprint's radius takes


@dataclass(frozen=True, eq=False)
class Teeth:
    """Inputs of the tip's motion at the frequency of the teeth.

    ``modes`` of the tip at the middle of each pass; ``force`` (n, 3) N on the tip over a revolution, work
    frame; ``rate`` of the spindle, rad/s; ``angles`` (N,) of the teeth, clockwise from tooth 0.
    """

    modes: TipModes
    force: Array
    rate: float
    angles: Array

    @property
    def slow(self) -> bool:
        """Whether the tooth passing frequency is below ten times the tip's highest mode: then it matters."""
        return self.rate * len(self.angles) < SLOW * float(self.modes.frequency.max())


@dataclass(frozen=True, eq=False)
class Ringing:
    """Inputs of the transients of a face, in segments of the way from the first pass to the last.

    Attributes
    ----------
    modes : of the tip from the load tests, in each of s segments.
    static : (s,) m, height under the full force there, from the load tests.
    force : (s, m + 1, 3) N on the tip. step : time between its samples, s.
    speed : feed, m/s. passes : their number; each has the same number of segments.
    weights : of the samples in the mean over the footprint.
    damping : of the modes. teeth : None if they pass too fast to move the tip.
    beside : modes of the arm that swing beside these.
    """

    modes: TipModes
    static: Array
    force: Array
    step: float
    speed: float
    passes: int
    weights: Array
    damping: Damping
    teeth: Teeth | None
    beside: tuple[ArmMode, ...] = ()

    def heights(self, structure: Structure, passages: Passages) -> Array:
        """Height of the tip over the static one under the full force, (points, k) m, mean over discs."""
        (softer,) = structure.in_cut(np.ones(1)).tolist()
        tuned = self.tuned(1.0 / math.sqrt(softer))
        return np.asarray(softer * (tuned.at(tuned.moved(), passages) + tuned.of_teeth(passages)))

    def tuned(self, factor: float) -> Ringing:
        """Return the ringing of a tip of the same stiffness, whose frequencies are another by a factor."""
        teeth = self.teeth and replace(self.teeth, modes=_tuned(self.teeth.modes, factor))
        return replace(self, modes=_tuned(self.modes, factor), teeth=teeth)

    def moved(self) -> Array:
        """Height of the tip over the static one under the full force, (passes, n) m, see :meth:`heights`."""
        ratio = self.damping.ratio(self.modes.frequency)
        moved = respond(self.modes, ratio, self.force, self.step) - self.static[:, None]
        return np.convolve(moved.ravel(), self.weights, mode="same").reshape(self.passes, -1)

    def swung(self, mode: ArmMode) -> Array:
        """Return what the height gains by each force along x, y, z if one of the other modes takes it, m.

        The load tests measure the arm with all its modes. So the compliance of this one swings at its own
        frequency, and no longer at the lowest one of the others: of that, the motion is taken away. Positive
        reach along all axes is assumed.

        Returns
        -------
        (3, passes, n), a mean over the footprint as of :meth:`moved`.
        """
        force = np.vstack([self.force[:, :-1].reshape(-1, 3), self.force[-1, -1:]])
        lowest, ratio = self.modes.frequency[:, 0].mean(), self.damping.ratio(self.modes.frequency)
        ratio = np.broadcast_to(ratio, self.modes.frequency.shape)[:, 0].mean()
        other = swing(float(lowest), float(ratio), force, self.step)
        at_once = math.isinf(mode.frequency)
        own = force[:-1] if at_once else swing(mode.frequency, mode.ratio, force, self.step)
        heights = mode.reach[2] * np.array(mode.reach)[:, None] * (own - other).T
        mean = [np.convolve(each, self.weights, mode="same") for each in heights]
        return np.reshape(mean, (3, self.passes, -1))

    def of_teeth(self, passages: Passages) -> Array | float:
        """Height of the tip about its mean over a turn at each passage, (points, k) m; zero without teeth."""
        if self.teeth is None:
            return 0.0
        ratio = self.damping.ratio(self.teeth.modes.frequency)
        heights = tooth_heights(self.teeth.modes, ratio, self.teeth.force, self.teeth.rate)
        return at_rim(heights, passages.number, passages.rim, self.teeth.angles)

    @cached_property
    def _said(self) -> bytes:
        parts = (self.modes.frequency, self.modes.shape, self.static, self.force, self.weights)
        damping = self.damping.ratio(self.modes.frequency)
        beside = [each for mode in self.beside for each in (mode.frequency, mode.ratio, *mode.reach)]
        given = np.array([self.step, self.speed, *beside])
        return b"".join(part.tobytes() for part in (*parts, damping, given))

    def __eq__(self, other: object) -> bool:
        """Repeats of a cut have the same ringing (apart from the teeth), so one cache serves all of them."""
        return isinstance(other, Ringing) and (self is other or self._said == other._said)

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        return hash(self._said)

    def at(self, heights: Array, passages: Passages) -> Array:
        """Interpolate ``heights`` (passes, n) at passages, (points, k)."""
        place = passages.along.T / self.speed / self.step
        before = np.clip(np.floor(place).astype(np.intp), 0, heights.shape[1] - 2)
        share = place - before
        low, high = heights[passages.number.T, before], heights[passages.number.T, before + 1]
        return np.asarray((low + share * (high - low)).T)


def _tuned(modes: TipModes, factor: float) -> TipModes:
    """Return the modes of a tip of the same stiffness whose frequencies are another by a factor."""
    return TipModes(modes.frequency * factor, modes.shape * factor, modes.inverse / factor)


def make_ringing(
    batch: Batch,
    run: str,
    path: Path,
    dynamics: TipDynamics | None,
    values: Mapping[str, float],
    *,
    full: Array,
    disc: float,
) -> Ringing | None:
    """Return the inputs of the transients of a face; None if the batch does not give all of them.

    ``full`` (3,) N: the mean force on the tool in full engagement, work frame. ``disc``: half axis of the
    discs of its points along the passes, m.
    """
    tool = cutting_force.cutter(batch)
    if dynamics is None or isinstance(tool, Refusal) or "size_mm" not in (batch.manifest.get("work") or {}):
        return None
    force, period, speed = force_over_period(batch, run, values, path, tool)
    fastest = float(_modes_at(dynamics, *path.start.T).frequency.max()) / (2 * math.pi)
    least = max(1 / STEP, PER_CYCLE * fastest, PER_CYCLE * speed / disc)  # samples per second
    samples = max(1, round(SEGMENT / speed * least))
    count = math.ceil(period * least / samples)
    x, y = _way(path, period, speed, (np.arange(count) + 0.5) / count)
    share = (np.arange(count)[:, None] * samples + np.arange(samples + 1)) / (count * samples)
    given = np.arange(len(force))
    loads = np.stack([np.interp(share * len(force), given, part) for part in force.T], axis=-1)
    step = period / (count * samples)
    return Ringing(
        _modes_at(dynamics, x, y),
        (dynamics.compliance(x, y) @ full)[:, 2],
        np.tile(loads, (len(path.start), 1, 1)),
        step,
        speed,
        len(path.start),
        disc_weights(disc / speed, step),
        dynamics.damping or SharedRatio(),
        _teeth(batch, run, path, tool, dynamics=dynamics, values=values),
        dynamics.beside,
    )


def _teeth(
    batch: Batch, run: str, path: Path, tool: Cutter, *, dynamics: TipDynamics, values: Mapping[str, float]
) -> Teeth | None:
    """Return the inputs of the tip's motion by the teeth; None if they pass too fast to move it."""
    middle = path.start + 0.5 * path.length[:, None] * [path.direction.real, path.direction.imag]
    si = np.array([values[name] for name in COEFFICIENTS]) * cutting_force.TO_SI
    force = force_basis(tool, EdgeLaw(), cutting_force.cut(batch, run, tool.radius)) @ si
    turn = cutting_force.turn_about_z(cmath.phase(path.direction))
    rate = 2 * math.pi * float(batch.runs["spindle_rpm"].astype(float)[run]) / 60
    teeth = Teeth(_modes_at(dynamics, *middle.T), force @ turn.T, rate, np.array(tool.tooth_angles))
    return teeth if teeth.slow else None


def _modes_at(dynamics: TipDynamics, x: Array, y: Array) -> TipModes:
    stiffness = np.asarray(np.linalg.inv(dynamics.compliance(x, y)), dtype=np.float64)
    return tip_modes(dynamics.mass(x, y), stiffness)


def _way(path: Path, period: float, speed: float, share: Array) -> tuple[Array, Array]:
    """Position of the tool at each ``share`` (n,) of the periods of all passes: (passes · n,) x and y, m.

    After a pass it moves straight to the start of the next one.
    """
    way = float(path.length.max())
    ahead = np.minimum(speed * period * share, way)[:, None]
    back = max(period - way / speed, np.finfo(float).tiny)
    returned = np.clip((period * share - way / speed) / back, 0.0, 1.0)[:, None]
    following = np.vstack([path.start[1:], path.start[-1:]])
    end = path.start[:, None] + ahead * [path.direction.real, path.direction.imag]
    place = end + returned * (following[:, None] - end)
    return place[..., 0].ravel(), place[..., 1].ravel()
