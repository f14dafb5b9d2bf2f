"""Whether the base parameters differ between conditions by more than between the repeats of one condition.

What a model lacks may have the shape of its own parameters (a depth that is not the nominal one, a force law
that depends on the speed): it passes for scatter between runs, unless repeats scatter less.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.loop.fitting import noise as noise_room
from metro.loop.fitting.expectation import amplitude
from metro.loop.fitting.fit import Fit
from metro.observables.problem import Block
from metro.units import Array

DETERMINED = (
    0.05  # how well a run must determine a parameter for its deviation to count, as a share of the scatter
)


@dataclass(frozen=True)
class Between:
    """Differences between conditions.

    ``relative``: rms change of the prediction over the signal, beyond what the repeats let one expect;
    ``condition``: where it is largest; ``p_value``: of differences as large if there were none.
    """

    relative: float
    condition: str
    p_value: float


def between_conditions(fitted: Fit) -> Between | None:
    """Compare the conditions' deviations of the base parameters with those of the repeats.

    An analysis of variance of each run's expected deviations, each in units of its own spread, with as many
    degrees of freedom per run as it determines parameters. None where no condition is repeated.
    """
    from scipy.stats import f

    groups: dict[str, list[Block]] = {}
    for block in fitted.blocks:
        if block.role != "calibrate":
            groups.setdefault(block.condition, []).append(block)
    runs = sum(map(len, groups.values()))
    if runs == len(groups) or len(groups) < 2 or not len(fitted.noise.scattering):
        return None
    among, within, determined, size, expected = 0.0, 0.0, 0.0, {}, 0.0
    for name, blocks in groups.items():
        scaled, moved, power, share = (
            np.array(part) for part in zip(*(_deviations(fitted, block) for block in blocks), strict=True)
        )
        determined += float(share.sum())
        among += len(blocks) * float(np.sum(scaled.mean(axis=0) ** 2))
        within += float(np.sum((scaled - scaled.mean(axis=0)) ** 2))
        size[name] = _power(moved.mean(axis=0)[None], power.mean(axis=0))
        expected += _power(moved - moved.mean(axis=0), power.mean(axis=0))
    each, more, other = determined / runs, len(groups) - 1, runs - len(groups)
    beyond = float(np.mean(list(size.values()))) - expected / other * len(groups) / runs
    ratio = among / more / max(within / other, 1e-300)
    return Between(
        relative=float(np.sqrt(max(0.0, beyond))),
        condition=max(size, key=lambda name: size[name]),
        p_value=float(f.sf(ratio, each * more, each * other)),
    )


def _power(moved: Array, power: Array) -> float:
    """Relative mean square of what deviations (k, p) change in the prediction."""
    return float(np.einsum("ki,ij,kj->", moved, power, moved))


def _deviations(fitted: Fit, block: Block) -> tuple[Array, Array, Array, Array]:
    """Return a run's deviations of the p scattering parameters, by their own spread and by the scatter.

    Then the mean square of what a unit of the second changes, over that of the signal, (p, p), and which
    share of the scatter of each parameter that the run determines, (p,).
    """
    model = fitted.candidate.model(fitted.theta)
    matrix, offset = model.design(block, fitted.nuisance[block.run], fitted.beta)
    directions = noise_room.shared(block, fitted.noise, matrix, fitted.beta)
    residual = block.measured - offset - matrix @ fitted.beta
    deviation, uncertain = amplitude(directions, residual, noise_room.diagonal(block, fitted.noise))
    p = len(fitted.noise.scattering)
    share = 1.0 - np.diag(uncertain)[:p]
    scaled = np.where(share > DETERMINED, deviation[:p] / np.sqrt(np.maximum(share, DETERMINED)), 0.0)
    unit = directions[:, :p] / np.linalg.norm(block.measured)
    return scaled, deviation[:p], unit.T @ unit, share
