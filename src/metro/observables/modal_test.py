"""From hammer records and FRF files to modes per position and direction."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from metro.dynamics.frf import Hit, estimate_frf
from metro.dynamics.modal import ModalModel, identify_modes
from metro.units import Array, ComplexArray

MODE_COLUMNS = (
    *("position", "direction", "frequency_hz", "frequency_sd_hz", "damping", "damping_sd"),
    *("stiffness_n_m", "stiffness_sd", "mass_kg", "used"),
)
Read = Callable[..., pd.DataFrame]
_LEAST_LINES = 40


@dataclass(frozen=True)
class Response:
    """One receptance: ``frequency`` (n,) Hz, ``frf`` (n,) m/N, ``variance`` (n,) or None.

    Every ``redundancy``-th line is independent.
    """

    position: str
    reference: str
    response: str
    frequency: Array
    frf: ComplexArray
    variance: Array | None
    redundancy: int = 1

    @property
    def driving(self) -> bool:
        """Whether the structure was hit where its response was measured."""
        return self.reference == self.response


def observe_modes(read: Read) -> tuple[pd.DataFrame, pd.DataFrame, list[str]]:
    """Tables ``modes`` and ``frf_used`` of all impacts, and notes on what could not be had."""
    notes: list[str] = []
    measured = [*_from_records(read("hit"), notes), *_from_files(read("frf"))]
    modes, used = [], []
    for (position, direction), group in _by_direction(measured).items():
        try:
            model, keep = _identified(group)
        except ValueError as error:
            notes.append(f"position {position}, direction {direction}: {error}")
            continue
        modes.append(_mode_rows(position, direction, model))
        used.append(_used_rows(group, model, keep))
    return _joined(modes, MODE_COLUMNS), _joined(used, ()), notes


def _joined(parts: list[pd.DataFrame], columns: tuple[str, ...]) -> pd.DataFrame:
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=list(columns))


def _from_records(hits: pd.DataFrame, notes: list[str]) -> Iterator[Response]:
    keys = ["position", "reference", "response", "response_unit"]
    for (position, reference, response, unit), rows in hits.groupby(keys, sort=False):
        records = [_hit(part) for _, part in rows.groupby(["test", "replicate"], sort=False)]
        name = f"position {position}, {reference} to {response}"
        try:
            frf = estimate_frf(records, str(unit))
        except ValueError as error:
            notes.append(f"{name}: {error}")
            continue
        notes += [f"{name}: {note}" for note in frf.notes]
        keep = frf.frequency <= frf.frequency[frf.excited].max()
        variance = frf.variance[keep] if frf.hits > 1 else None
        names = (str(position), str(reference), str(response))
        yield Response(*names, frf.frequency[keep], frf.h1[keep], variance, max(int(frf.redundancy), 1))


def _hit(rows: pd.DataFrame) -> Hit:
    time = rows["t_s"].to_numpy()
    rate = (len(time) - 1) / float(time[-1] - time[0])
    # records of one test differ by rounding of the time stamps alone
    return Hit(rows["force_n"].to_numpy(), rows["response_si"].to_numpy(), round(rate, 3))


def _from_files(frfs: pd.DataFrame) -> Iterator[Response]:
    for (position, reference, response), rows in frfs.groupby(
        ["position", "reference", "response"], sort=False
    ):
        parts = [
            part.sort_values("frequency_hz") for _, part in rows.groupby(["test", "replicate"], sort=False)
        ]
        frequency = parts[0]["frequency_hz"].to_numpy()
        values = np.mean(
            [part["real_m_n"].to_numpy() + 1j * part["imag_m_n"].to_numpy() for part in parts], axis=0
        )
        keep = (frequency > 0) & np.isfinite(values)
        yield Response(str(position), str(reference), str(response), frequency[keep], values[keep], None)


def _by_direction(measured: list[Response]) -> dict[tuple[str, str], list[Response]]:
    """Responses that share their modes: one position, one direction of force and motion, the same lines.

    Where records and FRF files give the same pair, the records come first and are taken.
    """
    groups: dict[tuple[str, str], list[Response]] = {}
    for item in measured:
        if item.reference[-1] != item.response[-1]:
            continue
        group = groups.setdefault((item.position, item.response[-1]), [])
        group.append(item)
    return {key: _compatible(group) for key, group in groups.items()}


def _compatible(group: list[Response]) -> list[Response]:
    """Return the largest set of pairs on the same lines, each pair once."""
    by_lines: dict[tuple[int, float, float], dict[tuple[str, str], Response]] = {}
    for item in group:
        lines = (len(item.frequency), float(item.frequency[0]), float(item.frequency[-1]))
        by_lines.setdefault(lines, {}).setdefault((item.reference, item.response), item)
    return list(max(by_lines.values(), key=len).values())


def _identified(group: list[Response]) -> tuple[ModalModel, np.ndarray]:
    """Modal model of a group, and the lines (n,) that it was identified from."""
    frf = np.stack([item.frf for item in group], axis=1)
    known = [item.variance for item in group if item.variance is not None]
    variance = np.stack(known, axis=1) if len(known) == len(group) else None
    driving = next((i for i, item in enumerate(group) if item.driving), None)
    keep = _clear_of_drift(group[0].frequency, frf) if variance is None else _clear_of_noise(frf, variance)
    every = max(item.redundancy for item in group)
    keep = np.flatnonzero(keep)[::every]
    model = identify_modes(
        group[0].frequency[keep], frf[keep], None if variance is None else variance[keep], driving
    )
    return model, keep


def _clear_of_drift(frequency: Array, frf: ComplexArray) -> np.ndarray:
    """Lines above an integrated acceleration's drift: low ones with |H| above 30 times its median."""
    level = np.sqrt(np.mean(np.abs(frf) ** 2, axis=1))
    drift = np.flatnonzero((level > 30.0 * np.median(level)) & (frequency < 0.25 * frequency[-1]))
    return np.arange(len(frequency)) > (drift[-1] if len(drift) else -1)


def _clear_of_noise(frf: ComplexArray, variance: Array) -> np.ndarray:
    """Lines from the first to the last that stand out of the scatter of the hits."""
    level, noise = np.mean(np.abs(frf) ** 2, axis=1), np.mean(variance, axis=1)
    clear = np.flatnonzero(level > 9.0 * noise)
    lines = np.arange(len(frf))
    if len(clear) < _LEAST_LINES:
        return lines >= 0
    inside: np.ndarray = (lines >= clear[0]) & (lines <= clear[-1])
    return inside


def _mode_rows(position: str, direction: str, model: ModalModel) -> pd.DataFrame:
    rows = [
        (
            *(position, direction, mode.frequency, mode.frequency_sd, mode.damping, mode.damping_sd),
            *(mode.stiffness, mode.stiffness_sd, mode.mass, _usable(mode.stiffness, mode.stiffness_sd)),
        )
        for mode in model.modes
    ]
    return pd.DataFrame(rows, columns=list(MODE_COLUMNS))


def _usable(stiffness: float, sd: float) -> bool:
    """Whether a mode is resolved: its stiffness is known to better than half."""
    return math.isfinite(stiffness) and sd < 0.5 * stiffness


def _used_rows(group: list[Response], model: ModalModel, keep: np.ndarray) -> pd.DataFrame:
    parts = []
    for column, item in enumerate(group):
        frequency, frf = item.frequency[keep], item.frf[keep]
        modal = model.fit.evaluate(2 * np.pi * frequency)[:, column]
        columns = {
            "position": item.position,
            "reference": item.reference,
            "response": item.response,
            "frequency_hz": frequency,
            "real_m_n": frf.real,
            "imag_m_n": frf.imag,
            "modal_real_m_n": modal.real,
            "modal_imag_m_n": modal.imag,
        }
        parts.append(pd.DataFrame(columns))
    return pd.concat(parts, ignore_index=True)
