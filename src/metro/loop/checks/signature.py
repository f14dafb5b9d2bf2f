"""The residual of a fit: where, how large, and whether it is more than noise and declared budget."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from metro.loop.checks.left_out import parameter_errors
from metro.loop.fitting import noise as noise_room
from metro.loop.fitting.fit import Fit
from metro.loop.statement import Statement
from metro.observables.problem import Block
from metro.units import Array

FALSE_DISCOVERY = 0.01  # rate over all places at which a residual is significant
LEAST_RATIO = 1.5  # of its mean square to that of the noise, below which a place does not count
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


@dataclass(frozen=True, eq=False)
class _Left:
    """What a fit leaves of a block, and what is expected of that.

    ``residual`` (n,); ``directions`` (n, k) of the errors that the whole run shares, ``variance`` (n,) of
    those that nothing shares, by the noise without a misfit.
    """

    block: Block
    residual: Array
    directions: Array
    variance: Array


def signature(fitted: Fit, least: float) -> list[Line]:
    """Test the residual of a fit on its own runs, place by place (axis × label × how it changes).

    It is compared with the plain noise, which is that without the misfit. A place counts when it is
    significant by Benjamini–Hochberg at 1 % over all places and its excess over the noise is at least
    ``least`` of the axis's signal, a share of that where it is of a shape of its own (a block's
    ``patterns``).
    """
    cut = [block for block in fitted.blocks if block.role != "calibrate"]
    return _lines([[_left(fitted, block)] for block in cut], least, as_one=False)


def unseen_signature(scored: Sequence[Fit], least: float) -> list[Line]:
    """Test in the same way what fits leave of runs that they have not seen (:func:`left_out.unseen`).

    The errors of the fitted parameters are expected there as well. They are the same in all runs of a
    condition, so that these count as one.
    """
    conditions: dict[str, list[_Left]] = {}
    for fitted in scored:
        for block in fitted.blocks:
            left = _left(fitted, block, parameter_errors(fitted, block))
            conditions.setdefault(block.condition, []).append(left)
    return _lines(list(conditions.values()), least, as_one=True)


def _left(fitted: Fit, block: Block, further: Array | None = None) -> _Left:
    """Return what a fit leaves of a block; ``further`` (n, k): directions of errors beside those of a run."""
    strict = fitted.noise.sound
    model = fitted.candidate.model(fitted.theta)
    matrix, offset = model.design(block, fitted.nuisance[block.run], fitted.beta)
    directions = noise_room.shared(block, strict, matrix, fitted.beta)
    if further is not None:
        directions = np.hstack([directions, further])
    residual = block.measured - offset - matrix @ fitted.beta
    return _Left(block, residual, directions, noise_room.diagonal(block, strict))


def _lines(units: Sequence[Sequence[_Left]], least: float, *, as_one: bool) -> list[Line]:
    """Test every place over units of evidence: runs, or conditions, of which all that is seen counts once."""
    places: dict[tuple[str, str], list[Array]] = {}
    signal: dict[str, float] = {}
    shaped: set[str] = set()
    for unit in units:
        together: dict[tuple[str, str], list[Array]] = {}
        for left in unit:
            for axis, power in _power(left.block).items():
                signal[axis] = signal.get(axis, 0.0) + power / len(unit)
            for key, seen in _by_place(left).items():
                together.setdefault(key, []).append(seen)
            for name, seen in _by_pattern(left).items():
                together.setdefault((str(left.block.axis[0]), name), []).append(seen)
                shaped.add(name)
        for key, parts in together.items():
            places.setdefault(key, []).append(_as_one(parts, len(unit)) if as_one else parts[0])

    def floor(line: Line) -> float:
        return least * SHAPED if line.label in shaped else least

    freedom = len(units) + noise_room.PRIOR_RUNS
    lines = [_line(axis, label, parts, signal[axis], freedom) for (axis, label), parts in places.items()]
    accepted = q_values([line.p_value for line in lines]) <= FALSE_DISCOVERY
    return [
        replace(
            line, significant=bool(discovered) and line.ratio > LEAST_RATIO and line.relative > floor(line)
        )
        for line, discovered in zip(lines, accepted, strict=True)
    ]


def _as_one(parts: Sequence[Array], runs: int) -> Array:
    """Return a place of the runs of a condition as one piece of evidence, (3, 1): what a run holds of it."""
    return np.asarray(np.concatenate(parts, axis=1).sum(axis=1, keepdims=True) / runs)


def _power(block: Block) -> dict[str, float]:
    """Sum of squares of the signal of a block by axis, of one of its repeats."""
    return {
        str(axis): float(np.sum(block.measured[block.axis == axis] ** 2)) / block.repeats
        for axis in np.unique(block.axis)
    }


def _by_place(left: _Left) -> dict[tuple[str, str], Array]:
    """Return what :func:`_by_change` does, of each axis and label of a block, (3, k)."""
    block = left.block
    labels = np.full(len(block.axis), "all") if block.labels is None else block.labels
    once = len(block.axis) // block.repeats
    result = {}
    for change, seen in _by_change(left).items():
        for axis, label in sorted(set(zip(block.axis.tolist(), labels.tolist(), strict=True))):
            chosen = ((block.axis == axis) & (labels == label))[:once]
            name = f"{label}, {change}" if change else str(label)
            result[str(axis), name] = seen[:, chosen].reshape(3, -1)
    return result


def _by_change(left: _Left) -> dict[str, Array]:
    """Residual of a block and what is expected of it, for what is steady ("") and each way it may change.

    Each (3, n / repeats, k): the square of the residual's component, the mean square expected of it, and the
    part of that which the whole run shares: that does not average out over the repeats.
    """
    block, repeats = left.block, left.block.repeats
    residual = left.residual.reshape(repeats, -1)
    directions = left.directions.reshape(*residual.shape, -1)
    within = block.sigma.reshape(residual.shape) ** 2
    budget = left.variance.reshape(residual.shape) - within
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


def _by_pattern(left: _Left) -> dict[str, Array]:
    """Return what :func:`_by_change` does, of each pattern of a block, (3, k)."""
    block, result = left.block, {}
    for name, shape in block.patterns.items():
        # What the zeros leave of a shape says more: they are not known well. If they leave next to nothing,
        # it is tested against them.
        free = shape - block.zeros @ np.linalg.lstsq(block.zeros, shape, rcond=None)[0]
        beyond = np.linalg.norm(free) > FREE * np.linalg.norm(shape)
        unit = _orthonormal(free if beyond else shape, against=None)
        common = ((unit.T @ left.directions) ** 2).sum(axis=1)
        expected = (unit**2).T @ left.variance + common
        result[name] = np.array([(unit.T @ left.residual) ** 2, expected, common])
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
