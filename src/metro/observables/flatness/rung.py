"""The ringing of a face at every passage, for modes that are tuned higher or lower than the load tests say.

A tip whose stiffness is ``s`` times that of the load tests and whose mass is ``m`` times the declared one
rings like theirs, tuned by √(s/m), over s. So one interpolation over the tuning serves stiffness and mass
alike. Other effects on a face do not change its ringing: it is kept.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from metro.observables.flatness.face_setting import FaceSetting
from metro.observables.flatness.ringing import Ringing
from metro.surface.tip_damping import Raised
from metro.units import Array

FINE = 0.002  # relative change of the frequencies by which the slope of the ringing is taken
LOSSIER = 0.05  # higher damping ratio to which the slope of the ringing is taken: as much as arms have
NODES = 0.01  # spacing of nodes in the logarithm of the tuning, between which ringing is interpolated


@lru_cache(maxsize=256)
def rung(setting: FaceSetting, tuning: float) -> Array:
    """Height over the static one at each passage, (n, k) m, of a tip as stiff as in the load tests.

    It is already a mean along the feed, because its waves may be shorter than a disc.
    """
    ringing = setting.ringing
    if ringing is None:
        return np.zeros(setting.passages.along.shape)
    place = math.log(tuning) / NODES
    moved = sum(weight * _at_passages(setting, node) for node, weight in _cubic(place))
    of_teeth = ringing.tuned(tuning).of_teeth(setting.passages) if ringing.teeth else 0.0
    return np.asarray(moved + of_teeth)


def sharper(setting: FaceSetting, tuning: float, *, harder: float = 0.0, loss: float = 0.0) -> Array:
    """Return what the ringing gains per relative rise of the tip's frequencies, (n, k) m.

    It is that of :func:`rung` under a force that is ``harder`` by a share, with a damping ratio that is
    higher by ``loss``.
    """

    def ringing(step: float) -> Array:
        tuned = tuning * math.exp(step)
        return (1.0 + harder) * rung(setting, tuned) + (loss * lossier(setting, tuned) if loss else 0.0)

    return np.asarray((ringing(FINE) - ringing(-FINE)) / (2.0 * FINE))


def lossier(setting: FaceSetting, tuning: float) -> Array:
    """Return what the heights of :func:`rung` gain per damping ratio above the known one, (n, k) m."""
    return np.asarray((rung(_damped(setting), tuning) - rung(setting, tuning)) / LOSSIER)


@lru_cache(maxsize=64)
def _damped(setting: FaceSetting) -> FaceSetting:
    """Return a face with more damping; it is kept, because what is known of its ringing is kept with it."""
    ringing = setting.ringing
    if ringing is None:
        return setting
    return replace(setting, ringing=replace(ringing, damping=Raised(ringing.damping, LOSSIER)))


def _cubic(place: float) -> list[tuple[int, float]]:
    """Return the integers about a place, each with its weight in Lagrange's cubic interpolation."""
    if place == round(place):
        return [(round(place), 1.0)]
    first = math.floor(place) - 1
    share = place - first
    return [(first + i, math.prod((share - j) / (i - j) for j in range(4) if j != i)) for i in range(4)]


@lru_cache(maxsize=1024)
def _at_passages(setting: FaceSetting, node: int) -> Array:
    """Ringing at one node at each passage of a face, (n, k), kept: tunings nearby are made from the same."""
    ringing = setting.ringing
    assert ringing is not None
    return ringing.at(_moved(ringing, node), setting.middle)


@lru_cache(maxsize=1024)
def _moved(ringing: Ringing, node: int) -> Array:
    """Ringing at one node, kept: it takes long."""
    return ringing.tuned(math.exp(node * NODES)).moved()
