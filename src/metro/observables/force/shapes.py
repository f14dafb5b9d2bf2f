"""Functions of one circumstance of a cut, of which terms of a force model are made."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from metro.units import DEG, MM, RPM, Array

Form = Literal["linear", "square", "logarithm", "inverse", "saturating", "decay", "step", "sign"]
TINY = 1e-12  # below which nothing has a logarithm
STRAIGHT = 1e-9  # rad by which an arc ends short of half a turn, that is more than rounding


@dataclass(frozen=True)
class Circumstance:
    """A circumstance of a cut.

    ``words`` and ``symbol`` for the reader, in ``unit``, whose size in SI is ``si``. ``of(model, setting)``:
    its value, SI, at the time blocks of a record ((blocks,) or one number). ``within``: whether it changes
    within a record.
    """

    words: str
    symbol: str
    unit: str
    si: float
    of: Callable[[Any, Any], Array | float]
    within: bool = False


def _time(_model: Any, setting: Any) -> Array:
    return np.asarray(np.array(setting.recording.middles) - setting.recording.contact)


def _path(model: Any, setting: Any) -> Array:
    """Length of path since the tool touched the work: the feed rate is as programmed."""
    rate = setting.cut.feed_per_tooth * model.cutter.teeth * setting.recording.speed
    return np.asarray(_time(model, setting) * rate * setting.feed_ratio)


def _up(_model: Any, setting: Any) -> float:
    """One for an up cut, minus one for a down cut, zero for a slot or a hole: odd in the direction of cut."""
    arc = setting.cut.engagement
    return float(arc.exit < math.pi - STRAIGHT) - float(arc.entry > STRAIGHT)


def _arc(_model: Any, setting: Any) -> float:
    arc = setting.cut.engagement
    return float(arc.exit - arc.entry)


CIRCUMSTANCES: Mapping[str, Circumstance] = {
    "speed": Circumstance(
        "spindle speed", "n", "rev/min", RPM, lambda _, s: 2.0 * math.pi * s.recording.speed
    ),
    "feed": Circumstance("feed per tooth", "f", "mm", MM, lambda _, s: s.cut.feed_per_tooth),
    "depth": Circumstance("axial depth", "a", "mm", MM, lambda _, s: s.cut.axial_depth),
    "arc": Circumstance("arc of engagement", "φ", "deg", DEG, _arc),
    "travel": Circumstance("length cut in the session", "L", "m", 1.0, lambda _, s: s.cut_length),
    "up": Circumstance("direction of cut (+1 up, −1 down, 0 slot)", "u", "1", 1.0, _up),
    "time": Circumstance("time in the cut", "t", "s", 1.0, _time, within=True),
    "path": Circumstance("path since the entry", "x", "mm", MM, _path, within=True),
}


@dataclass(frozen=True)
class Shape:
    """A function g of a circumstance x, without a unit but for ``linear`` and ``square``.

    Attributes
    ----------
    form : linear (x − x₀), square (x − x₀)², logarithm ln(x/x₀), inverse x₀/x, saturating 1 − exp(−x/ℓ),
        decay exp(−x/ℓ), step (1 beyond ℓ, else 0), sign (−1, 0 or 1).
    variable : name of the circumstance.
    reference : x₀, in the circumstance's unit. length : ℓ, in the same unit.
    """

    form: Form
    variable: str
    reference: float = 0.0
    length: float = 1.0

    @property
    def circumstance(self) -> Circumstance:
        """What it is a function of."""
        return CIRCUMSTANCES[self.variable]

    def at(self, model: Any, setting: Any) -> Array:
        """Return its values at the time blocks of a record, (blocks,) or one."""
        known = self.circumstance
        return self.of_values(np.atleast_1d(np.asarray(known.of(model, setting), dtype=float)) / known.si)

    def of_values(self, x: Array) -> Array:
        """Return its values at values of the circumstance, in its unit."""
        return np.asarray(_FORMS[self.form](x, self.reference, self.length))


_FORMS: Mapping[str, Callable[[Array, float, float], Array]] = {
    "linear": lambda x, ref, _: x - ref,
    "square": lambda x, ref, _: (x - ref) ** 2,
    "logarithm": lambda x, ref, _: np.log(np.maximum(x, TINY) / ref),
    "inverse": lambda x, ref, _: ref / x,
    "saturating": lambda x, _, length: 1.0 - np.exp(-np.maximum(x, 0.0) / length),
    "decay": lambda x, _, length: np.exp(-np.maximum(x, 0.0) / length),
    "step": lambda x, _, length: (x > length).astype(float),
    "sign": lambda x, _ref, _length: np.sign(x),
}


def product(shapes: tuple[Shape, ...], model: Any, setting: Any) -> Array:
    """Return the product of functions at the time blocks of a record, (blocks,) or one; 1 of none."""
    result = np.ones(1)
    for shape in shapes:
        result = result * shape.at(model, setting)
    return result
