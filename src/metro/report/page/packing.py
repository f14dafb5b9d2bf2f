"""Numbers for a page: only as many and only as fine as the page can show."""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from metro.report.numbers import listing
from metro.units import JSON, Array

Indices = npt.NDArray[np.intp]

STEPS = 65534  # of the span of a curve; the code after the last step means that there is no value
PARTS = 200  # into which a long curve is cut
LONG = 6 * PARTS  # places that a curve may have before it is thinned
GAP = 8  # median steps of a curve that make a gap, over which no line is drawn
THINNED = "of long curves the lowest and the highest of every line in each of 200 equal parts is drawn"


def packed(values: Array) -> JSON:
    """Return values as 16-bit steps of their span, in base64; the error is at most 1/131 068 of the span."""
    known = np.isfinite(values)
    low, high = (float(values[known].min()), float(values[known].max())) if known.any() else (0.0, 0.0)
    share = np.divide(values - low, (high - low) or 1.0, out=np.zeros(len(values)), where=known)
    code = np.where(known, np.rint(STEPS * share), STEPS + 1).astype("<u2")
    return {"low": low, "high": high, "data": base64.b64encode(code.tobytes()).decode()}


def gaps(x: Array) -> Indices:
    """Return the places (of a coordinate in rising order) that come after a gap: eight median steps."""
    step = np.diff(x)
    known = step[step > 0]
    return 1 + np.flatnonzero(step > GAP * np.median(known)) if known.size else np.zeros(0, dtype=np.intp)


def kept(lines: Sequence[Array], after: Indices | None = None) -> Indices:
    """Return the places of a curve that are drawn: in each of 200 equal parts, every line's extremes.

    Parameters
    ----------
    lines : (n,) each. All n places are kept if there are no more than six times as many as parts.
    after : places after a gap: they and the places before the gap are kept.
    """
    count = len(lines[0])
    if count <= LONG:
        return np.arange(count)
    places = [np.array([0, count - 1])]
    if after is not None:
        places += [after - 1, after]
    for part in np.array_split(np.arange(count), PARTS):
        for line in lines:
            at = part[np.isfinite(line[part])]
            if at.size:
                places.append(at[[int(line[at].argmin()), int(line[at].argmax())]])
    return np.unique(np.concatenate(places))


def decimals(half_width: float, largest: float) -> int:
    """Return the decimals of a value: two digits of its interval's half width, else three of the largest."""
    known = math.isfinite(half_width) and half_width > 0
    size, digits = (half_width, 2) if known else (largest, 3)
    if not math.isfinite(size) or size <= 0:
        return 0
    return digits - 1 - math.floor(math.log10(float(f"{size:.{digits - 1}e}")))


def fitting(entries: Sequence[JSON], budget: int, worth: Sequence[float]) -> list[JSON]:
    """Return the entries of most worth whose JSON fits into ``budget`` bytes, in their order."""
    chosen: set[int] = set()
    left = budget
    for i in sorted(range(len(entries)), key=lambda i: (-worth[i], i)):
        left -= len(json.dumps(entries[i]))
        if left < 0 and chosen:
            break
        chosen.add(i)
    return [entries[i] for i in sorted(chosen)]


def left_out(shown: int, of: int, what: str, where: str) -> str:
    """Say that only a part of the runs is shown; empty if all are."""
    return "" if shown == of else f"{shown} of {of} {what} are shown, {where}; the table holds all"


def notes(*remarks: str) -> str:
    """Join remarks to one sentence; empty if there are none."""
    text = listing([each for each in remarks if each])
    return text[:1].upper() + text[1:] + "." if text else ""


def rms_by_run(residual: Array, run: npt.NDArray[np.str_]) -> dict[str, float]:
    """Return the root mean square of every run's residual."""
    return {str(name): float(np.sqrt(np.nanmean(residual[run == name] ** 2))) for name in np.unique(run)}
