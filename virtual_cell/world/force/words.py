"""What was drawn of the world of a force batch, in plain units, for the truth of a batch."""

from __future__ import annotations

import math

import numpy as np

from virtual_cell.units import DEG, MM, UM, Array
from virtual_cell.world.force.cell import Cell
from virtual_cell.world.force.cutter import effective_runout
from virtual_cell.write import Row


def in_words(cell: Cell) -> Row:
    """Return the world of a cell: spindle, tool, metal, sensor, people."""
    return {"spindle": _spindle(cell), "tool": _tool(cell), "metal": _metal(cell)} | {
        "dynamometer": _sensor(cell),
        "people": _people(cell),
    }


def _spindle(cell: Cell) -> Row:
    s = cell.spindle
    return {
        "speed_off_percent": _number(100.0 * s.off),
        "wander_percent": _number(100.0 * s.wander),
        "wander_s": s.wander_s,
        "droop_percent": _number(100.0 * s.droop),
        "recovery_s": s.recovery_s,
        "ripple_percent": _number(100.0 * s.ripple),
        "ripple_per_turn": s.poles,
    }


def _tool(cell: Cell) -> Row:
    t = cell.tool
    return {
        "offset_um": _number(t.runout / UM),
        "bent_um_at_tip": _number(t.bend * t.overhang / UM),
        "effective_runout_um": _number(abs(effective_runout(t, 0.5 * cell.depth)) / UM),
        "teeth_longer_um": _numbers(t.radial / UM),
        "teeth_lower_um": _numbers(t.axial / UM),
        "helix_off_deg": _numbers(t.twist / DEG),
        "corner_mm": _number(t.corner / MM),
        "wear_per_m": _number(cell.wear.per_metre),
        "worn_in": _number(cell.wear.running_in),
    }


def _metal(cell: Cell) -> Row:
    m = cell.metal
    return {
        "strain_gradient_um": _number(m.length / UM),
        "least_chip_um": _number(m.least_chip / UM),
        "ploughing_percent": _number(100.0 * m.plough),
        "common_scatter_percent": _number(100.0 * m.common),
        "own_scatter_percent": _number(100.0 * m.own),
        "drift_percent": _number(100.0 * m.drift),
        "other_bar_percent": _number(100.0 * m.bar),
        "other_bar_from": _number(m.bar_from),
    }


def _sensor(cell: Cell) -> Row:
    t, a, p = cell.table, cell.amplifier, cell.pickup
    return {
        "modes_hz": [_numbers(pair) for pair in t.frequency],
        "first_share": _numbers(t.share),
        "gains": [_numbers(row) for row in t.gains],
        "yaw_pitch_roll_deg": [_number(angle / DEG) for angle in (t.yaw, t.pitch, t.roll)],
        "drift_n_s": _numbers(a.drift),
        "time_constant_s": _numbers(a.constant),
        "reset_before_s": _numbers(np.array(a.waits)),
        "filter_order": a.order,
        "filter_hz": round(a.cutoff * a.rate),
        "clock_fast_ppm": _number(1e6 * a.fast),
        "step_n": _number(a.step),
        "white_n": p.white,
        "one_over_f_below_hz": p.corner,
        "mains_hz": p.mains,
        "hum_n": _numbers(np.sqrt((p.hum**2).sum(axis=1))),
    }


def _people(cell: Cell) -> Row:
    h = cell.habits
    return {
        "repeats_in_clumps": h.clumps,
        "too_deep_um": _number(h.depth_off / UM),
        "too_wide_um": _number(h.width_off / UM),
        "touched_off_again_from": _number(h.again_from) if h.again_from < 1.0 else None,
        "then_too_deep_um": _number(h.again / UM) if h.again_from < 1.0 else None,
        "feed_reached_in_short_cuts": _number(h.reached),
        "records_without_air": h.no_air,
        "records_that_stop_early": h.stops_early,
    }


def _number(value: float) -> float:
    return float(f"{value:.4g}") if math.isfinite(value) else value


def _numbers(values: Array) -> list[float]:
    return [_number(float(value)) for value in np.atleast_1d(values)]
