"""The height of the tip at every passage of the rim: by the load tests alone, and by any coefficients."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from metro.observables.flatness.beside import swung
from metro.observables.flatness.dynamics import ArmMode
from metro.observables.flatness.face_setting import FaceSetting
from metro.observables.flatness.rung import lossier, rung
from metro.surface.tip_stiffness import Basis, heights_design
from metro.units import Array


@lru_cache(maxsize=64)
def terms(basis: Basis, setting: FaceSetting) -> Array:
    """Return the basis' terms where the tool was at each passage, (n, k, terms)."""
    at = setting.passages
    parts = np.ascontiguousarray(basis(at.x.T.ravel(), at.y.T.ravel()).T)
    return parts.reshape(-1, *at.x.T.shape).T


@lru_cache(maxsize=64)
def static(basis: Basis, setting: FaceSetting) -> Array:
    """Return the static height of the tip by the load tests, at each passage, (n, k) m."""
    at = setting.passages
    rows = heights_design(basis, at.x.T.ravel(), at.y.T.ravel(), setting.force)
    return np.asarray((rows @ setting.loaded).reshape(at.x.T.shape).T)


@dataclass(frozen=True)
class Known:
    """What a fit says of the tip at a pose.

    Attributes
    ----------
    coefficients : (3 · terms,) of the compliance, m/N. harder : relative rise of the force, of which the
        compliance of the load tests says what it makes. tuning : of the frequencies. loss : damping ratio
        over the known one. beside : other modes that swing, and the parameters of each
        (:class:`metro.observables.flatness.beside.Beside`).
    """

    coefficients: tuple[float, ...]
    harder: float
    tuning: float
    loss: float
    beside: tuple[tuple[tuple[ArmMode, ...], tuple[float, ...]], ...]


# The derivatives by what is not of the tip are all taken where it is known to be the same.
@lru_cache(maxsize=64)
def tip(basis: Basis, setting: FaceSetting, known: Known) -> Array:
    """Return the height of the tip at each passage, (n, k) m, of one as stiff as in the load tests."""
    height = _along(terms(basis, setting), setting.force @ np.reshape(known.coefficients, (3, -1)))
    height = height + known.harder * (static(basis, setting) + rung(setting, known.tuning))
    height = height + known.loss * lossier(setting, known.tuning)
    for modes, reach in known.beside:
        height = height + _along(swung(modes, setting), np.array(reach))
    return height


def _along(parts: Array, values: Array) -> Array:
    """Return ``parts`` (n, k, p), of which each lies together in memory, times ``values`` (p,): (n, k)."""
    turned = parts.T
    return np.asarray((values @ turned.reshape(len(values), -1)).reshape(turned.shape[1:]).T)
