"""From hammer records and FRF files to modes per position and direction."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from metro.dynamics.driving import Standing
from metro.dynamics.modal import ModalModel, identify_modes
from metro.dynamics.modes import Mode
from metro.dynamics.shapes import mac
from metro.observables.stability.pickups import crossed
from metro.observables.stability.receptance import (
    Receptance,
    arranged,
    files,
    from_files,
    from_records,
    scatter,
)
from metro.units import JSON, N_UM, Array, ComplexArray

MODE_COLUMNS = (
    *("position", "direction", "frequency_hz", "frequency_sd_hz", "damping", "damping_sd"),
    *("stiffness_n_m", "stiffness_sd", "mass_kg", "used"),
)
_MORE_COLUMNS = ("mass_sd", "viscous_n_s_m", "viscous_sd", "collinearity", "resolved")
Read = Callable[..., pd.DataFrame]
_LEAST_LINES = 40
_QUIET_LINES = 5  # in a row, from which on a drift has ended or a response exceeds the noise


@dataclass(frozen=True)
class ModalTest:
    """Results of the impacts of a batch.

    Attributes
    ----------
    modes : one row per mode.
    used : the receptances on the lines that were fitted, with those of the modal model.
    stabilisation : the poles of every model order, their cluster, and whether it recurs.
    shapes : each mode's residue at each pair, 1 at the driving point.
    alike : the modal assurance criterion of every two modes.
    cross : the responses across the blow, beside those along it.
    notes : results that could not be identified, with the reasons.
    """

    modes: pd.DataFrame
    used: pd.DataFrame
    stabilisation: pd.DataFrame
    shapes: pd.DataFrame
    alike: pd.DataFrame
    cross: pd.DataFrame
    notes: list[str]


def observe_modes(read: Read, hammer: JSON) -> ModalTest:
    """Identify the modes of all impacts.

    Parameters
    ----------
    hammer : the entry of batch.yaml: ``window``, and ``time_constant_s`` of an exponential one, which was
        applied to force and response before they were stored.
    """
    notes: list[str] = []
    measured, decay = receptances(read, hammer, notes), _decay(hammer)
    modes, used, diagrams, shapes, alike = [], [], [], [], []
    for (position, direction), measured_there in _by_direction(measured, notes).items():
        name = f"position {position}, direction {direction}"
        group, inputs = arranged(measured_there)
        try:
            model, keep = _identified(group, inputs, decay)
        except ValueError as error:
            notes.append(f"{name}: {error}")
            continue
        if not model.modes:
            notes.append(f"{name}: no mode is seen in these hits: no pole recurs over the model orders")
            continue
        modes.append(_mode_rows(position, direction, model))
        used.append(_used_rows(group, model, keep))
        diagrams.append(_diagram_rows(position, direction, model))
        shapes.append(_shape_rows(group, direction, model))
        alike.append(_alike_rows(position, direction, model))
        notes += [
            f"{name}: {note}" for note in [*_doubts(model), *_of_files(model), *_of_point(group, model)]
        ]
    columns = (*MODE_COLUMNS, *_MORE_COLUMNS)
    fitted = _joined(used, ())
    return ModalTest(
        modes=_joined(modes, columns),
        used=fitted,
        stabilisation=_joined(diagrams, ()),
        shapes=_joined(shapes, ()),
        alike=_joined(alike, ()),
        cross=crossed(measured, fitted),
        notes=notes,
    )


def receptances(read: Read, hammer: JSON, notes: list[str]) -> list[Receptance]:
    """Return every receptance of a batch, from its hammer records and from its FRF files."""
    if "exp" in str(hammer.get("window", "")).lower() and "time_constant_s" not in hammer:
        notes.append("instruments.hammer: exponential window without time_constant_s: its damping stays in")
    return [*from_records(read("hit"), _decay(hammer), notes), *from_files(read("frf"), notes)]


def _joined(parts: list[pd.DataFrame], columns: tuple[str, ...]) -> pd.DataFrame:
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=list(columns))


def _decay(hammer: JSON) -> float:
    """Return the decay that the window adds to every mode, 1/s."""
    return 1.0 / float(hammer["time_constant_s"]) if "time_constant_s" in hammer else 0.0


def _by_direction(measured: list[Receptance], notes: list[str]) -> dict[tuple[str, str], list[Receptance]]:
    """Receptances that share their modes: one position, one direction of force and motion, the same lines.

    If records and FRF files give the same pair, the records come first and are used.
    """
    groups: dict[tuple[str, str], list[Receptance]] = {}
    for item in measured:
        if item.reference[-1] != item.response[-1]:
            continue
        group = groups.setdefault((item.position, item.response[-1]), [])
        group.append(item)
    return {key: _distinct(_compatible(group), notes) for key, group in groups.items()}


def _compatible(group: list[Receptance]) -> list[Receptance]:
    """Return the largest set of pairs on the same lines, each pair once."""
    by_lines: dict[tuple[int, float, float], dict[tuple[str, str], Receptance]] = {}
    for item in group:
        lines = (len(item.frequency), float(item.frequency[0]), float(item.frequency[-1]))
        by_lines.setdefault(lines, {}).setdefault((item.reference, item.response), item)
    return list(max(by_lines.values(), key=len).values())


def _distinct(group: list[Receptance], notes: list[str]) -> list[Receptance]:
    """Omit a channel that duplicates another one; a pair and its reciprocal may be equal."""
    kept: list[Receptance] = []
    for item in group:
        twin = next((other for other in kept if item.repeats(other)), None)
        if twin is None:
            kept.append(item)
        else:
            notes.append(f"position {item.position}, {item.pair}: left out, the same data as {twin.pair}")
    return kept


def _identified(group: list[Receptance], inputs: int, decay: float) -> tuple[ModalModel, np.ndarray]:
    """Modal model of a group, and the lines that it was identified from."""
    frf = np.stack([item.frf for item in group], axis=1)
    known = [item.variance for item in group if item.variance is not None]
    variance = np.stack(known, axis=1) if len(known) == len(group) else None
    driving = next((i for i, item in enumerate(group) if item.driving), None)
    clear = clear_of_drift(group[0].frequency, frf) if variance is None else clear_of_noise(frf, variance)
    usable = np.logical_and.reduce([item.usable for item in group])
    keep = np.flatnonzero(clear & usable)[:: max(item.redundancy for item in group)]
    model = identify_modes(
        group[0].frequency[keep],
        frf[keep],
        None if variance is None else variance[keep],
        driving,
        inputs=inputs,
        scatter=scatter(group, keep),
        decay=decay,
        files=files(group),
    )
    return model, keep


def clear_of_drift(frequency: Array, frf: ComplexArray) -> np.ndarray:
    """Lines above an integrated acceleration's drift: |H| above 30 times its median from the first line on.

    A drift grows towards the first line; a resonance low in the band does not, however high it is.
    """
    level = np.sqrt(np.mean(np.abs(frf) ** 2, axis=1))
    low = (level < 30.0 * np.median(level)) | (frequency > 0.25 * frequency[-1])
    quiet = _in_a_row(low)
    return np.arange(len(frequency)) >= (quiet[0] if len(quiet) else 0)


def _in_a_row(lines: np.ndarray) -> np.ndarray:
    """Return indices from which on a few lines in a row are true: a single line may be true by chance."""
    return np.flatnonzero(np.convolve(lines, np.ones(_QUIET_LINES), mode="valid") == _QUIET_LINES)


def clear_of_noise(frf: ComplexArray, variance: Array) -> np.ndarray:
    """Lines from the first to the last few that exceed the scatter of the hits."""
    level, noise = np.mean(np.abs(frf) ** 2, axis=1), np.mean(variance, axis=1)
    clear = _in_a_row(level > 9.0 * noise)
    lines = np.arange(len(frf))
    if len(clear) < _LEAST_LINES:
        return lines >= 0
    inside: np.ndarray = (lines >= clear[0]) & (lines < clear[-1] + _QUIET_LINES)
    return inside


def _mode_rows(position: str, direction: str, model: ModalModel) -> pd.DataFrame:
    rows = [(position, direction, *_mode_row(mode)) for mode in model.modes]
    return pd.DataFrame(rows, columns=[*MODE_COLUMNS, *_MORE_COLUMNS])


def _mode_row(mode: Mode) -> tuple[float | bool, ...]:
    return (
        *(mode.frequency, mode.frequency_sd, mode.damping, mode.damping_sd),
        *(mode.stiffness, mode.stiffness_sd, mode.mass, _usable(mode.stiffness, mode.stiffness_sd)),
        *(mode.mass_sd, mode.viscous, mode.viscous_sd, mode.collinearity, mode.resolved),
    )


def _usable(stiffness: float, sd: float) -> bool:
    """Whether a mode can be used at all: its stiffness is known to better than half."""
    return math.isfinite(stiffness) and sd < 0.5 * stiffness


def _doubts(model: ModalModel) -> Iterator[str]:
    """Say which modes the data do not resolve, with their intervals."""
    for mode in model.modes:
        if not mode.resolved:
            yield f"the mode at {_in_words(mode)}, is not resolved"
    if model.doubtful is not None:
        yield f"a further mode at {_in_words(model.doubtful)}, is not resolved and was left out"


def _of_files(model: ModalModel) -> Iterator[str]:
    """Say which modes differ between the files by more than the files' own errors."""
    shifts = [
        f"{mode.frequency:.5g} Hz by {mode.frequency * moved.frequency.scatter:.2g} Hz "
        f"(damping by {100.0 * moved.damping.scatter:.2g} %, {moved.frequency.files} files)"
        for mode, moved in zip(model.modes, model.moved, strict=True)
        if moved is not None and moved.frequency.scatter > 0.0
    ]
    if shifts:
        yield (
            "the modes differ between the files by more than the noise of a file, as standard deviation: "
            f"{'; '.join(shifts)}. Their intervals contain it. The hammer's place, the mass of a sensor that "
            "is moved, or the temperature shift modes; to know which, repeat one place at the end of a test"
        )


def _of_point(group: list[Receptance], model: ModalModel) -> Iterator[str]:
    """Say why a declared driving point is none, and what to do."""
    point = next((item.reference for item in group if item.driving), "")
    if model.declared is Standing.REVERSED:
        yield (
            f"{point} to {point} has the wrong sign in all its modes: the sensor or the hammer points the "
            "other way, so that no stiffness is given. Turn the sign of its channel (scale: -1 under files "
            "in batch.yaml)"
        )
    elif model.declared is Standing.ELSEWHERE:
        yield (
            f"{point} to {point} is no driving point: its modes have residues of both signs, and where a "
            "structure is hit all have one. Sensor and hammer were at different places, so that no stiffness "
            "is given. Correct reference or response in impacts.csv, or hit where the sensor is"
        )


def _in_words(mode: Mode) -> str:
    known = [f"{_with_interval(mode.frequency, mode.frequency_sd)} Hz"]
    known.append(f"damping {_with_interval(100 * mode.damping, 100 * mode.damping_sd)} %")
    if math.isfinite(mode.stiffness):
        stiffness = _with_interval(mode.stiffness / N_UM, mode.stiffness_sd / N_UM)
        known.append(f"stiffness {stiffness} N/µm")
    return ", ".join(known)


def _with_interval(value: float, sd: float) -> str:
    """Write a value and half its 95 % interval, both to two digits of the latter, as the report does."""
    half = 1.96 * sd
    place = 1 - math.floor(math.log10(float(f"{half:.1e}"))) if 0 < half < math.inf else 3
    return " ± ".join(f"{round(number, place):.{max(0, place)}f}" for number in (value, half))


def _diagram_rows(position: str, direction: str, model: ModalModel) -> pd.DataFrame:
    diagram = model.diagram
    pole = diagram.poles
    return pd.DataFrame(
        {
            "position": position,
            "direction": direction,
            "order": diagram.order,
            "frequency_hz": np.abs(pole) / (2.0 * np.pi),
            "damping": -pole.real / np.abs(pole),
            "cluster": diagram.member,
            "recurs": diagram.recurs[diagram.member],
        }
    )


def _shape_rows(group: list[Receptance], direction: str, model: ModalModel) -> pd.DataFrame:
    """Return each mode's shape, a row for each pair of the group."""
    rows = [
        (
            item.position,
            direction,
            mode.frequency,
            mode.resolved,
            item.reference,
            item.response,
            z.real,
            z.imag,
        )
        for mode in model.modes
        for item, z in zip(group, mode.shape, strict=True)
    ]
    columns = ["position", "direction", "frequency_hz", "resolved", "reference", "response", "real", "imag"]
    return pd.DataFrame(rows, columns=columns)


def _alike_rows(position: str, direction: str, model: ModalModel) -> pd.DataFrame:
    """Return the modal assurance criterion of every two modes at the pairs that were measured."""
    shapes = np.array([mode.shape for mode in model.modes]).reshape(len(model.modes), -1)
    frequency = [mode.frequency for mode in model.modes]
    first, second = (grid.ravel() for grid in np.meshgrid(frequency, frequency, indexing="ij"))
    columns = {"position": position, "direction": direction, "first_hz": first, "second_hz": second}
    return pd.DataFrame({**columns, "mac": mac(shapes, shapes).ravel()})


def _noise(item: Receptance, keep: np.ndarray) -> float:
    """Scatter of a receptance's repeats, rms over rms; NaN without repeats."""
    if item.variance is None:
        return math.nan
    return float(np.sqrt(np.mean(item.variance[keep]) / np.mean(np.abs(item.frf[keep]) ** 2)))


def _used_rows(group: list[Receptance], model: ModalModel, keep: np.ndarray) -> pd.DataFrame:
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
            "error": model.error[column],
            "noise": _noise(item, keep),
        }
        parts.append(pd.DataFrame(columns))
    return pd.concat(parts, ignore_index=True)
