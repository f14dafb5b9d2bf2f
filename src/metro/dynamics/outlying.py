"""Hits whose response does not follow from the force as that of the others does: they spoil a coherence."""

from __future__ import annotations

import numpy as np

from metro.units import Array, ComplexArray

_FEWEST = 4  # hits: of three it cannot be said which one differs
# In power. Of noise alone, on a single independent line of four hits, one exceeds the mean of the others so
# far in one of 800 cases (F distribution, 2 and 6 degrees of freedom); on sixteen lines never.
_FAR = 25.0
_SLIGHT = 0.05  # of a response: less is no other place, and remains in the scatter of the hits


def outlying(force: ComplexArray, response: ComplexArray) -> dict[int, str]:
    """Return which hits differ from the others, with the reason; spectra (hits, n).

    What the others' FRF leaves of a hit's response is compared with what it leaves of theirs, both as it is
    (noise does not depend on the blow) and relative to the response (errors that do).
    """
    kept, found = list(range(len(force))), {}
    while len(kept) >= _FEWEST:
        worst, theirs, its = _worst(force[kept], response[kept])
        if worst < 0:
            break
        found[kept.pop(worst)] = (
            f"its response differs by {100 * its:.2g} % from what the others make of its force, theirs by "
            f"{100 * theirs:.2g} %: another place or direction, or a loose sensor"
        )
    return found


def _worst(force: ComplexArray, response: ComplexArray) -> tuple[int, float, float]:
    """Return the hit that stands out, −1 if none does, and the relative misfit of the others and its own."""
    left = np.array([_left(force, response, i) for i in range(len(force))])
    size = np.sum(np.abs(response) ** 2, axis=1)
    worst = int(np.argmax(left / size))
    others = np.arange(len(force)) != worst
    own = np.array([_left(force[others], response[others], i) for i in range(len(force) - 1)])
    theirs, its = float(np.mean(own / size[others])), float(left[worst] / size[worst])
    far = left[worst] > _FAR * np.mean(own) and its > max(_FAR * theirs, _SLIGHT**2)
    return worst if far else -1, float(np.sqrt(theirs)), float(np.sqrt(its))


def _left(force: ComplexArray, response: ComplexArray, i: int) -> float:
    """Power of a hit's response that does not follow from its force by the FRF of the other hits."""
    others = np.arange(len(force)) != i
    power: Array = np.sum(np.abs(force[others]) ** 2, axis=0)
    frf = np.sum(force[others].conj() * response[others], axis=0) / power
    # the others' FRF has an error of its own, which adds to the hit's
    excess = 1.0 + np.abs(force[i]) ** 2 / power
    return float(np.sum(np.abs(response[i] - frf * force[i]) ** 2 / excess))
