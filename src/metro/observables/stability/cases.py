"""Stability models of the cuts whose tests have labels, which effects change.

A case is a place with measured modes and a cut that was made there. It is solved at the speeds of its tests.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from metro.dynamics import stability_model
from metro.dynamics.by_depth import boundary_of_edge
from metro.dynamics.stability_model import StabilityModel
from metro.observables.stability import boundary as stability
from metro.observables.stability.boundary import Cutting
from metro.observables.stability.errors import deviations, frequency_sd
from metro.observables.stability.positions import Tip
from metro.units import Array

NOWHERE = -1  # point of a test at a place where no modes were measured

Change = Callable[[StabilityModel], StabilityModel]
Solver = Callable[[Sequence[StabilityModel], Array], tuple[Array, Array]]


@dataclass(frozen=True)
class Case:
    """A cut at a place.

    Attributes
    ----------
    position : of the modes.
    model : without effects.
    rpm : (k,) rising speeds of its tests, rev/min.
    sd : (3 m + 2,) standard deviations of the logarithms of the modes' frequencies, damping ratios and
        stiffnesses, and of ktc and krc; NaN if not known.
    """

    position: str
    model: StabilityModel
    rpm: Array
    sd: Array

    def at(self, rpm: Array) -> Case:
        """Return the case at other speeds."""
        return replace(self, rpm=rpm)

    def deviations(self, draws: int, seed: int) -> Array:
        """Draws (draws, k) of the depth's logarithm from the errors of modes and coefficients."""
        errors, structure = deviations(self.sd, draws, seed), self.model.structure
        solved = [boundary_of_edge(structure, cut, self.rpm) for cut in self.model.cuts]
        lowest = np.min([one.depth for one in solved], axis=0)
        sampled = np.min([one.samples(structure, errors) for one in solved], axis=0)
        known = np.isfinite(lowest) & np.isfinite(sampled)
        return np.log(np.where(known, sampled, 1.0) / np.where(known, lowest, 1.0))


def _doubted(tip: Tip) -> Array:
    """Return deviations (3 m,) of a tip's modes; of frequencies also by what no scatter shows."""
    omega, *others = np.split(tip.sd, 3)
    mass = tip.structure.stiffness / tip.structure.omega**2
    return np.concatenate([frequency_sd(omega, mass), *others])


def boundaries(cases: Sequence[Case], changes: Sequence[Change]) -> tuple[Array, Array]:
    """Log depths and chatter frequencies (t, p), Hz, at all points, after each of t changes."""
    return _at_all_points(stability_model.boundaries, cases, changes)


def estimates(cases: Sequence[Case], changes: Sequence[Change]) -> tuple[Array, Array]:
    """Log depths and chatter frequencies (t, p), to zeroth order, after each of t changes."""
    return _at_all_points(stability_model.estimated, cases, changes)


def _at_all_points(solve: Solver, cases: Sequence[Case], changes: Sequence[Change]) -> tuple[Array, Array]:
    """Solve the models of all cases, whose points come one after another."""
    solved = [solve([change(case.model) for change in changes], case.rpm) for case in cases]
    depth, chatter = (np.concatenate(part, axis=1) for part in zip(*solved, strict=True))
    return np.log(depth), chatter


def cases_of(
    runs: pd.DataFrame, position: Mapping[str, str], tips: Sequence[Tip], cutting: Cutting
) -> tuple[tuple[Case, ...], np.ndarray]:
    """Cases of the tests, and the point (n,) of each test: its place among the speeds of all cases.

    Parameters
    ----------
    runs : (n) rows of the run table. position : of each run, by its name. tips : the measured structures.
    """
    made: list[Case] = []
    point = pd.Series(NOWHERE, index=runs.index)
    known, first = {tip.position: tip for tip in tips}, 0
    for name, here in runs.groupby(runs.index.map(position), sort=False):
        for same in stability.same_cut(here) if name in known else ():
            tip, rpm = known[str(name)], np.unique(same["spindle_rpm"].to_numpy(float))
            cuts = stability.cuts_of(same.iloc[0], cutting)[1]
            model = StabilityModel(tip.structure, cuts, cutting.tool.radius)
            made.append(Case(tip.position, model, rpm, np.concatenate([_doubted(tip), cutting.sd])))
            point[same.index] = first + np.searchsorted(rpm, same["spindle_rpm"].to_numpy(float))
            first += len(rpm)
    return tuple(made), point.to_numpy()
