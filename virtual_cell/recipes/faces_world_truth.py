"""What was drawn of the world of a batch of faces, in plain units, for its truth."""

from __future__ import annotations

import numpy as np

from virtual_cell.recipes.faces_world_draws import Always, Workshop
from virtual_cell.units import DEG, MM, MS, UM
from virtual_cell.world.faces import fixture, load_test, scan
from virtual_cell.world.faces.structure import Structure
from virtual_cell.write import Row


def world(cell: Workshop, placed: scan.Placing) -> Row:
    """Return all that shapes the faces and what is read of them, hidden effects included."""
    return {
        "scanner": scan.as_written(cell.scanner, placed),
        "load_tests": load_test.as_written(cell.loads),
        "arm": _arm(cell),
        "metal": {
            "common_scatter": cell.metal.common,
            "own_scatter": cell.metal.own,
            "drift_over_session": cell.metal.drift,
            "edge_growth_per_m": cell.metal.blunts,
            "other_bar_change": cell.metal.other_bar[0],
            "other_bar_from_share": cell.metal.other_bar[1],
        },
        "cutting": {
            "depth_error_um": round(cell.depth_error / UM, 1),
            "stock_slope_um": round(cell.always.stock.slope / UM, 1),
            "speed_error": cell.speed_error,
            "corner_radius_mm": round(cell.corner / MM, 3),
            "pass_late_ms": round(cell.pauses.late / MS, 1),
            "pass_jitter_ms": round(cell.pauses.jitter / MS, 1),
            "in_clumps": cell.clumped,
        },
        "setup": _setup(cell.always, cell),
    }


def _setup(always: Always, cell: Workshop) -> Row:
    points = fixture.grid(cell.size)
    bow = fixture.second_degree(always.bow.shape(points, cell.size), points, cell.size)[0] / UM
    tilts = {
        wrist: [round(angle * 1e6, 1) for angle in always.tilt.tilt(wrist)]
        for wrist in sorted({case.wrist for case in cell.cases})
    }
    return {
        "spindle_growth_um": [round(length / UM, 2) for length in always.warm.lengths],
        "spindle_time_constants_s": list(always.warm.times),
        "bow_um": np.round(bow, 2).tolist(),
        "clamp_repeat": always.bow.repeat,
        "tilt_urad_by_wrist": tilts,
        "servo_give_um_kn": [round(give * 1e9, 2) for give in always.servo.give],
        "servo_time_s": round(always.servo.time, 4),
        "gear_wave_um": round(always.gears.size / UM, 2),
        "gear_wave_mm": [round(length / MM, 1) for length in always.gears.lengths],
    }


def _arm(cell: Workshop) -> Row:
    friction = next(iter(cell.poses.values())).friction
    off = cell.arm.coupled - np.eye(6)
    return {
        "joint_coupling": round(float(np.abs(off).max()), 4),
        "base_tilt_nrad_nm": round(cell.arm.base * 1e9, 2),
        "bracket_um_kn": round(float(np.trace(cell.arm.bracket)) / 3.0 * 1e9, 2),
        "friction_n": friction.level,
        "presliding_um": round(friction.length / UM, 1),
        "wrist_yaw_deg": {wrist: round(angle / DEG, 1) for wrist, angle in cell.yaw.items()},
        "modes": {name: _modes(pose) for name, pose in cell.poses.items()},
    }


def _modes(pose: Structure) -> list[Row]:
    return [
        {
            "hz": mode.hz,
            "damping": mode.damping,
            "n_um": round(mode.stiffness * UM, 1),
            "kick_um": round(mode.kick / UM, 2),
        }
        for mode in pose.modes
    ]
