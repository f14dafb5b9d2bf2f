"""The phase of the responses at their resonances, against the quantity that is declared to be measured."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from metro.slips.slip import Slip
from metro.units import JSON, Array, ComplexArray

OBSERVABLES = ("lobes",)
# cos 2φ of the phase φ of a mode's part in a receptance: 1 where structure and sensors have no phase of their
# own, -1 where the response was integrated once too often or too seldom. Half way between nothing and that
# are phases within 30 degrees of a quarter of a turn.
TURNED = -0.5


def phase_slips(responses: pd.DataFrame, modes: Sequence[JSON]) -> tuple[Slip, ...]:
    """Say where responses are a quarter of a turn off at their resonances, as after a wrong integration.

    The receptance of a structure is a sum of modes with nearly real numerators, wherever it was struck and
    sensed; a velocity that is taken for an acceleration, or the reverse, makes them imaginary.

    Parameters
    ----------
    responses : ``position, reference, response, frequency_hz, real_m_n, imag_m_n``. modes : of
        identified.json.
    """
    turns: list[float] = []
    if responses.empty:
        return ()
    for (position, _, response), rows in responses.groupby(["position", "reference", "response"], sort=False):
        own = [
            m for m in modes if str(m["position"]) == str(position) and m["direction"] == str(response)[-1]
        ]
        frf = rows["real_m_n"].to_numpy(float) + 1j * rows["imag_m_n"].to_numpy(float)
        natural, damping = (
            np.array([m[key]["value"] for m in own], dtype=float) for key in ("frequency", "damping")
        )
        if 2 * len(own) + 4 <= len(frf) and own:
            turns.append(turned(rows["frequency_hz"].to_numpy(float), frf, natural, damping))
    if not turns or np.median(turns) > TURNED:
        return ()
    found = (
        f"in {sum(turn < TURNED for turn in turns)} of {len(turns)} responses the resonances are a quarter "
        "of a turn away from what the displacement of a structure does"
    )
    remedy = (
        "Likely: response_unit in impacts.csv (an acceleration, m/s², given as a velocity, m/s; a velocity "
        "as an acceleration; a velocity as a displacement)"
    )
    return (Slip(OBSERVABLES, found, remedy, "impacts.csv", "response_unit"),)


def turned(frequency: Array, frf: ComplexArray, natural: Array, damping: Array) -> float:
    """Cosine of twice the phase of the modes' parts in a receptance, the largest peaks first.

    Parameters
    ----------
    frequency, frf : (n,) Hz and m/N. natural, damping : (k,) of the modes, Hz and ratio.
    """
    ratio = frequency[:, None] / natural
    shapes = 1.0 / (1.0 - ratio**2 + 2j * damping * ratio)
    # What lies below and above the band: a mass line and a constant.
    basis = np.hstack([shapes, np.ones((len(frequency), 1)), (natural.min() / frequency[:, None]) ** 2])
    size = np.linalg.norm(basis, axis=0)
    part = (np.linalg.lstsq(basis / size, frf, rcond=None)[0] / size)[: len(natural)]
    peak = part / (2.0 * damping)
    return float(np.sum(peak**2).real / max(np.sum(np.abs(peak) ** 2), 1e-300))
