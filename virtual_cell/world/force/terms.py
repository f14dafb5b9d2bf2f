"""What is true of a cell, in the terms of the contract's effects, and how far these are from the truth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from virtual_cell.hidden import Parameters
from virtual_cell.session import Plan, orbit_rpm
from virtual_cell.units import DEG, MM, N_UM, RPM, UM
from virtual_cell.world.force.cell import Cell, engaged, on_tool, programmed_moment
from virtual_cell.world.force.cutter import (
    effective_runout,
    uneven,
    uneven_pitch,
    wear_per_metre,
)
from virtual_cell.world.force.metal import size_exponent
from virtual_cell.world.force.spindle import Spindle, turning
from virtual_cell.world.force.table import single_modes
from virtual_cell.world.force.travel import Circling

LONG = 150.0  # s: a time constant of the discharge below the shortest that is always on is hidden
_PER_TURN = 48  # of the force on a helical path, to find its wave over an orbit


@dataclass(frozen=True)
class Term:
    """Parameters of an effect as the contract has them, and the relative error that they have as such.

    ``present``: whether there is anything of it at all.
    """

    parameters: Parameters
    error: float
    present: bool = True


def in_contract_terms(cell: Cell, plans: Sequence[Plan]) -> dict[str, Term]:
    """Return, by the contract's names, what there is of each effect in a cell that cuts these plans."""
    return {
        **_of_tool(cell),
        **_of_metal(cell),
        **_of_sensor(cell),
        "tool_deflection": _deflection(cell),
        "orbit_stiffness": _orbit(cell, plans),
    }


def _of_tool(cell: Cell) -> dict[str, Term]:
    tool, middle = cell.tool, 0.5 * cell.depth
    runout = effective_runout(tool, middle)
    ends = abs(effective_runout(tool, cell.depth) - effective_runout(tool, 0.0))
    pitch = uneven_pitch(tool, middle)
    twist = np.abs(uneven_pitch(tool, cell.depth) - pitch).max()
    wear, apart = wear_per_metre(cell.wear, cell.metres, cell.metal.edge)
    angle = float(np.angle(runout)) / DEG % 360.0
    return {
        "tool_runout": Term(
            {"radius_um": _digits(abs(runout) / UM), "angle_deg": round(angle, 1)},
            0.5 * ends / max(abs(runout), 1e-12),
        ),
        "pitch_error": Term(
            {"pitch_deg": [round(float(off) / DEG, 4) for off in pitch]},
            float(twist / max(float(np.abs(pitch).max()), 1e-12)),
        ),
        **_uneven(cell),
        "tool_wear": Term({"edge_growth_per_m": _digits(wear)}, apart),
        "tool_end": Term({"corner_radius_mm": _digits(tool.corner / MM)}, 0.0),
    }


def _uneven(cell: Cell) -> dict[str, Term]:
    """Say how teeth differ beyond another diameter and an offset of the axis; three or fewer do not."""
    if cell.tool.teeth < 4:
        return {}
    off, apart = uneven(cell.tool, cell.depth)
    return {"uneven_teeth": Term({"longer_um": [round(float(each) / UM, 4) for each in off]}, apart)}


def _of_metal(cell: Cell) -> dict[str, Term]:
    exponent, unsure = size_exponent(cell.metal, 0.5 * math.pi * cell.metal.reference)
    return {"chip_size_effect": Term({"exponent": _digits(exponent)}, unsure / max(exponent, 0.01))}


def _of_sensor(cell: Cell) -> dict[str, Term]:
    hz, damping, apart = single_modes(cell.table)
    tilt = math.hypot(cell.table.pitch, cell.table.roll)
    terms = {
        "dynamometer_rotation": Term(
            {"angle_deg": _digits(cell.table.yaw / DEG)}, tilt / max(abs(cell.table.yaw), 1e-9)
        ),
        "dynamometer_resonance": Term({"frequency_hz": _list(hz), "damping": _list(damping)}, apart),
        "dynamometer_crosstalk": Term(_crosstalk(cell.table.gains), tilt),
        "amplifier_filter": Term(
            {
                "corner_hz": _digits(cell.amplifier.cutoff * cell.amplifier.rate),
                "order": cell.amplifier.order,
            },
            0.0,
        ),
        "charge_drift": Term({"slope_n_s": _list(cell.amplifier.drift)}, 0.0),
    }
    if float(cell.amplifier.constant.min()) < LONG:
        terms["charge_drift"] = Term({"time_constant_s": _list(cell.amplifier.constant)}, 0.0)
    return terms


def _crosstalk(gains: np.ndarray) -> Parameters:
    """Shares of an axis in another, of the gains that the coefficients do not take up: per that of x or z."""
    g = gains / np.diag(gains)[:, None]
    plane = 0.5 * (g[0, 1] + g[1, 0])
    shares = {
        "x_in_z": g[2, 0],
        "y_in_z": g[2, 1],
        "z_in_x": g[0, 2],
        "z_in_y": g[1, 2],
        "x_and_y": plane,
        "y_gain": gains[1, 1] / gains[0, 0] - 1.0,
    }
    return {f"{name}_percent": _digits(100.0 * float(share)) for name, share in shares.items()}


def _deflection(cell: Cell) -> Term:
    """Put a diagonal of springs in the place of skew ones."""
    if cell.holder is None:
        return Term({}, 0.0, present=False)
    c = cell.holder.compliance
    skew = abs(float(c[0, 1])) / math.sqrt(float(c[0, 0] * c[1, 1]))
    return Term({f"k{axis}_n_um": _digits(1.0 / float(c[i, i]) / N_UM) for i, axis in enumerate("xy")}, skew)


def _orbit(cell: Cell, plans: Sequence[Plan]) -> Term:
    """Read the wave of the axial force over an orbit off the force itself."""
    if cell.sway == 0.0:
        return Term({}, 0.0, present=False)
    first, second = orbit_waves(cell, next(plan for plan in plans if plan.operation == "helical"))
    return Term(
        {"amplitude": _digits(abs(first)), "phase_deg": round(float(np.angle(first)) / DEG, 1)},
        abs(second) / abs(first),
    )


def orbit_waves(cell: Cell, plan: Plan) -> tuple[complex, complex]:
    """Waves of the axial force over its mean, once and twice per orbit: complex amplitudes of e^−iψ."""
    bare = replace(cell, causes=(), holder=None, habits=replace(cell.habits, by_run=0.0))
    rate = orbit_rpm(bare, plan) * RPM
    moment = replace(programmed_moment(bare, plan), duration=2.0 * math.pi / abs(rate))
    motion = Circling(
        bare.hole_radius - bare.tool.radius,
        rate,
        0.0,
        plan.axial_depth_mm * MM,
        sway=bare.sway,
        sway_phase=bare.sway_phase,
    )
    even = turning(Spindle(), moment.spindle, moment.duration, (0.0, 1.0), rng=np.random.default_rng(0))
    fresh: Any = (np.ones(3), np.ones(3), np.ones(2))
    one = engaged(bare, moment, motion, even, nominal=plan.axial_depth_mm * MM, coefficients=fresh)
    count = _PER_TURN * round(moment.duration * moment.spindle / (2.0 * math.pi))
    t = np.arange(count) * (moment.duration / count)
    axial, psi = on_tool(bare, moment, one, motion, t)[:, 2], motion.direction(t)
    mean = float(axial.mean())
    first, second = (2.0 * np.mean(axial * np.exp(1j * times * psi)) / mean for times in (1, 2))
    return complex(first), complex(second)


def _digits(value: float) -> float:
    return float(f"{value:.4g}")


def _list(values: Any) -> list[float]:
    return [_digits(float(value)) for value in values]
