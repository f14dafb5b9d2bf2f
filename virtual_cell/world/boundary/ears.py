"""Labels by ear: two people listen to a test, and do not always agree.

What they hear is how far the tip strays beyond what a deeper cut does anyway. Each has a threshold of his own
and judges the loudness with a scatter; where they disagree, the test is left undecided, or the first has his
way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from virtual_cell.units import Array

_OUT_OF_PROPORTION = 3.0  # times the forced vibration that the depth alone explains


@dataclass(frozen=True)
class Ears:
    """Two listeners.

    Attributes
    ----------
    thresholds : of the stray over the feed per tooth, of each, above which he says chatter.
    disagreement : share of the tests next to the boundary on which they differ.
    undecided : share of these that is left blank.
    mistaken : share of labels that are exchanged, wherever they are, beyond what is misheard.
    """

    thresholds: tuple[float, float]
    disagreement: float
    undecided: float
    mistaken: float = 0.0


def drawn(rng: np.random.Generator) -> Ears:
    """Draw listeners: 5 to 20 % disagreement, one to nine of ten disagreements left blank."""
    middle = float(np.exp(rng.uniform(math.log(0.15), math.log(0.4))))
    apart = float(np.exp(rng.normal(0.0, 0.15)))
    share = float(np.exp(rng.uniform(math.log(0.05), math.log(0.2))))
    return Ears((middle * apart, middle / apart), share, float(rng.uniform(0.1, 0.9)))


def loudness(
    tip: Array, depth: Array, shallowest: np.ndarray, *, per_turn: int, teeth: int, feed: float
) -> Array:
    """Loudness (n,) of tests: strays of the tip beyond the forced vibration, over the feed per tooth.

    Parameters
    ----------
    tip : (n, steps, 2) over whole turns, m. depth : (n,) m.
    shallowest : (n,) place of the shallowest test of the same cut: what is heard there is no chatter, and
        grows with the depth.
    per_turn : steps of a turn, a multiple of the teeth. feed : per tooth, m.
    """
    turns = tip.reshape(len(tip), -1, per_turn, 2)
    from_turn_to_turn = np.ptp(turns, axis=1).max(axis=(1, 2))
    passes = tip.reshape(len(tip), -1, per_turn // teeth, 2)
    from_tooth_to_tooth = np.ptp(passes, axis=1).max(axis=(1, 2))
    expected = from_tooth_to_tooth[shallowest] * depth / depth[shallowest]
    strays = np.maximum(from_turn_to_turn, from_tooth_to_tooth - _OUT_OF_PROPORTION * expected)
    return np.asarray(strays / feed)


def scatter_for(ears: Ears, loud: Array) -> float:
    """Scatter of the logarithm of the loudness at which the two differ on so many of these tests (n,)."""
    low, high = 7e-4, 30.0
    for _ in range(60):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if disagreement(ears, loud, middle) < ears.disagreement else (low, middle)
    return math.sqrt(low * high)


def disagreement(ears: Ears, loud: Array, scatter: float) -> float:
    """Share of tests (n,) on which the two differ, in the mean over their scatter."""
    one, two = (_says(loud, threshold, scatter) for threshold in ears.thresholds)
    return float(np.mean(one * (1.0 - two) + two * (1.0 - one)))


def _says(loud: Array, threshold: float, scatter: float) -> Array:
    from scipy.special import ndtr

    chance: Array = ndtr(np.log(np.maximum(loud, 1e-9) / threshold) / scatter)
    return chance


def labels(ears: Ears, loud: Array, scatter: float, rng: np.random.Generator) -> list[str]:
    """Labels of tests (n,): ``no`` (it chattered), ``yes`` (stable), or blank where the two left it open."""
    one, two = (rng.random(len(loud)) < _says(loud, threshold, scatter) for threshold in ears.thresholds)
    blank = (one != two) & (rng.random(len(loud)) < ears.undecided)
    wrong = np.zeros(len(loud), dtype=bool)
    count = max(1, round(ears.mistaken * len(loud))) if ears.mistaken else 0
    wrong[rng.permutation(len(loud))[:count]] = True
    says_no = one ^ wrong
    return ["" if left else ("no" if no else "yes") for left, no in zip(blank, says_no, strict=True)]
