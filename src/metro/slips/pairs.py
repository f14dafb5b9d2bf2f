"""Hammer records and FRF files of the same pair of points, against each other."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from metro.observables.stability.receptance import Receptance
from metro.slips.redundancy import likely_gain
from metro.slips.slip import Slip
from metro.units import Array, ComplexArray

OBSERVABLES = ("lobes",)
# Two measurements of one pair differ by preload, temperature and the mass of the sensor, by some per cent.
# The smallest gain that a slip makes is 4.4 (lbf for N): half way to it, as a factor, is 2.1.
APART = 2.1
TURNED = 45.0  # degrees: half way to a quarter of a turn, which an integration too many or too few makes
LEAST_LINES = 8


def pair_slips(measured: Sequence[Receptance]) -> tuple[Slip, ...]:
    """Say where a record and an FRF file of one pair differ by a gain or a phase that no structure makes.

    Parameters
    ----------
    measured : receptances of a batch, as they are before one of the two gives way to the other.
    """
    by_pair: dict[tuple[str, str], list[Receptance]] = {}
    for item in measured:
        by_pair.setdefault((item.position, item.pair), []).append(item)
    found = []
    for (position, pair), items in by_pair.items():
        for first, second in pairwise(items):
            if (compared := _ratio(first, second)) is None:
                continue
            gain, turn = compared
            if 1.0 / APART <= gain <= APART and abs(turn) <= TURNED:
                continue
            found.append((f"position {position}, {pair}", gain, turn))
    if not found:
        return ()
    place, gain, turn = found[0]
    text = (
        f"{place}: the hammer record gives {gain:.3g} times the receptance of the FRF file, turned by "
        f"{turn:.0f}°"
    )
    more = f", and alike in {len(found) - 1} more" if len(found) > 1 else ""
    return (Slip(OBSERVABLES, text + more, _remedy(gain, turn), "impacts.csv", "response_unit"),)


def _ratio(first: Receptance, second: Receptance) -> tuple[float, float] | None:
    """Return size and phase (degrees) of one receptance over another where both are strong; None: nowhere."""
    lines = first.frequency[first.usable]
    common = (lines >= second.frequency[0]) & (lines <= second.frequency[-1])
    if np.count_nonzero(common) < LEAST_LINES:
        return None
    one, other = first.frf[first.usable][common], _at(second, lines[common])
    size = np.minimum(np.abs(one) / np.median(np.abs(one)), np.abs(other) / np.median(np.abs(other)))
    strong = size >= np.median(size)  # between resonances the noise of either is all there is
    gain = float(np.median(np.abs(one[strong]) / np.abs(other[strong])))
    return gain, math.degrees(cmath.phase(complex(np.sum(one[strong] * np.conj(other[strong])))))


def _at(item: Receptance, frequency: Array) -> ComplexArray:
    return np.asarray(
        np.interp(frequency, item.frequency, item.frf.real)
        + 1j * np.interp(frequency, item.frequency, item.frf.imag)
    )


def _remedy(gain: float, turn: float) -> str:
    quarter = TURNED < abs(turn) < 180.0 - TURNED
    if quarter:
        return (
            "Likely: response_unit in impacts.csv (an acceleration, m/s², given as a velocity, m/s, or the "
            "reverse)"
        )
    reversed_ = "a sensor or hammer that points the other way" if abs(turn) > TURNED else ""
    size = likely_gain(gain) if not 1.0 / APART <= gain <= APART else ""
    return "; ".join(filter(None, [size, f"Likely: {reversed_}" if reversed_ else ""]))
