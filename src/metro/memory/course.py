"""The course of a parameter over batches: constant, a trend, a step, a curve; and the next batch's value.

Whether the parameter changes at all is one permutation test over the order of the batches. It compares the
best of all shapes with the best of all shapes, so it is exact for every distribution. The shapes have weights
by Akaike's criterion for small samples (Burnham and Anderson, Model Selection, 2nd ed. (2002), 6.4). The
prediction is the mean of all shapes by these weights, not the best shape.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.memory.regression import Mixture, Regression, mixture, regress
from metro.units import Array

ENOUGH = 5  # batches, from which on a change is tested for
DRAWS, SEED = 9999, 1  # of the permutations of the batches
_CURVES = 6  # time constants
_ASIDE = 2  # least number of batches on either side of a step
# Parameters of each shape: level, change, its place or time constant, and the scatter between batches.
SIZES = {"constant": 2, "trend": 3, "step": 4, "levels off": 4, "accelerates": 4}


@dataclass(frozen=True)
class Shape:
    """One course: ``kind`` of ``SIZES``; ``place`` of the first batch after a step, or the time constant."""

    kind: str
    place: float = 1.0

    def __call__(self, u: Array) -> Array:
        """Rise (n,) at places u (n,), 0 … 1 over the batches."""
        return {
            "constant": np.zeros_like(u),
            "trend": u,
            "step": (u >= self.place).astype(float),
            "levels off": 1.0 - np.exp(-u / self.place),
            "accelerates": np.exp((u - 1.0) / self.place),
        }[self.kind]


@dataclass(frozen=True)
class Course:
    """What n batches show of the course of a parameter.

    Attributes
    ----------
    p_value : of the hypothesis that the order does not matter; None for fewer than ``ENOUGH`` batches.
    weights : by kind of course, adding up to one.
    change : rise of the likeliest course that changes, from its first batch to its last: low, middle, high.
    before_step : index of the last batch before a step.
    track : (n, 3) the parameter's course at each batch: low, middle, high.
    after : (3,) low, middle, high of what the next batch will measure, at ``next_at``.
    scatter : posterior mean of the deviation between batches, beyond the errors that they state.
    """

    p_value: float | None
    weights: dict[str, float]
    kind: str
    change: tuple[float, float, float] | None
    before_step: int | None
    track: Array
    next_at: float
    after: Array
    scatter: float


def shapes(u: Array) -> list[Shape]:
    """Return every course that batches at rising places u (n,) could distinguish from the others."""
    if len(u) < ENOUGH:
        return [Shape("constant")]
    steps = [Shape("step", float(u[k])) for k in range(_ASIDE, len(u) - _ASIDE + 1) if u[k] > u[k - 1]]
    constants = np.geomspace(1.0 / (len(u) - 1), 0.7, _CURVES)
    curves = [Shape(kind, float(c)) for kind in ("levels off", "accelerates") for c in constants]
    return [Shape("constant"), Shape("trend"), *steps, *curves]


def course(t: Array, y: Array, s: Array) -> Course:
    """Follow a parameter y ± s (n,) over batches at times t (n,), which rise and are not all the same.

    ``s`` are standard deviations of the errors within the batches.
    """
    span = float(t[-1] - t[0])
    u = (t - t[0]) / span
    ahead = float(np.median(np.diff(u)))
    asked = shapes(u)
    rise = np.array([shape(u) for shape in asked])
    flat = regress(np.ones((1, len(u), 1)), y, s)
    fitted = [flat]
    if len(asked) > 1:
        fitted.append(regress(np.stack([np.ones_like(rise[1:]), rise[1:]], axis=2), y, s))
    weight = _weights(asked, np.concatenate([each.log_likelihood for each in fitted]), len(u))
    places = np.append(u, 1.0 + ahead)
    curve = _joined(fitted, asked, weight, places[:-1])
    coming = _joined(fitted, asked, weight, places[-1:], scatter=True, error=float(np.median(s)))
    scatter = float(sum(w @ (f.share @ f.tau) for w, f in zip(np.split(weight, [1]), fitted, strict=False)))
    by_kind = {
        kind: float(sum(w for shape, w in zip(asked, weight, strict=True) if shape.kind == kind))
        for kind in dict.fromkeys(shape.kind for shape in asked)
    }
    changing = {kind: w for kind, w in by_kind.items() if kind != "constant"}
    kind = max(changing, key=lambda name: changing[name]) if changing else "constant"
    change, before = None, None
    if changing:
        chosen = [i for i, shape in enumerate(asked) if shape.kind == kind]
        best = max(chosen, key=lambda i: weight[i])
        if kind == "step":
            before = int(np.argmax(u >= asked[best].place)) - 1
        size = (rise[best][-1] - rise[best][0]) * np.array([[[0.0, 1.0]]])
        single = regress(np.stack([np.ones_like(u), rise[best]], axis=1)[None], y, s)
        low, middle, high = (float(v[0]) for v in mixture(single, size, np.ones(1)).interval())
        change = (low, middle, high)
    return Course(
        p_value=_p_value(rise[1:], y, s, float(flat.share[0] @ flat.tau)) if changing else None,
        weights=by_kind,
        kind=kind,
        change=change,
        before_step=before,
        track=np.stack(curve.interval(), axis=1),
        next_at=float(t[-1]) + ahead * span,
        after=np.stack(coming.interval(), axis=1)[0],
        scatter=scatter,
    )


def _weights(asked: list[Shape], log_likelihood: Array, n: int) -> Array:
    """Akaike weight (k,) of each course; the courses of a kind share the weight of the best of them."""
    kinds = np.array([shape.kind for shape in asked])
    weight = np.zeros(len(asked))
    for kind in dict.fromkeys(kinds.tolist()):
        own, size = kinds == kind, SIZES[kind]
        if n - size - 1 <= 0:
            continue
        best = log_likelihood[own].max()
        penalty = size + size * (size + 1) / (n - size - 1)
        share = np.exp(log_likelihood[own] - best)
        weight[own] = np.exp(best - penalty - log_likelihood.max()) * share / share.sum()
    if not weight.any():
        weight[0] = 1.0
    return np.asarray(weight / weight.sum())


def _joined(
    fitted: list[Regression],
    asked: list[Shape],
    weight: Array,
    places: Array,
    *,
    scatter: bool = False,
    error: float = 0.0,
) -> Mixture:
    """Return the mixture of all courses at ``places`` (q,)."""
    rise = np.array([shape(places) for shape in asked])[:, :, None]
    parts = []
    for first, each in zip((0, 1), fitted, strict=False):
        own = slice(0, 1) if first == 0 else slice(1, None)
        rows = np.ones_like(rise[own]) if first == 0 else np.insert(rise[own], 0, 1.0, axis=2)
        share = weight[own].sum()
        if share > 0.0:
            parts.append((share, mixture(each, rows, weight[own], scatter=scatter, error=error)))
    return Mixture(
        np.concatenate([share * part.weight for share, part in parts]),
        np.concatenate([part.mean for _, part in parts]),
        np.concatenate([part.sd for _, part in parts]),
    )


def _p_value(rise: Array, y: Array, s: Array, tau: float) -> float:
    """Share of the permutations in which the best of the courses (k, n) fits as well as in the real order.

    A batch keeps its error, so that its value and weight stay together; the mean over all batches does not
    depend on the order.
    """
    rng = np.random.default_rng(SEED)
    weight = 1.0 / (s**2 + tau**2)
    residual = weight * (y - weight @ y / weight.sum())
    order = rng.permuted(np.tile(np.arange(len(y)), (DRAWS, 1)), axis=1)
    order = np.concatenate([np.arange(len(y))[None], order])
    drawn, total = weight[order], weight.sum()
    spread = drawn @ (rise**2).T - (drawn @ rise.T) ** 2 / total
    gain = ((residual[order] @ rise.T) ** 2 / spread).max(axis=1)
    return float(np.mean(gain >= gain[0] * (1.0 - 1e-9)))
