"""The struck tip as M, C, K predict it: receptance and ring-down beside what was measured ([F] section 3.1).

Tables ``tip_receptance`` (measured and predicted, m/N, at the driving points of a pose) and ``tip_ringing``
(a hammer record of each direction: measured and predicted acceleration over the time since the blow).
The prediction takes mass.csv, loads.csv and the identified a0 and a1, nothing of the response itself.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd

from metro.batch.processed import Tables
from metro.observables.flatness.blocks import LOADS, Pose, pose_of_loads
from metro.observables.flatness.dynamics import TipDynamics
from metro.surface.tip_damping import Rayleigh
from metro.units import MM, Array

SHOWN_S = 1.0  # of a record after the blow
BEFORE_S = 0.05


def tip_receptance(mass: Array, damping: Array, stiffness: Array, frequency: Array) -> Array:
    """Receptance (K − ω² M + i ω C)⁻¹, (n, 3, 3) m/N, at ``frequency`` (n,) Hz, e^{+iωt}; matrices (3, 3)."""
    omega = 2.0 * np.pi * np.asarray(frequency)[:, None, None]
    return np.asarray(np.linalg.inv(stiffness - omega**2 * mass + 1j * omega * damping))


def struck_tables(read: Tables, modes: pd.DataFrame, responses: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Return both tables; none where no pose has loads, mass and the damping of its modes.

    Parameters
    ----------
    modes, responses : the observed tables ``modes`` and ``frf_used``.
    """
    loads, mass = (_placed(read(name)) for name in ("loads", "mass"))
    receptances, ringing = [], []
    for name in loads["pose"].astype(str).unique() if len(modes) else ():
        own = mass[mass["pose"].astype(str) == name]
        pose = pose_of_loads(
            name, loads[loads["pose"].astype(str) == name][["pose", "point", *LOADS]], own, modes
        )
        if not isinstance(pose, Pose) or pose.dynamics is None or pose.dynamics.damping is None:
            continue
        for position, matrices in _at_positions(name, own, pose.dynamics, responses):
            receptances += _receptances(position, matrices, responses)
            ringing += _ringing(position, matrices, read("hit"))
    tables = {"tip_receptance": receptances, "tip_ringing": ringing}
    return {name: pd.concat(parts, ignore_index=True) for name, parts in tables.items() if parts}


def _placed(table: pd.DataFrame) -> pd.DataFrame:
    return table[table[["x_mm", "y_mm"]].notna().all(axis=1)]


def _at_positions(
    pose: str, mass: pd.DataFrame, dynamics: TipDynamics, responses: pd.DataFrame
) -> Iterator[tuple[str, tuple[Array, Array, Array]]]:
    """Yield each struck position of a pose with M, C, K there: at a named point, else at the points' mean."""
    for position in responses["position"].astype(str).unique():
        of, _, point = position.partition("/")
        if of != pose:
            continue
        rows = mass[mass["point"].astype(str) == point] if point else mass
        if rows.empty:
            continue
        x, y = (np.array([rows[f"{axis}_mm"].mean() * MM]) for axis in "xy")
        own, stiffness = dynamics.mass(x, y)[0], np.linalg.inv(dynamics.compliance(x, y)[0])
        assert isinstance(dynamics.damping, Rayleigh)
        a0, a1 = dynamics.damping.values
        yield position, (own, a0 * own + a1 * stiffness, stiffness)


def _receptances(
    position: str, matrices: tuple[Array, Array, Array], responses: pd.DataFrame
) -> list[pd.DataFrame]:
    """Return measured and predicted magnitudes at the driving points of a position, with their difference."""
    parts = []
    there = responses[(responses["position"].astype(str) == position)]
    for axis, letter in enumerate("xyz"):
        rows = there[there["reference"].str.endswith(letter) & (there["reference"] == there["response"])]
        if rows.empty:
            continue
        frequency = rows["frequency_hz"].to_numpy(dtype=float)
        measured = rows["real_m_n"].to_numpy(dtype=float) + 1j * rows["imag_m_n"].to_numpy(dtype=float)
        mass, damping, stiffness = matrices
        predicted = tip_receptance(mass, damping, stiffness, frequency)[:, axis, axis]
        off = float(np.linalg.norm(measured - predicted) / np.linalg.norm(measured))
        columns = {
            "frequency_hz": frequency,
            "measured_m_n": np.abs(measured),
            "model_m_n": np.abs(predicted),
        }
        parts.append(
            pd.DataFrame({"position": position, "axis": letter, **columns, "difference_percent": 100 * off})
        )
    return parts


def _ringing(position: str, matrices: tuple[Array, Array, Array], hits: pd.DataFrame) -> list[pd.DataFrame]:
    """Return the first acceleration record of each direction, and what M, C, K make of the force."""
    parts = []
    there = hits[(hits["position"].astype(str) == position) & (hits["response_unit"] == "m/s2")]
    for axis, letter in enumerate("xyz"):
        rows = there[there["reference"].str.endswith(letter) & (there["reference"] == there["response"])]
        if rows.empty:
            continue
        first = rows[rows["replicate"] == rows["replicate"].min()]
        time, force, heard = first[["t_s", "force_n", "response_si"]].to_numpy(dtype=float).T
        predicted = response(matrices, axis, force, float(np.median(np.diff(time))))
        since = time - time[np.argmax(np.abs(force))]
        shown = (since >= -BEFORE_S) & (since <= SHOWN_S)
        # The blow itself is over within a few samples, and its peak depends on the filters of the recorder.
        after = shown & (since > BEFORE_S)
        off = float(np.linalg.norm((heard - predicted)[after]) / np.linalg.norm(heard[after]))
        columns = {"since_s": since[shown], "measured_m_s2": heard[shown], "model_m_s2": predicted[shown]}
        parts.append(
            pd.DataFrame({"position": position, "axis": letter, **columns, "difference_percent": 100 * off})
        )
    return parts


def response(matrices: tuple[Array, Array, Array], axis: int, force: Array, step: float) -> Array:
    """Acceleration (n,), m/s², along ``axis`` under a ``force`` (n,), N, along it, sampled every ``step`` s.

    From rest; the record is continued by as much silence, so that its end does not ring into its start.
    """
    mass, damping, stiffness = matrices
    frequency = np.asarray(np.fft.rfftfreq(2 * len(force), step), dtype=float)
    accelerance = (
        -((2.0 * np.pi * frequency) ** 2) * tip_receptance(mass, damping, stiffness, frequency)[:, axis, axis]
    )
    return np.asarray(
        np.fft.irfft(accelerance * np.fft.rfft(force, 2 * len(force)), 2 * len(force))[: len(force)]
    )
