"""From hammer records and FRF files to modes per position and direction."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from metro.dynamics.modal import ModalModel, identify_modes
from metro.dynamics.modes import Mode
from metro.dynamics.shapes import mac
from metro.observables.stability.lines import WIDE_ENOUGH, clear_lines, excited_to, on_common_lines
from metro.observables.stability.modal_notes import doubts, of_files, of_point
from metro.observables.stability.pickups import crossed
from metro.observables.stability.receptance import (
    Receptance,
    arranged,
    files,
    from_files,
    from_records,
    scatter,
)
from metro.units import JSON

MODE_COLUMNS = (
    *("position", "direction", "frequency_hz", "frequency_sd_hz", "damping", "damping_sd"),
    *("stiffness_n_m", "stiffness_sd", "mass_kg", "used"),
)
_MORE_COLUMNS = ("mass_sd", "viscous_n_s_m", "viscous_sd", "collinearity", "resolved")
Read = Callable[..., pd.DataFrame]


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
        notes += [f"{name}: {note}" for note in [*doubts(model), *of_files(model), *of_point(group, model)]]
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

    If records and FRF files give the same pair, the records come first and are used, since they have a
    scatter; not where the hammer excites less than half of the lines that the file has.
    """
    groups: dict[tuple[str, str], dict[tuple[str, str], Receptance]] = {}
    struck = {(item.position, item.reference) for item in measured if item.driving}
    for item in measured:
        place = f"position {item.position}, {item.pair}"
        if item.reference[-1] != item.response[-1]:
            if (item.position, item.reference) not in struck:
                notes.append(
                    f"{place}: not used: force and response have different directions, and without the "
                    f"response at {item.reference} there is nothing to compare it with"
                )
            continue
        group = groups.setdefault((item.position, item.response[-1]), {})
        pair = item.reference, item.response
        first = group.setdefault(pair, item)
        if first is item:
            continue
        if np.mean(item.frequency <= excited_to(first)) >= WIDE_ENOUGH:
            notes.append(f"{place}: its FRF file is not used, as there are hammer records of the same pair")
        else:
            group[pair] = item
            notes.append(
                f"{place}: its hammer records are not used: the hammer excites up to "
                f"{excited_to(first):.5g} Hz, and the FRF file of the same pair goes to "
                f"{item.frequency[-1]:.5g} Hz"
            )
    distinct = {key: _distinct(list(group.values()), notes) for key, group in groups.items()}
    return {key: on_common_lines(group, notes) for key, group in distinct.items()}


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
    driving = [i for i, item in enumerate(group) if item.driving]
    clear = clear_lines(group[0].frequency, frf, variance, [item.coherence for item in group])
    usable = np.logical_and.reduce([item.usable for item in group])
    keep = np.flatnonzero(clear & usable)[:: max(item.redundancy for item in group)]
    model = identify_modes(
        group[0].frequency[keep],
        frf[keep],
        None if variance is None else variance[keep],
        driving[0] if driving else None,
        others=driving[1:],
        inputs=inputs,
        scatter=scatter(group, keep),
        decay=decay,
        files=files(group),
    )
    return model, keep


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
