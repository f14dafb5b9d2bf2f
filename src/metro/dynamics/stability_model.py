"""All that the stability of a cut depends on, in parts that effects replace.

Softening needs no equation of its own: with mass and damping ratio constant, modes whose stiffness is ``f``
times as large are ``sqrt(f)`` times as fast. Depth over stiffness and speed over frequency are all that the
boundary depends on, so that at ``n`` it is ``f`` times what it is without softening at ``n / sqrt(f)``. With
``f`` of each speed, every speed has its own structure, and still all are solved as one stack. Where each mode
softens by its own, ``f`` is that of the first, and the structure has its modes at each speed. What yields the
more the deeper it cuts is solved for several ``f``: its boundary is where a depth and its ``f`` agree.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from metro.dynamics.by_depth import boundary_of_edge
from metro.dynamics.softening import Softening
from metro.dynamics.system import Cut, Structure
from metro.dynamics.zero_order import zero_order_boundary
from metro.units import Array

COMPLIANCES = np.geomspace(1.0, 4.0, 17)  # relative, at which a structure that yields with depth is solved
_DEPTHS = 300  # at which depth and compliance are compared
_ROUNDING = 1e-12
_FAR = 1e3  # stable at any depth: times the deepest boundary


@dataclass(frozen=True)
class StabilityModel:
    """Structure and cut at one place.

    Attributes
    ----------
    structure : modes of the tip, at standstill.
    cuts : the cut in each direction in which it is fed; the least stable counts.
    radius : of the tool, m.
    softening : changes of stiffnesses with the speed, which add up.
    yielding : relative growth of every compliance per m of depth; mass and damping ratio are constant.
    """

    structure: Structure
    cuts: tuple[Cut, ...]
    radius: float
    softening: tuple[Softening, ...] = ()
    yielding: float = 0.0

    @property
    def form(self) -> Hashable:
        """What models that are solved as one stack have in common."""
        cuts = [(replace(cut, damping=0.0), bool(cut.damping)) for cut in self.cuts]
        return (*self.structure.axis.tolist(), self.structure.directions.shape, *cuts)

    def boundary(self, rpm: Array) -> tuple[Array, Array]:
        """Lowest depths (k,), m, and chatter frequencies there (k,), Hz, at speeds (k,), rev/min.

        Raises
        ------
        ValueError
            When the stiffness vanishes at one of the speeds.
        """
        depth, hz = boundaries([self], rpm)
        return depth[0], hz[0]

    def _factors(self, rpm: Array) -> tuple[Array, Array]:
        """Return the factor (k,) on the stiffness of the first mode, and those of all over it (k, m)."""
        modes = len(self.structure.omega)
        every = np.ones((len(rpm), modes))
        for one in self.softening:
            every = every + one.of_modes(rpm, modes)
        if np.any(every <= 0.0):
            raise ValueError(f"no stiffness left at {np.max(rpm):g} rev/min")
        first = every[:, 0] if modes else np.ones(len(rpm))
        return first, every / first[:, None]


def _alike(ratio: Array) -> bool:
    """Return whether all modes change alike, but for rounding."""
    return bool(np.all(np.abs(ratio - 1.0) < _ROUNDING))


Solver = Callable[[Sequence[StabilityModel], Array, Array, Array], tuple[Array, Array]]


def boundaries(models: Sequence[StabilityModel], rpm: Array) -> tuple[Array, Array]:
    """Lowest depths (t, k), m, and chatter frequencies there (t, k), Hz, of t models at speeds (k,), rev/min.

    Models that differ by numbers alone are solved as one stack.

    Raises
    ------
    ValueError
        When the stiffness of a model vanishes at one of the speeds.
    """
    alike: dict[Hashable, list[int]] = {}
    for i, model in enumerate(models):
        alike.setdefault(model.form, []).append(i)
    depth, hz = np.zeros((2, len(models), len(rpm)))
    for which in alike.values():
        depth[which], hz[which] = _yielding([models[i] for i in which], rpm, _solved)
    return depth, hz


def estimated(models: Sequence[StabilityModel], rpm: Array) -> tuple[Array, Array]:
    """Lowest depths (t, k) and chatter frequencies there (t, k) of t models, to zeroth order.

    The models have equally many modes, and cuts that differ in process damping alone.
    """
    return _yielding(models, rpm, _estimated)


def _yielding(models: Sequence[StabilityModel], rpm: Array, solve: Solver) -> tuple[Array, Array]:
    """Solve models of which some may yield the more, the deeper they cut."""
    factor, ratio = (np.stack(part) for part in zip(*(one._factors(rpm) for one in models), strict=True))
    if not any(model.yielding for model in models):
        return solve(models, rpm, factor, ratio)
    count = len(COMPLIANCES)
    softer = (factor[:, None] / COMPLIANCES[:, None]).reshape(len(models), -1)
    depth, hz = solve(models, np.tile(rpm, count), softer, np.tile(ratio, (1, count, 1)))
    shape = (len(models), count, len(rpm))
    agreed = [
        _agreed(d, c, model.yielding)
        for d, c, model in zip(depth.reshape(shape), hz.reshape(shape), models, strict=True)
    ]
    return np.stack([d for d, _ in agreed]), np.stack([c for _, c in agreed])


def _solved(models: Sequence[StabilityModel], rpm: Array, factor: Array, ratio: Array) -> tuple[Array, Array]:
    """Solve models (t) of one form, with ``factor`` (t, k) times the stiffness of the first mode.

    ``ratio`` (t, k, m): of the factors of the modes to that.
    """
    slowed = (rpm / np.sqrt(factor)).ravel()
    structure = _stacked([one.structure for one in models], ratio)
    solved = []
    for own in zip(*(one.cuts for one in models), strict=True):
        damping = np.repeat([cut.damping for cut in own], len(rpm))
        cut = replace(own[0], damping=damping) if damping.any() else own[0]
        one = boundary_of_edge(structure, cut, slowed, factor.ravel())
        solved.append((one.depth, one.chatter_hz))
    depth, hz = _least(solved)
    return depth.reshape(factor.shape), np.sqrt(factor) * hz.reshape(factor.shape)


def _stacked(structures: Sequence[Structure], ratio: Array) -> Structure:
    """Structure with the modes of t structures at k speeds each, which ``ratio`` (t, k, m) stiffens."""
    if len(structures) == 1 and _alike(ratio):
        return structures[0]
    each = [one.stiffer(rows) for one, rows in zip(structures, ratio, strict=True)]
    omega, zeta, stiffness = (
        np.concatenate([getattr(one, part) for one in each]) for part in ("omega", "zeta", "stiffness")
    )
    directions = np.repeat([one.directions for one in structures], ratio.shape[1], axis=0)
    return Structure(structures[0].axis, omega, zeta, stiffness, directions)


def _estimated(
    models: Sequence[StabilityModel], rpm: Array, factor: Array, ratio: Array
) -> tuple[Array, Array]:
    """Estimate the boundaries (t, k) with ``factor`` (t, k) and ``ratio`` (t, k, m) of the stiffnesses."""
    structures = [model.structure for model in models]
    cuts, slowed = [model.cuts for model in models], rpm / np.sqrt(factor)
    if not _alike(ratio):  # every speed has a structure of its own
        structures = [one.stiffer(row) for one, rows in zip(structures, ratio, strict=True) for row in rows]
        cuts, slowed = [own for own in cuts for _ in rpm], slowed.reshape(-1, 1)
    depth, hz = _least([zero_order_boundary(structures, own, slowed) for own in zip(*cuts, strict=True)])
    return factor * depth.reshape(factor.shape), np.sqrt(factor) * hz.reshape(factor.shape)


def _least(boundaries: Sequence[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Depths and chatter frequencies of the least stable of several cuts."""
    depth, hz = (np.stack(part) for part in zip(*boundaries, strict=True))
    least = depth.argmin(axis=0)[None]
    lowest, there = (np.take_along_axis(part, least, axis=0)[0] for part in (depth, hz))
    return lowest, there


def _agreed(depth: Array, hz: Array, yielding: float) -> tuple[Array, Array]:
    """Lowest depths (k,) that are the boundary with the compliance that they make, and frequencies there.

    ``depth``, ``hz`` (c, k) of the boundary at :data:`COMPLIANCES`; ``yielding`` per m of depth.
    """
    known = np.isfinite(depth)
    if not known.any():
        return depth[0], hz[0]
    tried = np.geomspace(depth[known].min(), depth[known].max(), _DEPTHS)
    bounded = np.where(known, depth, _FAR * tried[-1])
    compliance, at = np.log(COMPLIANCES), np.log1p(yielding * tried)
    limit = np.stack([np.interp(at, compliance, column) for column in np.log(bounded).T], axis=1)
    beyond = np.log(tried)[:, None] - limit  # rises through zero at the boundary
    first = np.maximum(1, np.argmax(beyond >= 0.0, axis=0))
    below, above = (np.take_along_axis(beyond, (first - back)[None], axis=0)[0] for back in (1, 0))
    share = np.clip(below / np.minimum(below - above, -1e-12), 0.0, 1.0)
    depth_agreed = tried[first - 1] * (tried[first] / tried[first - 1]) ** share
    depth_agreed = np.where((beyond >= 0.0).any(axis=0), depth_agreed, np.inf)
    soft = np.log1p(yielding * np.minimum(depth_agreed, tried[-1]))
    return depth_agreed, np.array(
        [np.interp(c, compliance, column) for c, column in zip(soft, hz.T, strict=True)]
    )
