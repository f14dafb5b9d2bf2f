"""A cause that the library lacks: the boundary is off by some smooth curve over the speeds.

An effect that explains labels better than nothing does may still be the wrong one: tests that tell no more
than "less stable than predicted" fit several causes, known or not. So every effect is weighed against this
curve, too. It has more freedom than an effect and pays for that in evidence: what an effect truly does is
more likely under the effect, what it only resembles is not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from metro.effects.effect import Effect, EffectParameter, Values
from metro.loop.hypotheses import Evidence, Hypothesis, hypothesis
from metro.units import Array

UNKNOWN = "another_cause"
# Standard deviations of the log depth by the polynomials of degree 0, 1, … over the logarithm of the speed:
# as large as what effects of the library do, and the less the more a curve bends.
_SD = (0.5, 0.4, 0.25, 0.2)
_MOST = 3.0  # standard deviations


@dataclass(frozen=True)
class Curve:
    """Log depth by which the boundary is off: coefficients of Legendre polynomials over the speeds tested."""

    coefficients: tuple[float, ...] = (0.0,) * len(_SD)


def _apply(curve: Curve, values: Values) -> Curve:
    added = zip(curve.coefficients, (values[f"degree_{i}"] for i in range(len(_SD))), strict=True)
    return replace(curve, coefficients=tuple(a + b for a, b in added))


EFFECT = Effect(
    name=UNKNOWN,
    observables=("lobes",),
    parameters=tuple(
        EffectParameter(f"degree_{i}", "1", -_MOST * sd, _MOST * sd, sd, (0.0,), plausible=sd)
        for i, sd in enumerate(_SD)
    ),
    apply=_apply,
    signature="The boundary lies higher or lower, by a factor that changes slowly with the speed.",
    literature="Kennedy and O'Hagan, J. R. Stat. Soc. B 63 (2001) 425: inadequacy as a smooth function",
    experiment="what would tell the effects of the library apart",
    resembled=True,
)


def unknown(nothing: Hypothesis, evidence: Evidence) -> Hypothesis:
    """Weigh the curve by the tests; chatter is heard where the base model has it."""
    depth, chatter = nothing.depth[0], nothing.chatter[0]
    shape = _shape(evidence.tests.rpm)

    def predict(change: Callable[[Curve], Curve]) -> tuple[Array, Array]:
        return depth + shape @ np.array(change(Curve()).coefficients), chatter

    def estimate(changes: Sequence[Callable[[Curve], Curve]]) -> tuple[Array, Array]:
        found = [predict(change) for change in changes]
        return np.stack([one for one, _ in found]), np.stack([one for _, one in found])

    return hypothesis((EFFECT,), replace(evidence, predict=predict, estimate=estimate))


def curves(found: Hypothesis, points: Array, rpm: Array) -> Array:
    """(t, k) log depth by which the boundary is off at speeds ``rpm``; ``points``: those of all tests."""
    return np.asarray(found.theta @ _shape(points, rpm).T)


def _shape(points: Array, rpm: Array | None = None) -> Array:
    """Legendre polynomials (k, d) over the logarithm of the speed, from −1 to 1 over all ``points``."""
    ends = np.log([points.min(), points.max()])
    half = max(0.5 * float(ends[1] - ends[0]), 1e-9)
    x = (np.log(points if rpm is None else rpm) - ends.mean()) / half
    return np.asarray(np.polynomial.legendre.legvander(x, len(_SD) - 1))
