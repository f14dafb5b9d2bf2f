"""Tests on either side of the boundary in the harder world: styles ``c`` and ``d``."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from virtual_cell.dynamometer import Dynamometer, record
from virtual_cell.hidden import Parameters
from virtual_cell.recipes.boundary_world_draws import Programme, drawn_cell, drawn_programme
from virtual_cell.session import write_force
from virtual_cell.units import MM, N_MM, N_MM2, UM, Array
from virtual_cell.world.boundary import ears, hammer
from virtual_cell.world.boundary.cell import Cell, Plan, made
from virtual_cell.world.boundary.chatter import Course, march
from virtual_cell.world.boundary.effects import HARDER_EFFECTS, told
from virtual_cell.world.boundary.terms import Climbs, in_contract_terms
from virtual_cell.world.present import listed
from virtual_cell.write import RUN_COLUMNS, Row, fresh_folder, impact_row, write_csv, write_signal, write_yaml

STYLES = ("c", "d")
_LAST = 22  # turns that are listened to
_WITHIN = 0.72  # of the speeds: a boundary within the ladder
_RECORDED = 45  # turns


@dataclass(frozen=True)
class Ladder:
    """All tests that could be made, in their order of speeds, kinds and depths, and what was heard of them.

    Attributes
    ----------
    plan, course : the tests, and what happened. climb : (n,) which ladder each belongs to.
    step : (n,) its rung. replicate : (n,). loud : (n,) over the feed per tooth.
    """

    plan: Plan
    course: Course
    climb: np.ndarray
    step: np.ndarray
    replicate: np.ndarray
    loud: Array


def make(
    folder: Path, hidden: Mapping[str, Parameters | None], seed: int, style: str, *, records: bool = False
) -> Row:
    """Write the batch; return the truth. ``records``: of every test, whatever is drawn.

    Raises
    ------
    KeyError
        For an effect that is not known.
    """
    cell, programme, asked, ladder = _drawn(hidden, seed, style, records=records)
    rng = np.random.default_rng([seed, 61])
    kept, next_to = _kept(ladder, programme)
    scatter = ears.scatter_for(replace(programme.ears, mistaken=0.0), ladder.loud[next_to])
    heard = ears.labels(replace(programme.ears, mistaken=cell.mistaken), ladder.loud[kept], scatter, rng)
    fresh_folder(folder)
    order = kept[rng.permutation(len(kept))] if programme.order == "random" else kept
    said = dict(zip(kept.tolist(), heard, strict=True))
    rows = [
        _row(cell, programme, ladder, test) | {"run": f"t{place:03d}", "order": place, "stable": said[test]}
        for place, test in enumerate(order.tolist(), start=1)
    ]
    if programme.records:
        for row, test in zip(rows, order, strict=True):
            time, read = _recorded(programme, ladder.course, int(test), rng)
            row["dynamometer"] = write_force(folder, row["run"], time, read)
    write_csv(folder / "runs.csv", rows, RUN_COLUMNS)
    write_csv(folder / "impacts.csv", _impacts(folder, cell, programme, rng))
    write_yaml(folder / "batch.yaml", _manifest(folder.name, cell, programme))
    tested = np.unique(ladder.plan.rpm[kept])
    always = in_contract_terms(cell, _climbs(ladder, programme))
    translated = {name: told(name, cell, parameters, tested) for name, parameters in asked.items()}
    return {
        "batch": folder.name,
        "seed": seed,
        "style": style,
        "effects": {name: parameters for name, (parameters, _) in translated.items()},
        "translation_error": {name: error for name, (_, error) in translated.items()},
        "always_on": listed(always, asked),
        "world": _world(cell, programme, scatter, len(kept)),
    }


def _climbs(ladder: Ladder, programme: Programme) -> Climbs:
    first = np.flatnonzero(ladder.step == 0)
    directions = tuple(ladder.plan.direction[i] for i in first)
    turns = _RECORDED if programme.records else 0
    return Climbs(ladder.plan.rpm[first], directions, programme.depths[1] / programme.depths[0], turns)


def _drawn(
    hidden: Mapping[str, Parameters | None], seed: int, style: str, *, records: bool
) -> tuple[Cell, Programme, dict[str, Parameters], Ladder]:
    """Draw machine, tests and effects until the ladders hold the boundary at most speeds."""
    for attempt in itertools.count():
        rng = np.random.default_rng([seed, 59, attempt])
        cell = drawn_cell(rng)
        programme = drawn_programme(rng, cell, style)
        programme = replace(programme, records=programme.records or records)
        cell = _settled(cell)
        asked = {name: given or HARDER_EFFECTS[name].draw(rng, cell) for name, given in hidden.items()}
        for name, parameters in asked.items():
            cell = HARDER_EFFECTS[name].apply(cell, parameters)
        ladder = climbed(cell, programme, rng)
        if _within(ladder, programme) >= _WITHIN:
            break
    return cell, programme, asked, ladder


def _settled(cell: Cell) -> Cell:
    """Nobody tries steps smaller than he can set: errors of the depth are a tenth of the boundary at most."""
    most, s = 0.1 * cell.level, cell.session
    off = math.copysign(min(abs(s.depth_off), most), s.depth_off)
    return replace(cell, session=replace(s, depth_off=off, depth_sd=min(s.depth_sd, 0.5 * most)))


def climbed(cell: Cell, programme: Programme, rng: np.random.Generator) -> Ladder:
    """March every rung of every ladder."""
    climbs = [
        (rpm, kind, replicate)
        for rpm in programme.speeds
        for kind in programme.kinds
        for replicate in ((1, 2) if rpm in programme.repeated else (1,))
    ]
    rungs = len(programme.depths)
    climb, step = (a.ravel() for a in np.indices((len(climbs), rungs)))
    progress = climb / max(1, len(climbs) - 1)
    if programme.order == "random":
        progress = rng.permutation(len(climb)) / max(1, len(climb) - 1)
    plan = Plan(
        np.array([climbs[i][0] for i in climb]),
        np.array(programme.depths)[step],
        tuple(climbs[i][1] for i in climb),
        progress,
    )
    cuts = made(cell, plan, programme.turns, rng)
    course = march(cuts, programme.per_turn, _LAST, rng, forces=programme.records)
    loud = ears.loudness(
        course.tip,
        cuts.depth,
        climb * rungs,
        per_turn=programme.per_turn,
        teeth=cell.tool.teeth,
        feed=cell.feed,
    )
    loud = np.where(course.stopped, np.inf, loud)
    return Ladder(plan, course, climb, step, np.array([climbs[i][2] for i in climb]), loud)


def _first_loud(ladder: Ladder, programme: Programme) -> Array:
    """Rung (c,) of each ladder from which on it is loud; the number of rungs where it never is."""
    middle = math.sqrt(programme.ears.thresholds[0] * programme.ears.thresholds[1])
    loud = (ladder.loud > middle).reshape(-1, len(programme.depths))
    return np.where(loud.any(axis=1), loud.argmax(axis=1), loud.shape[1])


def _within(ladder: Ladder, programme: Programme) -> float:
    first = _first_loud(ladder, programme)
    return float(np.mean((first > 0) & (first < len(programme.depths))))


def _kept(ladder: Ladder, programme: Programme) -> tuple[np.ndarray, np.ndarray]:
    """Which tests are made, on either side of each boundary; and those of them that are next to it."""
    first = _first_loud(ladder, programme)[ladder.climb]
    below, above = ladder.step - first, first - 1 - ladder.step
    kept = (below < programme.beside) & (above < programme.beside)
    return np.flatnonzero(kept), np.flatnonzero((below < 1) & (above < 1))


def _row(cell: Cell, programme: Programme, ladder: Ladder, test: int) -> Row:
    rpm, kind = float(ladder.plan.rpm[test]), ladder.plan.direction[test]
    depth = round(float(ladder.plan.depth[test]) / MM, 3)
    return {
        "role": "validate" if rpm in programme.held_out else "identify",
        "condition": f"{rpm:g}-{kind}-{depth:g}",
        "replicate": int(ladder.replicate[test]),
        "operation": "slot" if kind == "slot" else "side",
        "spindle_rpm": rpm,
        "feed_per_tooth_mm": round(cell.feed / MM, 6),
        "axial_depth_mm": depth,
        "radial_depth_mm": round((cell.tool.diameter if kind == "slot" else cell.radial) / MM, 6),
        "direction": kind,
        "feed_direction_deg": 0.0,
        "cut_length_mm": round(cell.feed / MM * cell.tool.teeth * programme.turns, 1),
        "pose": "1",
    }


def _recorded(
    programme: Programme, course: Course, test: int, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Return times (t,) and readings (t, 3) of the force of a test, as its amplifier has them."""
    assert course.force is not None
    seconds, per_turn = course.seconds[test], programme.per_turn
    at = np.concatenate([[0.0], np.cumsum(np.repeat(seconds / per_turn, per_turn))])[:-1]
    force = course.force[test]
    end = int(course.made[test])
    first = at[max(0, end - _RECORDED) * per_turn]
    sensor = Dynamometer(
        programme.rate, "work", programme.crosstalk, noise=programme.noise, resonance=programme.resonance
    )

    def on_tool(t: Array) -> Array:
        return np.stack([np.interp(t + first, at, force[:, axis]) for axis in range(3)], axis=1)

    time, read = record(sensor, on_tool, float(at[end * per_turn - 1] - first), rng)
    hum = np.sin(2.0 * math.pi * programme.mains_hz * time[:, None] + rng.uniform(0.0, 6.3, 3))
    return time, read + programme.mains * hum


def _impacts(folder: Path, cell: Cell, programme: Programme, rng: np.random.Generator) -> list[Row]:
    """Write the blows along what is taken for x and y, or the transfer functions made of them."""
    rows: list[Row] = []
    used = programme.hammer
    for place, axis in enumerate("xy"):
        records = hammer.struck(cell.resonances, used, place, cell.flats, rng)
        if programme.impact_files == "record":
            for i, one in enumerate(records, start=1):
                file = f"impacts/1{axis}-{i}.parquet"
                write_signal(folder / file, one)
                rows.append(impact_row(f"1{axis}", file, "record", "m/s2", i))
            continue
        frequency, frf, coherence = hammer.averaged(records, used.rate)
        inside = frequency < 1.07 * used.tip_hz
        file = f"impacts/1{axis}.parquet"
        columns = {"frequency_hz": frequency, "real": frf.real, "imag": frf.imag, "coherence": coherence}
        write_signal(folder / file, {name: values[inside] for name, values in columns.items()})
        rows.append(impact_row(f"1{axis}", file, "frf", "m"))
    return rows


def _manifest(name: str, cell: Cell, programme: Programme) -> Row:
    law = cell.law
    declared = {
        "ktc_n_mm2": round(law.ktc / N_MM2 * programme.declared[0]),
        "krc_n_mm2": round(law.krc / N_MM2 * programme.declared[1]),
        "kac_n_mm2": round(law.kac / N_MM2),
        "kte_n_mm": round(law.kte / N_MM, 1),
        "kre_n_mm": round(law.kre / N_MM, 1),
        "kae_n_mm": 0,
    }
    instruments: Row = {"hammer": {"rate_hz": programme.hammer.rate, "window": "none"}}
    if programme.records:
        noise = round(programme.noise, 1)
        instruments["dynamometer"] = {
            "rate_hz": programme.rate,
            "reads": "work",
            "range_n": 5000,
            "noise_n": noise,
        }
    return {
        "format": 1,
        "batch": name,
        "title": "Tests on either side of the stability boundary, "
        + " and ".join("slots" if kind == "slot" else f"{kind} milling" for kind in programme.kinds),
        "source": "simulated",
        "cell": "unknown",
        "tool": {
            "diameter_mm": round(cell.tool.diameter / MM, 6),
            "teeth": cell.tool.teeth,
            "helix_deg": 0,
            "pitch_deg": [360 / cell.tool.teeth] * cell.tool.teeth,
        },
        "work": {"material": "unknown", "size_mm": [100, 60, 30]},
        "coefficients": declared,
        "instruments": instruments,
    }


def _world(cell: Cell, programme: Programme, scatter: float, tests: int) -> Row:
    """Return what was drawn, in plain units."""
    s, spindle, r, h = cell.session, cell.spindle, cell.resonances, programme.hammer
    return {
        "tests": tests,
        "speeds": len(programme.speeds),
        "kinds": list(programme.kinds),
        "order": programme.order,
        "records": programme.records,
        "impact_files": programme.impact_files,
        "speed_off_percent": round(100.0 * spindle.off, 3),
        "speed_wander_percent": round(100.0 * spindle.wander, 3),
        "speed_wander_s": round(spindle.wander_s, 2),
        "speed_droop_percent": round(100.0 * spindle.droop, 3),
        "bearing_change_percent": round(100.0 * spindle.bearing, 2),
        "depth_off_um": round(s.depth_off / UM, 1),
        "depth_sd_um": round(s.depth_sd / UM, 1),
        "force_scatter_percent": [round(100.0 * s.common, 2), round(100.0 * s.own, 2)],
        "force_drift_percent": round(100.0 * s.drift, 2),
        "wear_land_um": round(cell.flank.land / UM, 1),
        "runout_um": round(cell.tool.runout / UM, 2),
        "unequal_teeth_um": (cell.tool.unequal / UM).round(2).tolist(),
        "resonances_hz": r.hz.round(1).tolist(),
        "damping": r.damping.round(4).tolist(),
        "stiffness_n_um": (r.stiffness / 1e6).round(2).tolist(),
        "heading_deg": np.degrees(r.heading).round(2).tolist(),
        "largest_shared_damping": round(float(np.abs(r.shared - np.eye(len(r.hz))).max()), 3),
        "listeners": asdict(programme.ears),
        "listeners_scatter": round(scatter, 3),
        "hammer": asdict(h),
    }
