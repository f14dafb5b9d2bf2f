"""Effects that a batch of milled faces may hide: how large they come, and what each changes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from virtual_cell.hidden import Hidden, Parameters, drawn_signed, drawn_size
from virtual_cell.recipes.faces_draws import FaceCell
from virtual_cell.units import MM, UM, Array

_MRAD, _UM_MIN = 1e-3, UM / 60.0


def _towards(rng: np.random.Generator, names: tuple[str, ...], low: float, high: float) -> Parameters:
    """Draw the entries of something that has a size, log-uniform, and a direction."""
    towards = rng.standard_normal(len(names))
    entries = towards / np.linalg.norm(towards) * drawn_size(rng, low, high)
    return {name: float(f"{value:.3g}") for name, value in zip(names, entries, strict=True)}


def _share(rng: np.random.Generator) -> float:
    """Draw a place in the course of a face."""
    return float(round(rng.uniform(0.25, 0.75), 2))


def _round(cell: FaceCell, **changes: Any) -> FaceCell:
    return replace(cell, around=replace(cell.around, **changes))


def _vibration(rng: np.random.Generator, cell: FaceCell) -> Parameters:
    """Draw a vibration whose waves on the face are 8 to 80 mm long."""
    return {
        "frequency_hz": float(f"{cell.milling.speed / (drawn_size(rng, 8.0, 80.0) * MM):.4g}"),
        "amplitude_um": drawn_size(rng, 2.0, 80.0),
    }


def _spot(rng: np.random.Generator, cell: FaceCell) -> Parameters:
    x, y = (rng.uniform(0.2, 0.8, 2) * cell.size / MM).round(1).tolist()
    return {
        "x_mm": x,
        "y_mm": y,
        "radius_mm": drawn_size(rng, 7.0, 18.0),
        "height_um": drawn_signed(rng, 20.0, 400.0),
    }


def _uncooled(rng: np.random.Generator, cell: FaceCell) -> Parameters:
    """Draw a coolant that fails within a face: the tool grows from there on, within a few passes."""
    passes = cell.passes("L")
    return {
        "growth_um": drawn_size(rng, 10.0, 250.0),
        "time_constant_s": float(f"{passes.period * rng.uniform(0.7, 2.0):.3g}"),
        "from_s": float(f"{passes.period * len(passes.axes) * rng.uniform(0.3, 0.6):.3g}"),
    }


INSIDE: Mapping[str, Hidden[FaceCell]] = {
    "spindle_tilt": Hidden(
        "about_x_mrad about_y_mrad",
        lambda r, _: _towards(r, ("about_x_mrad", "about_y_mrad"), 0.2, 8.0),
        lambda c, p: _round(c, tilt=(p["about_x_mrad"] * _MRAD, p["about_y_mrad"] * _MRAD)),
    ),
    "thermal_growth": Hidden(
        "um_per_min",
        lambda r, _: {"um_per_min": drawn_size(r, 2.0, 120.0)},
        lambda c, p: _round(c, growth=p["um_per_min"] * _UM_MIN),
    ),
    "fixture_bow": Hidden(
        "xx_um xy_um yy_um",
        lambda r, _: _towards(r, ("xx_um", "xy_um", "yy_um"), 5.0, 250.0),
        lambda c, p: _round(c, bow=tuple(p[f"{name}_um"] * UM for name in ("xx", "xy", "yy"))),
    ),
    "path_vibration": Hidden(
        "frequency_hz amplitude_um",
        _vibration,
        lambda c, p: _round(c, vibration=(p["frequency_hz"], p["amplitude_um"] * UM)),
    ),
    "entry_transient": Hidden(
        "amplitude_um length_mm",
        lambda r, _: {"amplitude_um": drawn_signed(r, 8.0, 300.0), "length_mm": drawn_size(r, 6.0, 40.0)},
        lambda c, p: _round(c, entry=(p["amplitude_um"] * UM, p["length_mm"] * MM)),
    ),
    "stiffness_scale": Hidden(
        "factor",
        lambda r, _: {"factor": float(round(math.exp(drawn_signed(r, 0.02, 0.7)), 3))},
        lambda c, p: replace(c, factor=p["factor"]),
    ),
}
OUTSIDE: Mapping[str, Hidden[FaceCell]] = {
    "tool_step": Hidden(
        "from_share height_um",
        lambda r, _: {"from_share": _share(r), "height_um": drawn_signed(r, 5.0, 120.0)},
        lambda c, p: replace(c, step=(p["from_share"], p["height_um"] * UM)),
    ),
    "hard_spot": Hidden(
        "x_mm y_mm radius_mm height_um",
        _spot,
        lambda c, p: _round(
            c, spot=(p["x_mm"] * MM, p["y_mm"] * MM, p["radius_mm"] * MM, p["height_um"] * UM)
        ),
    ),
    "failed_coolant": Hidden(
        "growth_um time_constant_s from_s",
        _uncooled,
        lambda c, p: _round(c, settling=(p["growth_um"] * UM, p["time_constant_s"], p["from_s"])),
    ),
    "scanner_distortion": Hidden(
        "uuu_um uuv_um uvv_um vvv_um",
        lambda r, _: _towards(r, ("uuu_um", "uuv_um", "uvv_um", "vvv_um"), 6.0, 250.0),
        lambda c, p: replace(
            c,
            scanner=replace(
                c.scanner, distortion=tuple(p[f"{name}_um"] * UM for name in ("uuu", "uuv", "uvv", "vvv"))
            ),
        ),
    ),
    "wear_within_face": Hidden(
        "growth", lambda r, _: {"growth": drawn_size(r, 0.05, 1.5)}, lambda c, p: replace(c, wear=p["growth"])
    ),
    "missed_depth": Hidden(
        "at_share depth_um",
        lambda r, _: {"at_share": _share(r), "depth_um": drawn_size(r, 8.0, 200.0)},
        lambda c, p: replace(c, missed=(p["at_share"], p["depth_um"] * UM)),
    ),
    "rail_sag": Hidden(
        "sag_um",
        lambda r, _: {"sag_um": drawn_signed(r, 8.0, 250.0)},
        lambda c, p: _round(c, sag=p["sag_um"] * UM),
    ),
    "walk_of_height": Hidden(
        "step_um",
        lambda r, _: {"step_um": drawn_size(r, 2.0, 40.0)},
        lambda c, p: replace(c, walk=p["step_um"] * UM),
    ),
}
FACE_EFFECTS: Mapping[str, Hidden[FaceCell]] = {**INSIDE, **OUTSIDE}


def pass_levels(cell: FaceCell, count: int, rng: np.random.Generator) -> Array:
    """How high each of ``count`` passes of a face is set, m: (count,)."""
    number = np.arange(count)
    levels = np.where(number >= round(cell.step[0] * count), cell.step[1], 0.0)
    levels -= np.where(number == round(cell.missed[0] * count), cell.missed[1], 0.0)
    return np.asarray(levels + cell.walk * np.cumsum(rng.standard_normal(count)))


def pass_gains(cell: FaceCell, count: int, depth: float) -> Array:
    """Force of each of ``count`` passes of a face over that of the first, (count,), at an axial depth, m."""
    number = np.arange(count)
    gains = 1.0 + cell.wear * number / max(1, count - 1)
    return np.asarray(gains + np.where(number == round(cell.missed[0] * count), cell.missed[1] / depth, 0.0))


def applied(
    cell: FaceCell, hidden: Mapping[str, Parameters | None], rng: np.random.Generator
) -> tuple[FaceCell, dict[str, Parameters]]:
    """Hide effects in a cell (parameters as given, or None: drawn); return it and what is hidden.

    Raises
    ------
    KeyError
        For an effect that is not known.
    """
    effects = {name: given or FACE_EFFECTS[name].draw(rng, cell) for name, given in hidden.items()}
    for name, parameters in effects.items():
        cell = FACE_EFFECTS[name].apply(cell, parameters)
    return cell, effects
