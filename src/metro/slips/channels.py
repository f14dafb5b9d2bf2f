"""The ranges of the dynamometer's channels: one that is a decade, or a half, off."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from metro.batch.axes import AXES, signed_axes
from metro.slips.hypothesis import Hypothesis
from metro.slips.waveform import Design, Record
from metro.units import DEG, JSON

FACTORS = (
    0.01,
    0.1,
    0.2,
    0.5,
    2.0,
    5.0,
    10.0,
    100.0,
)  # steps of an amplifier's ranges, and bits of a converter

COLUMN = "instruments.dynamometer"


def gains(sensor: JSON, records: Sequence[Record], designs: Sequence[Design]) -> Iterator[Hypothesis]:
    """Yield the values of one channel multiplied by each factor; ``sensor``: the entry of the manifest."""
    declared = signed_axes(sensor.get("axes") or {})
    angle = float(sensor.get("rotation_deg", 0.0)) * DEG
    c, s = np.cos(angle), np.sin(angle)
    to_work = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ declared
    for place, name in enumerate(AXES):
        for factor in FACTORS:
            scale = np.diag([factor if i == place else 1.0 for i in range(3)])
            moved = to_work @ scale @ to_work.T
            remedy = f"the values of f{name} times {factor:g} (range or sensitivity of that channel)"
            yield Hypothesis(
                "gain",
                remedy,
                COLUMN,
                [record.mapped(moved) for record in records],
                designs,
            )
