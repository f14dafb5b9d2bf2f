"""Which cutting coefficients are possible: their signs, and their order by the mechanics of cutting."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from metro.slips.waveform import Coefficients, Record, WaveFit
from metro.units import N_MM, N_MM2, Array

DEVIATIONS = 3.0  # by which a bound is exceeded before a coefficient counts as impossible
UNKNOWN = 0.1  # relative deviation of the coefficients of one run
LEAST_HELIX = math.radians(5.0)  # below it, the helix does not decide the sign of the axial force
RADIAL = (
    1.43  # K_rc / K_tc = tan(friction angle - rake): a coefficient of friction of 1, a rake of -10 degrees
)
AXIAL_MARGIN = 1.5  # on K_ac <= K_tc tan(helix), which is for an edge without corner
LIKE_THE_MODEL = 0.5  # misfit up to which waveforms say what the coefficients are; noise decides beyond it
WAYS = (1.0, -1.0)
SPECIFIC = (20.0, 1e5)  # N/mm2: from plastics to ten times hardened steel, for the thinnest chips


def mean_chip(records: Sequence[Record]) -> float:
    """Mean chip thickness of all runs over their arcs of engagement, m."""
    chips = []
    for record in records:
        cut = record.setting.cut
        arc = cut.engagement
        share = (math.cos(arc.entry) - math.cos(arc.exit)) / (arc.exit - arc.entry)
        chips.append(cut.feed_per_tooth * share)
    return float(np.mean(chips))


def impossible(fitted: WaveFit, chip: float, helix: float) -> tuple[str, ...]:
    """Say what cannot be of the coefficients, by the mean forces and by the waveforms; empty: nothing.

    Judged is the force per width of cut at the mean chip, K h + K_e, of which shear and edge term are parts.
    Along the cutting speed it takes power from the spindle (> 0), and the chip presses the edge away from the
    work (> 0) by no more than friction and rake allow. In oblique cutting the shear term of the axial force
    is at most K_tc tan(helix), whichever way it points (docs/slips.md).

    Parameters
    ----------
    chip : m. helix : rad.
    """
    by_mean = _impossible(fitted.mean, chip, helix)
    if by_mean or fitted.misfit > LIKE_THE_MODEL:
        return by_mean
    return tuple(f"{text}, by waveform" for text in _impossible(fitted.wave, chip, helix))


def against_helix(fitted: WaveFit, chip: float, helix: float) -> str:
    """Say that the axial force has not the sign that the helix has; "" where it may have it.

    A right-hand helix has a positive K_ac in the tables of coefficients. Which way a sensor counts as upwards
    is not the same in all of them, so that this alone proves no mistake.
    """
    if abs(helix) <= LEAST_HELIX:
        return ""
    axial, side = _total(2, chip), math.copysign(1.0, helix)
    wrong = "is negative" if side > 0 else "is positive, with a left-hand helix"
    by_mean = _beyond(fitted.mean, -side * axial, "K_ac h + K_ae", axial, wrong)
    if by_mean or fitted.misfit > LIKE_THE_MODEL:
        return by_mean
    return _beyond(fitted.wave, -side * axial, "K_ac h + K_ae", axial, wrong)


def out_of_scale(fitted: WaveFit, chip: float, helix: float) -> float | None:
    """Return K_tc over what the materials have, where nothing but the size of the forces is impossible.

    The least factor by which all channels are too large (above 1) or too small; None where K_tc is possible,
    or where coefficients of any size would be impossible, as with axes that are exchanged.
    """
    ktc, (low, high) = float(fitted.mean.value[0]), (limit * N_MM2 for limit in SPECIFIC)
    if fitted.misfit > LIKE_THE_MODEL or not ktc > 0.0 or low <= ktc <= high:
        return None
    scale = math.sqrt(low * high) / ktc
    usual = replace(fitted, wave=_times(fitted.wave, scale), mean=_times(fitted.mean, scale))
    if impossible(usual, chip, helix):
        return None
    return ktc / (high if ktc > high else low)


def _times(coefficients: Coefficients, scale: float) -> Coefficients:
    return Coefficients(coefficients.value * scale, coefficients.without * scale)


def _impossible(coefficients: Coefficients, chip: float, helix: float) -> tuple[str, ...]:
    along, radial, axial = (_total(place, chip) for place in range(3))
    ktc = np.eye(6)[0]
    texts = [
        _beyond(coefficients, -along, "K_tc h + K_te", along, "is negative"),
        _beyond(coefficients, -radial, "K_rc h + K_re", radial, "is negative"),
    ]
    if not any(texts):
        over = f"exceeds {RADIAL} (K_tc h + K_te)"
        texts.append(_beyond(coefficients, radial - RADIAL * along, "K_rc h + K_re", radial, over))
    if abs(helix) > LEAST_HELIX and not any(texts):
        most = AXIAL_MARGIN * math.tan(abs(helix))
        over = f"exceeds {most:.2g} (K_tc h + K_te)"
        texts += [
            _beyond(coefficients, way * axial - most * along, "K_ac h + K_ae", axial, over) for way in WAYS
        ]
    value, sd = coefficients.of(ktc)
    low, high = (limit * N_MM2 for limit in SPECIFIC)
    if value - DEVIATIONS * _known(sd, value) > high or 0.0 < value + DEVIATIONS * _known(sd, value) < low:
        texts.append(f"K_tc {value / N_MM2:.3g} N/mm2 is outside {SPECIFIC[0]:g} to {SPECIFIC[1]:g} N/mm2")
    return tuple(filter(None, texts))


def coefficients_text(coefficients: Coefficients, chip: float) -> str:
    """Return the shear coefficients in words: K_tc 958.8, K_rc 251.1, K_ac 146.4 N/mm2.

    Where the runs do not part them from the edge coefficients (one feed alone), so that they come out as
    nothing that can be: the sums of both at the mean ``chip``, m, which are all that is known.
    """
    shear = coefficients.value[:3]
    if np.all(shear[:2] > 0.0):
        names = zip(("K_tc", "K_rc", "K_ac"), shear / N_MM2, strict=True)
        return f"{', '.join(f'{name} {value:.1f}' for name, value in names)} N/mm2"
    sums = [coefficients.of(_total(place, chip))[0] / N_MM for place in range(3)]
    named = zip(("K_tc h + K_te", "K_rc h + K_re", "K_ac h + K_ae"), sums, strict=True)
    listed = ", ".join(f"{name} {value:.3g}" for name, value in named)
    return f"{listed} N/mm at the mean chip h = {chip * 1e3:.2g} mm (the runs do not separate shear and edge)"


def _total(place: int, chip: float) -> Array:
    """Return the combination (6,) of shear and edge term at a chip thickness, per width of cut."""
    return np.asarray(chip * np.eye(6)[place] + np.eye(6)[place + 3])


def _known(deviation: float, value: float) -> float:
    return deviation if math.isfinite(deviation) else UNKNOWN * abs(value)


def _beyond(coefficients: Coefficients, excess: Array, name: str, shown: Array, what: str) -> str:
    """Say that a combination is above zero by more than its error allows; "" where it is not."""
    value, sd = coefficients.of(excess)
    if value <= DEVIATIONS * _known(sd, value):
        return ""
    number, deviation = coefficients.of(shown)
    interval = f" ± {1.96 * deviation / N_MM:.2g}" if math.isfinite(deviation) else ""
    return f"{name} is {number / N_MM:.3g}{interval} N/mm: it {what}"
