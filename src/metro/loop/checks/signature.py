"""The residual of a fit: where, how large, and whether it is more than noise and declared budget."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from metro.loop.fitting import noise as noise_room
from metro.loop.fitting.fit import Fit
from metro.loop.statement import Statement
from metro.observables.problem import Block
from metro.units import Array

FALSE_DISCOVERY = 0.01
LEAST_RATIO = 1.5
# Of the least residual that counts: what the inputs of a model share scales its prediction, and few patterns
# are of that shape.
SHAPED = 0.35
FREE = 0.3  # share of a pattern that the zeros must leave


@dataclass(frozen=True)
class Line:
    """One place of the signature map.

    Attributes
    ----------
    axis, label : where. rms : of the residual there over the runs, SI; ``excess`` of it over the noise.
    signal : rms of the axis; ``relative``: excess over it. p_value, significant : after correction for all
        places.
    """

    axis: str
    label: str
    rms: float
    excess: float
    signal: float
    relative: float
    p_value: float
    significant: bool

    @property
    def ratio(self) -> float:
        """Mean square of the residual over what the noise lets one expect."""
        return self.rms**2 / max(self.rms**2 - self.excess**2, 1e-300)


def signature(fitted: Fit, least: float) -> list[Line]:
    """Test the residual of a fit, place by place (axis × label × how it changes), against the plain noise.

    The plain noise is that without the misfit. A place counts when it is significant by Benjamini–Hochberg at
    1 % over all places and its excess over the noise is at least ``least`` of the axis's signal, a share
    of that where it is of a shape of its own (a block's ``patterns``).
    """
    places: dict[tuple[str, str], list[Array]] = {}
    signal: dict[str, float] = {}
    shaped: set[str] = set()
    cut = [block for block in fitted.blocks if block.role != "calibrate"]
    for block in cut:
        labels = np.full(len(block.axis), "all") if block.labels is None else block.labels
        once = len(block.axis) // block.repeats
        for axis in np.unique(block.axis):
            power = float(np.sum(block.measured[block.axis == axis] ** 2)) / block.repeats
            signal[str(axis)] = signal.get(str(axis), 0.0) + power
        for change, seen in _by_change(fitted, block).items():
            for axis, label in sorted(set(zip(block.axis.tolist(), labels.tolist(), strict=True))):
                chosen = ((block.axis == axis) & (labels == label))[:once]
                name = f"{label}, {change}" if change else str(label)
                places.setdefault((str(axis), name), []).append(seen[:, chosen].reshape(3, -1))
        for name, seen in _by_pattern(fitted, block).items():
            places.setdefault((str(block.axis[0]), name), []).append(seen)
            shaped.add(name)

    def floor(line: Line) -> float:
        return least * SHAPED if line.label in shaped else least

    freedom = len(cut) + noise_room.PRIOR_RUNS
    lines = [_line(axis, label, parts, signal[axis], freedom) for (axis, label), parts in places.items()]
    accepted = q_values([line.p_value for line in lines]) <= FALSE_DISCOVERY
    return [
        replace(
            line, significant=bool(discovered) and line.ratio > LEAST_RATIO and line.relative > floor(line)
        )
        for line, discovered in zip(lines, accepted, strict=True)
    ]


def _by_change(fitted: Fit, block: Block) -> dict[str, Array]:
    """Residual of a block and what is expected of it, for what is steady ("") and each way it may change.

    Each (3, n / repeats, k): the square of the residual's component, the mean square expected of it, and the
    part of that which the whole run shares: that does not average out over the repeats.
    """
    strict = replace(fitted.noise, misfit={})
    model = fitted.candidate.model(fitted.theta)
    matrix, offset = model.design(block, fitted.nuisance[block.run], fitted.beta)
    repeats = block.repeats
    residual = (block.measured - offset - matrix @ fitted.beta).reshape(repeats, -1)
    directions = noise_room.shared(block, strict, matrix, fitted.beta).reshape(*residual.shape, -1)
    within = block.sigma.reshape(residual.shape) ** 2
    budget = noise_room.diagonal(block, strict).reshape(residual.shape) - within
    result = {}
    for name, functions in {"": np.ones((repeats, 1)), **block.slow}.items():
        unit = _orthonormal(functions, against=np.ones((repeats, 1)) if name else None)
        if not unit.shape[1]:  # what there is once does not change
            continue
        seen = np.einsum("kf,kn->nf", unit, residual) ** 2
        common = (np.einsum("kf,knd->nfd", unit, directions) ** 2).sum(axis=2)
        # The budget is the same in all repeats of a steady wave; what changes has it once per repeat.
        own = within + (budget if not name else budget / repeats)
        alone = np.einsum("kf,kn->nf", unit**2, own)
        result[name] = np.array([seen, alone + common, common]) / repeats
    return result


def _by_pattern(fitted: Fit, block: Block) -> dict[str, Array]:
    """Return what :func:`_by_change` does, of each pattern of a block, (3, k)."""
    if not block.patterns:
        return {}
    strict = replace(fitted.noise, misfit={})
    model = fitted.candidate.model(fitted.theta)
    matrix, offset = model.design(block, fitted.nuisance[block.run], fitted.beta)
    residual = block.measured - offset - matrix @ fitted.beta
    directions = noise_room.shared(block, strict, matrix, fitted.beta)
    variance = noise_room.diagonal(block, strict)
    result = {}
    for name, shape in block.patterns.items():
        # What the zeros leave of a shape says more: they are not known well. If they leave next to nothing,
        # it is tested against them.
        free = shape - block.zeros @ np.linalg.lstsq(block.zeros, shape, rcond=None)[0]
        beyond = np.linalg.norm(free) > FREE * np.linalg.norm(shape)
        unit = _orthonormal(free if beyond else shape, against=None)
        common = ((unit.T @ directions) ** 2).sum(axis=1)
        result[name] = np.array([(unit.T @ residual) ** 2, (unit**2).T @ variance + common, common])
    return result


def _orthonormal(functions: Array, against: Array | None) -> Array:
    """Columns of unit length, free of those ``against``; what vanishes then is left out."""
    if against is not None:
        functions = functions - against @ np.linalg.lstsq(against, functions, rcond=None)[0]
    left, size, _ = np.linalg.svd(functions, full_matrices=False)
    return np.asarray(left[:, size > 1e-6 * max(1e-300, size.max(initial=0.0))])


def _line(axis: str, label: str, parts: list[Array], signal: float, freedom: int) -> Line:
    """Test one place. What the runs share was estimated from as many runs, hence F and not chi-squared."""
    from scipy.stats import f

    seen, expected, common = np.concatenate(parts, axis=1)
    total = float(expected.sum())
    denominator = freedom * (total / max(float(common.sum()), 1e-6 * total)) ** 2
    p_value = float(f.sf(np.mean(seen / expected), len(seen), denominator))
    excess = max(0.0, float(seen.sum()) - total)
    relative = math.sqrt(excess / signal) if signal > 0 else 0.0
    rms, beyond, whole = (math.sqrt(power / len(parts)) for power in (seen.sum(), excess, signal))
    return Line(axis, label, rms, beyond, whole, relative, p_value, False)


def share_left(lines: Sequence[Line]) -> float:
    """Return what stands out of the noise and the budget, all places together, relative to the signal."""
    signal = {line.axis: line.signal**2 for line in lines}
    excess = sum(line.excess**2 for line in lines if line.significant)
    return math.sqrt(excess / sum(signal.values())) if excess else 0.0


def q_values(p_values: Sequence[float]) -> Array:
    """Least false discovery rate (n,) at which each of the p-values is a discovery (Benjamini–Hochberg)."""
    p = np.asarray(p_values, dtype=float)
    order = np.argsort(p)[::-1]
    rate = p[order] * len(p) / np.arange(len(p), 0, -1)
    q = np.empty(len(p))
    q[order] = np.minimum.accumulate(np.minimum(rate, 1.0))
    return q


def places(lines: Sequence[Line]) -> Statement | None:
    """State the significant places, largest first; None where there is none."""
    significant = sorted((line for line in lines if line.significant), key=lambda line: -line.excess)
    where = [{"axis": line.axis, "label": line.label, "relative": line.relative} for line in significant]
    return Statement("places", {"places": where}) if where else None
