"""What tests on either side of the boundary hide in the harder world, made as things are made.

An effect of the contract is asked for by the contract's parameters and built from the machine: a wear land of
some width, bearings whose balls are thrown outwards, blows along the flats of a housing that is turned, a
resonance of the fixture. What was built is then told back in the contract's terms, with the error of that.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from virtual_cell.hidden import Hidden, Parameters, drawn_angle, drawn_signed, drawn_size
from virtual_cell.units import DEG, N_MM, N_UM, RPM, UM, Array
from virtual_cell.world.boundary.cell import Cell

Told = tuple[Parameters, dict[str, float]]  # parameters of the contract, and the relative error of each
_ASTRAY = 7.0  # degrees, by which a resonance of a fixture is off the axis that it is drawn for


def _missing(rng: np.random.Generator, cell: Cell) -> Parameters:
    r = cell.resonances
    return {
        "frequency_hz": drawn_size(rng, 0.55 * r.hz.min(), 1.15 * r.hz.max()),
        "damping": drawn_size(rng, 0.012, 0.04),
        "stiffness_n_um": drawn_size(rng, 0.3 * r.stiffness.min() / N_UM, 1.5 * r.stiffness.min() / N_UM),
        "axis": str(rng.choice(["x", "y"])),
    }


def _fixture(cell: Cell, p: Parameters) -> Cell:
    """Let the work stand on springs: as stiff along the axis as is asked for, and a little off it."""
    side = 1.0 if cell.tool.runout_angle > math.pi else -1.0
    heading = side * _ASTRAY * DEG
    stiffness = p["stiffness_n_um"] * N_UM * math.cos(heading) ** 2
    turned = heading + (0.5 * math.pi if p["axis"] == "y" else 0.0)
    return replace(
        cell, resonances=cell.resonances.with_one(p["frequency_hz"], p["damping"], stiffness, turned)
    )


def _worn_flank(cell: Cell, p: Parameters) -> Cell:
    land = cell.flank.with_viscous(p["coefficient_n_mm"] * N_MM)
    return replace(cell, flank=replace(cell.flank, land=land))


def _turned_housing(cell: Cell, p: Parameters) -> Cell:
    angle = p["angle_deg"] * DEG
    return replace(cell, resonances=cell.resonances.turned(angle), flats=cell.flats + angle)


def _loaded_bearings(cell: Cell, p: Parameters) -> Cell:
    """Let balls be thrown outwards (softer), or the preload grow with heat (stiffer)."""
    asked = p["change_per_krpm"] / 1000.0
    bent = 2.0 if asked < 0.0 else 1.4
    unit = replace(cell, spindle=replace(cell.spindle, bearing=1.0, bent=bent))
    per_unit, _ = _slope(unit, _speeds(cell))
    return replace(cell, spindle=replace(cell.spindle, bearing=asked / per_unit, bent=bent))


def _speeds(cell: Cell) -> Array:
    return np.linspace(0.4, 1.0, 13) * cell.fast


def _slope(cell: Cell, rpm: Array) -> tuple[float, float]:
    """Slope, per rev/min, nearest to how the stiffness of all modes changes; relative rms of the rest."""
    r = cell.resonances
    known = r.struck
    weight = (1.0 / r.stiffness[known]) / np.sum(1.0 / r.stiffness[known])
    change = np.outer(cell.bearings(rpm), r.bearing[known])
    slope = float((rpm @ change @ weight) / (rpm @ rpm))
    rest = float(np.sqrt(np.mean((change - slope * rpm[:, None]) ** 2 @ weight)))
    return slope, rest / max(abs(slope) * float(np.sqrt(np.mean(rpm**2))), 1e-12)


def _spread_of_headings(cell: Cell) -> float:
    """Return the standard deviation, rad, of resonances off the flats, weighed by their compliance."""
    r = cell.resonances
    known = r.struck
    off = np.mod(r.heading[known] - cell.flats + math.pi / 4.0, math.pi / 2.0) - math.pi / 4.0
    weight = (1.0 / r.stiffness[known]) / np.sum(1.0 / r.stiffness[known])
    return float(np.sqrt(weight @ off**2))


def _told_flank(cell: Cell, _: Parameters, rpm: Array) -> Told:
    """Tell a land by its viscous coefficient, on the average over the programme.

    Its error is what friction adds along the cut, and what a wave of a third of the feed is damped less.
    """
    worn = 1.0 + 0.5 * cell.flank.growth
    wave = cell.feed / 3.0 * 2.0 * math.pi * float(cell.resonances.hz.min())
    surface_speed = float(np.median(rpm)) * RPM * 0.5 * cell.tool.diameter
    off = math.hypot(1.0 - cell.flank.effective(wave / surface_speed), cell.flank.friction)
    name = "coefficient_n_mm"
    return {name: round(cell.flank.viscous * worn**2 / N_MM, 2)}, {name: round(off, 3)}


def _told_bearings(cell: Cell, _: Parameters, rpm: Array) -> Told:
    """Tell bearings by the slope of the stiffness over the speeds that are tested."""
    slope, rest = _slope(cell, rpm)
    name = "change_per_krpm"
    return {name: float(f"{1000.0 * slope:.4g}")}, {name: round(rest, 3)}


def _told_housing(cell: Cell, asked: Parameters, _: Array) -> Told:
    """Tell a turned housing by its angle: its resonances are off the flats each by some degrees more."""
    off = _spread_of_headings(cell) / max(abs(asked["angle_deg"]) * DEG, 1e-9)
    return dict(asked), {"angle_deg": round(off, 3)}


def _told_fixture(_: Cell, asked: Parameters, __: Array) -> Told:
    """Tell a resonance off the axis by what is felt along it; what is felt across is the error."""
    return dict(asked), {"stiffness_n_um": round(math.tan(_ASTRAY * DEG), 3)}


_TOLD: Mapping[str, Callable[[Cell, Parameters, Array], Told]] = {
    "process_damping": _told_flank,
    "spindle_speed_softening": _told_bearings,
    "mode_coupling": _told_housing,
    "missing_mode": _told_fixture,
}


def told(name: str, cell: Cell, asked: Parameters, rpm: Array) -> Told:
    """Return what was built in the contract's terms, and the relative error of that.

    Parameters
    ----------
    asked : parameters that it was built from. rpm : (n,) speeds that are tested.
    """
    return _TOLD[name](cell, asked, rpm) if name in _TOLD else (dict(asked), {})


def _odd(cell: Cell, **changes: float) -> Cell:
    return replace(cell, mishap=replace(cell.mishap, **changes))


def _later(rng: np.random.Generator) -> float:
    return float(round(rng.uniform(0.3, 0.6), 2))


def _spacing(rng: np.random.Generator, cell: Cell) -> Parameters:
    """Teeth out of their even places by whole steps of the march."""
    by = 6.0 * float(rng.integers(1, 4))
    off = by * np.sin(2.0 * math.pi * (np.arange(cell.tool.teeth) + 0.3) / cell.tool.teeth)
    return {"pitch_deg": [6.0 * round(float(e) / 6.0) for e in off - off[0]]}


def _short_tooth(cell: Cell, p: Parameters) -> Cell:
    reach = cell.tool.unequal.copy()
    reach[p["tooth"] % cell.tool.teeth] -= p["length_um"] * UM
    return replace(cell, tool=replace(cell.tool, unequal=reach))


HARDER_EFFECTS: Mapping[str, Hidden[Cell]] = {
    "missing_mode": Hidden("frequency_hz damping stiffness_n_um axis=x|y", _missing, _fixture),
    "process_damping": Hidden(
        "coefficient_n_mm", lambda r, _: {"coefficient_n_mm": drawn_size(r, 200.0, 3000.0)}, _worn_flank
    ),
    "mode_coupling": Hidden(
        "angle_deg", lambda r, _: {"angle_deg": drawn_signed(r, 20.0, 70.0)}, _turned_housing
    ),
    "spindle_speed_softening": Hidden(
        "change_per_krpm",
        lambda r, c: {"change_per_krpm": drawn_signed(r, 60.0 / c.fast, 350.0 / c.fast)},
        _loaded_bearings,
    ),
    # outside of any library
    "speed_dependence": Hidden(
        "exponent",
        lambda r, _: {"exponent": drawn_signed(r, 0.5, 2.0)},
        lambda c, p: _odd(c, speed_exponent=p["exponent"]),
    ),
    "speed_damping": Hidden(
        "growth_at_fastest",
        lambda r, _: {"growth_at_fastest": drawn_size(r, 0.6, 4.0)},
        lambda c, p: replace(c, spindle=replace(c.spindle, damped=p["growth_at_fastest"])),
    ),
    "whirling_spindle": Hidden(
        "rate",
        lambda r, _: {"rate": drawn_size(r, 0.3, 2.0)},
        lambda c, p: replace(c, spindle=replace(c.spindle, whirl=p["rate"])),
    ),
    "spindle_sags": Hidden(
        "loss",
        lambda r, _: {"loss": drawn_size(r, 0.03, 0.15)},
        lambda c, p: replace(c, spindle=replace(c.spindle, sag=p["loss"])),
    ),
    "spindle_warms": Hidden(
        "change",
        lambda r, _: {"change": drawn_signed(r, 0.15, 0.5)},
        lambda c, p: replace(c, session=replace(c.session, warming=p["change"])),
    ),
    "work_gets_thinner": Hidden(
        "loss", lambda r, _: {"loss": drawn_size(r, 0.4, 0.85)}, lambda c, p: _thin(c, p["loss"])
    ),
    "tool_breaks_down": Hidden(
        "from_share harder duller",
        lambda r, _: {
            "from_share": _later(r),
            "harder": drawn_size(r, 1.35, 2.0),
            "duller": drawn_size(r, 2.0, 6.0),
        },
        lambda c, p: _odd(c, from_share=p["from_share"], harder=p["harder"], duller=p["duller"]),
    ),
    "another_bar": Hidden(
        "from_share harder",
        lambda r, _: {"from_share": _later(r), "harder": drawn_size(r, 1.4, 2.5)},
        lambda c, p: _odd(c, from_share=p["from_share"], harder=p["harder"]),
    ),
    "coolant_on": Hidden(
        "from_share wetter",
        lambda r, _: {"from_share": _later(r), "wetter": drawn_size(r, 0.2, 0.6)},
        lambda c, p: _odd(c, from_share=p["from_share"], wetter=p["wetter"]),
    ),
    "clamped_anew": Hidden(
        "stiffness",
        lambda r, _: {"stiffness": float(r.choice([drawn_size(r, 0.35, 0.7), drawn_size(r, 1.4, 2.5)]))},
        lambda c, p: _odd(c, clamped=p["stiffness"]),
    ),
    "loose_holder": Hidden(
        "gap_um loose",
        lambda r, _: {"gap_um": drawn_size(r, 3.0, 40.0), "loose": float(round(r.uniform(0.3, 0.62), 2))},
        lambda c, p: _odd(c, play=0.5 * p["gap_um"] * UM, loose=p["loose"]),
    ),
    "dry_friction": Hidden(
        "force_n",
        lambda r, _: {"force_n": drawn_size(r, 10.0, 80.0)},
        lambda c, p: _odd(c, friction=p["force_n"]),
    ),
    "chips_cut_again": Hidden(
        "growth", lambda r, _: {"growth": drawn_size(r, 0.5, 3.0)}, lambda c, p: _odd(c, clogging=p["growth"])
    ),
    "wavy_stock": Hidden(
        "height waves_per_turn",
        lambda r, _: {
            "height": drawn_size(r, 0.15, 0.8),
            "waves_per_turn": float(round(r.uniform(0.15, 0.45), 3)),
        },
        lambda c, p: _odd(c, wavy=p["height"], waves=p["waves_per_turn"]),
    ),
    "short_tooth": Hidden(
        "tooth length_um",
        lambda r, c: {
            "tooth": int(r.integers(c.tool.teeth)),
            "length_um": drawn_size(r, 0.5 * c.feed / UM, 2.5 * c.feed / UM),
        },
        _short_tooth,
    ),
    "tool_runout": Hidden(
        "radius_um angle_deg",
        lambda r, c: {
            "radius_um": drawn_size(r, 0.4 * c.feed / UM, 2.0 * c.feed / UM),
            "angle_deg": drawn_angle(r),
        },
        lambda c, p: replace(
            c, tool=replace(c.tool, runout=p["radius_um"] * UM, runout_angle=p["angle_deg"] * DEG)
        ),
    ),
    "uneven_pitch": Hidden(
        "pitch_deg[]",
        _spacing,
        lambda c, p: replace(c, tool=replace(c.tool, uneven=tuple(angle * DEG for angle in p["pitch_deg"]))),
    ),
    "wrong_labels": Hidden(
        "share",
        lambda r, _: {"share": drawn_size(r, 0.1, 0.35)},
        lambda c, p: replace(c, mistaken=p["share"]),
    ),
}


def _thin(cell: Cell, loss: float) -> Cell:
    """Let the softest resonance near y be that of the work."""
    r = cell.resonances
    across = np.where(np.abs(np.sin(r.heading)) > 0.5, r.stiffness, np.inf)
    bearing = r.bearing.copy()
    bearing[int(np.argmin(across))] = 0.0
    return _odd(replace(cell, resonances=replace(r, bearing=bearing)), thinner=loss)
