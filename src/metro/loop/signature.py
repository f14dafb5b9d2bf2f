"""What is left after a fit: where, how large, and whether it is more than noise and declared budget."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from metro.loop import noise as noise_room
from metro.loop.fit import Fit
from metro.observables.problem import Block
from metro.units import Array

FALSE_DISCOVERY = 0.01
LEAST_RATIO = 1.5


@dataclass(frozen=True)
class Line:
    """One place of the signature map.

    Attributes
    ----------
    axis, label : where. rms : of the rest there over the runs, SI; ``excess`` of it over the noise.
    relative : excess over the rms of the axis's signal. p_value, significant : after correction for all
        places.
    """

    axis: str
    label: str
    rms: float
    excess: float
    relative: float
    p_value: float
    significant: bool

    @property
    def ratio(self) -> float:
        """Mean square of the rest over what the noise lets one expect."""
        return self.rms**2 / max(self.rms**2 - self.excess**2, 1e-300)


def signature(fitted: Fit, least: float) -> list[Line]:
    """Test the rest of a fit, place by place (axis × label), against the noise without the misfit.

    A place counts when it is significant by Benjamini–Hochberg at 1 % over all places and its excess over the
    noise is at least ``least`` of the axis's signal.
    """
    places: dict[tuple[str, str], list[Array]] = {}
    signal: dict[str, float] = {}
    cut = [block for block in fitted.blocks if block.role != "calibrate"]
    for block in cut:
        seen = _seen_and_expected(fitted, block)
        labels = np.full(len(block.axis), "all") if block.labels is None else block.labels
        for axis in np.unique(block.axis):
            power = float(np.sum(block.measured[block.axis == axis] ** 2)) / block.repeats
            signal[str(axis)] = signal.get(str(axis), 0.0) + power
            for label in np.unique(labels[block.axis == axis]):
                chosen = (block.axis == axis) & (labels == label)
                places.setdefault((str(axis), str(label)), []).append(seen[:, chosen[: seen.shape[1]]])
    freedom = len(cut) + noise_room.PRIOR_RUNS
    lines = [_line(axis, label, parts, signal[axis], freedom) for (axis, label), parts in places.items()]
    accepted = discoveries([line.p_value for line in lines], FALSE_DISCOVERY)
    return [
        replace(line, significant=bool(found) and line.ratio > LEAST_RATIO and line.relative > least)
        for line, found in zip(lines, accepted, strict=True)
    ]


def _seen_and_expected(fitted: Fit, block: Block) -> Array:
    """Rest of a block averaged over its repeats, squared, and what is expected of it, (3, n / repeats).

    The last row is the part of the expectation that the whole run shares: it does not average out over the
    repeats.
    """
    strict = replace(fitted.noise, misfit={})
    matrix, offset = fitted.candidate.model(fitted.theta).design(block, fitted.nuisance[block.run])
    rest = (block.measured - offset - matrix @ fitted.beta).reshape(block.repeats, -1).mean(axis=0)
    alone = noise_room.diagonal(block, strict).reshape(block.repeats, -1).mean(axis=0) / block.repeats
    directions = noise_room.shared(block, strict, matrix, fitted.beta)
    common = (directions**2).sum(axis=1).reshape(block.repeats, -1).mean(axis=0)
    return np.array([rest**2, alone + common, common])


def _line(axis: str, label: str, parts: list[Array], signal: float, freedom: int) -> Line:
    """Test one place. What the runs share was estimated from as many runs, hence F and not chi-squared."""
    from scipy.stats import f

    seen, expected, common = np.concatenate(parts, axis=1)
    total = float(expected.sum())
    denominator = freedom * (total / max(float(common.sum()), 1e-6 * total)) ** 2
    p_value = float(f.sf(np.mean(seen / expected), len(seen), denominator))
    excess = max(0.0, float(seen.sum()) - total)
    relative = math.sqrt(excess / signal) if signal > 0 else 0.0
    runs = len(parts)
    return Line(axis, label, math.sqrt(seen.sum() / runs), math.sqrt(excess / runs), relative, p_value, False)


def discoveries(p_values: list[float], rate: float) -> Array:
    """Benjamini–Hochberg: which of the p-values are discoveries at a false discovery rate, (n,) bool."""
    p = np.asarray(p_values)
    order = np.argsort(p)
    passed = p[order] <= rate * np.arange(1, len(p) + 1) / len(p)
    last = int(np.max(np.flatnonzero(passed), initial=-1))
    accepted = np.zeros(len(p), dtype=bool)
    accepted[order[: last + 1]] = True
    return accepted


def in_words(lines: list[Line], most: int = 4) -> str:
    """Describe the significant places, largest first."""
    found = sorted((line for line in lines if line.significant), key=lambda line: -line.excess)
    parts = [
        f"{'all along' if line.label == 'all' else line.label} in {line.axis} "
        f"({100 * line.relative:.2g} % of the signal there)"
        for line in found[:most]
    ]
    more = f" and {len(found) - most} more places" if len(found) > most else ""
    return "; ".join(parts) + more
