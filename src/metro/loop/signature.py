"""What is left after a fit: where, how large, and whether it is more than noise and declared budget."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from metro.loop import noise as noise_room
from metro.loop.fit import Fit
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
    from scipy.stats import chi2

    strict = replace(fitted.noise, misfit={})
    square: dict[tuple[str, str], list[Array]] = {}
    signal: dict[str, float] = {}
    model = fitted.candidate.model(fitted.theta)
    for block in fitted.blocks:
        if block.role == "calibrate":
            continue
        matrix, offset = model.design(block, fitted.nuisance[block.run])
        rest = block.measured - offset - matrix @ fitted.beta
        directions = noise_room.shared(block, strict, matrix, fitted.beta)
        variance = noise_room.diagonal(block, strict) + (directions**2).sum(axis=1)
        labels = np.full(len(rest), "all") if block.labels is None else block.labels
        for axis in np.unique(block.axis):
            here = block.axis == axis
            signal[str(axis)] = (
                signal.get(str(axis), 0.0) + float(np.sum(block.measured[here] ** 2)) / block.repeats
            )
            for label in np.unique(labels[here]):
                chosen = here & (labels == label)
                mean = rest[chosen].reshape(block.repeats, -1).mean(axis=0)
                spread = variance[chosen].reshape(block.repeats, -1).mean(axis=0) / block.repeats
                square.setdefault((str(axis), str(label)), []).append(np.array([mean**2, spread]))
    lines = []
    for (axis, label), parts in square.items():
        seen, expected = np.concatenate(parts, axis=1)
        p_value = float(chi2.sf(np.sum(seen / expected), len(seen)))
        excess = math.sqrt(max(0.0, float(np.sum(seen - expected))))
        relative = excess / math.sqrt(signal[axis]) if signal[axis] > 0 else 0.0
        count = len(parts)
        lines.append(
            Line(
                axis,
                label,
                math.sqrt(seen.sum() / count),
                excess / math.sqrt(count),
                relative,
                p_value,
                False,
            )
        )
    accepted = discoveries([line.p_value for line in lines], FALSE_DISCOVERY)
    return [
        replace(line, significant=bool(found) and line.ratio > LEAST_RATIO and line.relative > least)
        for line, found in zip(lines, accepted, strict=True)
    ]


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
