"""A number with its unit and its 95 % interval."""

from __future__ import annotations

import math
from dataclasses import dataclass

from metro.report.numbers import quantity as written
from metro.units import JSON


@dataclass(frozen=True)
class Quantity:
    """An identified quantity.

    Attributes
    ----------
    value : the estimate, in ``unit``; NaN where it is not known.
    low, high : ends of the 95 % interval; NaN where the data give none.
    unit : as in ``identified.json`` ("N/mm2", "Hz", "1").
    """

    value: float
    low: float
    high: float
    unit: str

    @classmethod
    def of(cls, entry: JSON) -> Quantity:
        """Return the quantity that a block of ``identified.json`` or ``verdict.json`` holds."""
        low, high = entry.get("ci95") or (None, None)
        value, low, high = (
            math.nan if number is None else float(number) for number in (entry["value"], low, high)
        )
        return cls(value, low, high, str(entry.get("unit") or ""))

    @property
    def half_width(self) -> float:
        """Half the length of the 95 % interval: the expanded uncertainty."""
        return 0.5 * (self.high - self.low)

    @property
    def standard_uncertainty(self) -> float:
        """The expanded uncertainty over 1.96."""
        return self.half_width / 1.959963984540054

    def __float__(self) -> float:
        return self.value

    def __str__(self) -> str:
        return written({"value": self.value, "ci95": [self.low, self.high], "unit": self.unit})
