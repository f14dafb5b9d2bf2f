"""A cause that the library lacks: the boundary is off by a smooth curve over the speeds and over its depth.

An effect that explains labels better than nothing does may still be the wrong one: tests that show no more
than "less stable than predicted" fit several causes, known or not. So every effect is weighed against this
curve, too. It has more freedom than an effect and pays for that in evidence: what an effect truly does is
more likely under the effect, what it only resembles is not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from metro.effects.effect import Effect, EffectParameter, Values
from metro.loop.labels.hypotheses import Hypothesis, LabelEvidence, hypothesis
from metro.units import Array

UNKNOWN = "another_cause"
# Standard deviations of the log depth by the polynomials of degree 0, 1, … over the logarithm of the speed:
# as large as what effects of the library do, and the less the more a curve bends.
_SD = (0.5, 0.4, 0.25, 0.2)
_BY_DEPTH = 0.3  # and of how that changes with the predicted log depth: what yields, yields most in deep cuts
_NAMES = (*(f"degree_{i}" for i in range(len(_SD))), "by_depth")
_ALL_SD = (*_SD, _BY_DEPTH)
_MOST = 3.0  # standard deviations


@dataclass(frozen=True)
class Curve:
    """Log depth by which the boundary is off: Legendre polynomials over the speed, and by the depth."""

    coefficients: tuple[float, ...] = (0.0,) * len(_ALL_SD)


def _apply(curve: Curve, values: Values) -> Curve:
    added = zip(curve.coefficients, (values[name] for name in _NAMES), strict=True)
    return replace(curve, coefficients=tuple(a + b for a, b in added))


EFFECT = Effect(
    name=UNKNOWN,
    observables=("lobes",),
    parameters=tuple(
        EffectParameter(name, "1", -_MOST * sd, _MOST * sd, sd, (0.0,), plausible=sd)
        for name, sd in zip(_NAMES, _ALL_SD, strict=True)
    ),
    apply=_apply,
    signature="The boundary lies higher or lower, by a factor that changes slowly with speed and depth.",
    literature="Kennedy and O'Hagan, J. R. Stat. Soc. B 63 (2001) 425: inadequacy as a smooth function",
    experiment="a test that distinguishes the effects of the library",
    resembled=True,
)


def unknown(nothing: Hypothesis, evidence: LabelEvidence) -> Hypothesis:
    """Weigh the curve by the tests; chatter is heard where the base model has it."""
    depth, chatter = nothing.depth[0], nothing.chatter[0]
    tested = evidence.tests.rpm, evidence.testable(depth)
    shape = _shape(tested, tested)

    def predict(changes: Sequence[Callable[[Curve], Curve]]) -> tuple[Array, Array]:
        off = np.array([change(Curve()).coefficients for change in changes]) @ shape.T
        return depth + off, np.broadcast_to(chatter, off.shape)

    return hypothesis((EFFECT,), replace(evidence, predict=predict, estimate=predict))


Boundary = tuple[Array, Array]  # speeds and the base model's log depth there, (k,) each


def curves(curve: Hypothesis, tested: Boundary, asked: Boundary) -> Array:
    """(t, k) log depth by which the boundary is off where it is ``asked``; ``tested``: at all tests."""
    return np.asarray(curve.theta @ _shape(tested, asked).T)


def _shape(tested: Boundary, asked: Boundary) -> Array:
    """Legendre polynomials over the log speed, −1 to 1 over all tests; log depth less its mean; (k, d)."""
    ends = np.log([tested[0].min(), tested[0].max()])
    half = max(0.5 * float(ends[1] - ends[0]), 1e-9)
    x = (np.log(asked[0]) - ends.mean()) / half
    deeper = asked[1] - tested[1].mean()
    return np.column_stack([np.polynomial.legendre.legvander(x, len(_SD) - 1), deeper])
