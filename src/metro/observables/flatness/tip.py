"""The height of the tip at every passage of the rim: by the load tests alone, and by any coefficients."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from metro.observables.flatness.rung import lossier, rung
from metro.surface.tip_stiffness import Basis, heights_design
from metro.units import Array

if TYPE_CHECKING:
    from metro.observables.flatness.model import FaceSetting


@lru_cache(maxsize=64)
def terms(basis: Basis, setting: FaceSetting) -> Array:
    """Return the basis' terms where the tool was at each passage, (n, k, terms)."""
    at = setting.passages
    return np.asarray(basis(at.x.T.ravel(), at.y.T.ravel()).T.reshape(-1, *at.x.T.shape).T)


@lru_cache(maxsize=64)
def static(basis: Basis, setting: FaceSetting) -> Array:
    """Return the static height of the tip by the load tests, at each passage, (n, k) m."""
    at = setting.passages
    rows = heights_design(basis, at.x.T.ravel(), at.y.T.ravel(), setting.force)
    return np.asarray((rows @ setting.loaded).reshape(at.x.T.shape).T)


# The derivatives by what is not of the tip are all taken at the same coefficients.
@lru_cache(maxsize=64)
def tip(
    basis: Basis,
    setting: FaceSetting,
    coefficients: tuple[float, ...],
    harder: float,
    ringing: tuple[float, float],
) -> Array:
    """Return the height of the tip at each passage, (n, k) m, of one as stiff as in the load tests.

    Parameters
    ----------
    coefficients : (3 · terms,) of the compliance, m/N. harder : relative rise of the force, of which the
        compliance of the load tests says what it makes. ringing : tuning, and damping ratio over the known
        one.
    """
    tuning, loss = ringing
    height = terms(basis, setting) @ (setting.force @ np.reshape(coefficients, (3, -1)))
    height = height + harder * (static(basis, setting) + rung(setting, tuning))
    return np.asarray(height + loss * lossier(setting, tuning))
