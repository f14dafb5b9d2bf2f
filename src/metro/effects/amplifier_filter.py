"""Amplifier filter: a low-pass filter that is not declared weakens and delays what changes fast."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from metro.effects.effect import Effect, EffectParameter, Values
from metro.observables.force.model import ForceModel
from metro.observables.force.terms import Term
from metro.units import Array, ComplexArray

LOWEST, OPEN = 50.0, 20000.0  # Hz
STARTS = tuple(round(200.0 * 1.25**i, 1) for i in range(14))


@dataclass(frozen=True)
class LowPass(Term):
    """All channels pass a Butterworth filter of a ``corner``, Hz, and an ``order``."""

    corner: float
    order: float

    def gain(self, model: Any, setting: Any, orders: int) -> ComplexArray | None:
        """Return the response at the orders of the spindle: the frame of a hole turns slowly against it."""
        del model
        if self.corner >= OPEN:
            return None
        return _gain(self, setting.recording.speed, orders)


@lru_cache(maxsize=1024)
def _gain(filtered: LowPass, speed: float, orders: int) -> ComplexArray:
    """Return the response (orders, 3) at the orders of a ``speed``, rev/s: read-only, it is kept."""
    hertz = np.arange(orders, dtype=float) * speed
    response = butterworth(hertz / filtered.corner, filtered.order)
    return np.broadcast_to(response[:, None], (orders, 3))


def butterworth(ratio: Array, order: float) -> ComplexArray:
    """Return the response at frequencies over the corner's, for orders from one.

    That of an order n is the product of −p/(s − p) over the poles p = exp iπ(2k + n + 1)/2n, k = 0…n − 1.
    Between two orders its logarithm is a cubic in the order, with the slope at either as between its
    neighbours: along straight lines a descent would meet a bend at each filter that there is.
    """
    below = math.floor(order)
    share = order - below
    rest = 1.0 - share
    near, low, high, far = (_logarithm(ratio, below + step) for step in (-1, 0, 1, 2))
    straight = rest * low + share * high
    bent = rest * (2.0 * low - near - high) + share * (2.0 * high - low - far)
    return np.asarray(np.exp(straight + 0.5 * share * rest * bent))


def _logarithm(ratio: Array, order: int) -> ComplexArray:
    poles = _poles(order)
    return np.asarray(-np.log(1.0 - 1j * ratio[:, None] / poles).sum(axis=1))


@lru_cache(maxsize=16)
def _poles(order: int) -> ComplexArray:
    return np.asarray(np.exp(1j * math.pi * (2.0 * np.arange(order) + order + 1.0) / (2.0 * order)))


def apply(model: ForceModel, values: Values) -> ForceModel:
    """Put a filter between the sensor and the record."""
    return model.with_term(LowPass(values["corner_hz"], values["order"]))


EFFECT = Effect(
    name="amplifier_filter",
    observables=("force",),
    parameters=(
        EffectParameter("corner_hz", "Hz", LOWEST, OPEN, 30.0, starts=STARTS, neutral=OPEN, reciprocal=True),
        EffectParameter(
            "order",
            "1",
            1.0,
            8.0,
            0.3,
            starts=(2.0, 5.0),
            neutral=2.0,
            nothing_below=True,
            nothing_above=True,
        ),
    ),
    apply=apply,
    belongs_to=("instrument",),
    signature=(
        "High orders weaker and later, the more so the higher their frequency, on all axes alike: around one "
        "frequency, whatever the order that falls there. No order is magnified."
    ),
    literature="Butterworth, Experimental Wireless and the Wireless Engineer 7 (1930) 536",
    experiment="read the filter's setting on the amplifier, or record the same cut with the filter off",
    remedy=(
        "set the filter of the amplifier well above the tooth passing frequency, "
        "or declare it under known in batch.yaml"
    ),
)
