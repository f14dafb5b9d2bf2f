"""Stability: modes from impact tests, the lobes that follow, and the probability that a run chatters."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.observables.observable import Observable
from metro.observables.problem import BaseFit, Refusal
from metro.observables.published import modes as printed_modes
from metro.observables.quantity import quantity
from metro.observables.stability import NAME, TABLES
from metro.observables.stability import boundary as stability
from metro.observables.stability import chatter as chatter_runs
from metro.observables.stability import methods as lobe_methods
from metro.observables.stability import positions as lobe_positions
from metro.observables.stability.cases import cases_of
from metro.observables.stability.modal_test import observe_modes
from metro.observables.stability.pickups import pickups
from metro.observables.stability.positions import Tip
from metro.observables.stability.problem import LabelProblem
from metro.observables.stability.tracks import track
from metro.units import JSON, MM, Array

_PRINTED = "modes as printed, without intervals: the bands hold the uncertainty of the coefficients alone"
# Columns of the tables that are written even where they have no rows.
_COLUMNS: dict[str, tuple[str, ...]] = {
    "lobes": (
        *("position", "rpm", "depth_mm", "depth_lo_mm", "depth_hi_mm", "depth_p05_mm", "depth_p95_mm"),
        *("chatter_hz", "kind", "error_mm", "interpolated"),
        *("operation", "direction", "radial_depth_mm", "feed_direction_deg", "feed_per_tooth_mm"),
    ),
    "lobe_runs": (
        *("run", "position", "own_modes", "rpm", "depth_mm", "boundary_mm", "predicted_hz"),
        *("unstable", "probability_unstable"),
    ),
    "lobe_methods": lobe_methods.METHOD_COLUMNS,
    "lobe_islands": lobe_methods.ISLAND_COLUMNS,
    "lobe_stations": lobe_methods.STATION_COLUMNS,
}


def observe(batch: Batch, read: Tables, identified: JSON) -> dict[str, pd.DataFrame] | Refusal:
    """Identify the modes of every position and solve the lobes of the cuts that were made there.

    Tables ``modes``, ``mode_notes`` (what they leave in doubt), ``mode_tracks``, ``mode_shapes``,
    ``mode_mac``, ``mode_pickups``, ``mode_cross``, ``frf_used``, ``stabilisation``, ``lobes`` (diagram per
    position), ``lobe_runs`` (probability per run with a depth), ``chatter_runs`` (what the runs' own records
    say), ``chatter_records`` (a record of each kind), those of
    :mod:`metro.observables.stability.methods`, ``lobes_refused`` (reasons and notes). Without modes: what the
    records say of chatter, and why there are no lobes.
    """
    test = observe_modes(read, batch.instrument("hammer"))
    modes = test.modes
    notes: list[str] = []
    if modes.empty and not test.notes:
        published = read("published")
        modes = printed_modes.printed_modes(published)
        identified = {**printed_modes.printed_coefficients(published), **identified}
        notes = [] if modes.empty else [_PRINTED]
    if modes.empty:
        return _heard(batch, read, "; ".join(test.notes) or "no impacts.csv: no hammer record and no FRF")
    cutting = stability.cutting(batch, identified)
    where = lobe_positions.places(read("stations"))
    tracks = track(modes, test.shapes, where) if len(test.shapes) else pd.DataFrame()
    modes = modes.assign(mode=tracks["mode"]) if len(tracks) else modes
    tips = lobe_positions.tips(modes, notes)
    chatter = chatter_runs.observe_chatter(batch, read, modes)
    records = chatter_runs.observe_records(batch, read, chatter)
    parts: dict[str, list[pd.DataFrame]] = {}
    if not isinstance(cutting, Refusal):
        notes += stability.assumptions(batch)
        pairs = lobe_positions.pairs(batch, tips, where, notes)
        measured = chatter_runs.measured(chatter)
        parts = _solved(batch, cutting, pairs, tips=tips, where=where, measured=measured, notes=notes)
    tables = {name: _joined(parts.get(name, []), columns) for name, columns in _COLUMNS.items()}
    reason = "no run with a depth of cut at a position whose modes are known" if tables["lobes"].empty else ""
    reason = cutting.reason if isinstance(cutting, Refusal) else reason
    said = [("refusal", reason)] if reason else []
    refused = pd.DataFrame([*said, *(("note", n) for n in notes)], columns=["kind", "reason"], dtype=str)
    modal = {"modes": modes, "frf_used": test.used, "stabilisation": test.stabilisation}
    modal |= {"mode_shapes": test.shapes, "mode_mac": test.alike, "mode_cross": test.cross}
    modal |= {"mode_tracks": tracks, "mode_pickups": pickups(test.used, read("pickups"))}
    modal |= {"mode_notes": pd.DataFrame({"note": test.notes}, dtype=str)}
    return {
        **modal,
        **tables,
        "chatter_runs": chatter,
        "chatter_records": records,
        "lobes_refused": refused,
    }


def _heard(batch: Batch, read: Tables, reason: str) -> dict[str, pd.DataFrame] | Refusal:
    """Where there are no modes: what the records of the cuts say of chatter, if any says something."""
    unknown = pd.DataFrame(columns=["used", "frequency_hz", "damping"], dtype=float)
    chatter = chatter_runs.observe_chatter(batch, read, unknown)
    if not chatter["probability"].notna().any():
        return Refusal(reason)
    return {
        "chatter_runs": chatter,
        "chatter_records": chatter_runs.observe_records(batch, read, chatter),
        "lobes_refused": pd.DataFrame([("refusal", reason)], columns=["kind", "reason"], dtype=str),
    }


def _joined(parts: list[pd.DataFrame], columns: tuple[str, ...]) -> pd.DataFrame:
    filled = [part for part in parts if len(part)]
    return pd.concat(filled, ignore_index=True) if filled else pd.DataFrame(columns=list(columns))


def _solved(
    batch: Batch,
    cutting: stability.Cutting,
    pairs: list[tuple[pd.DataFrame, Tip]],
    *,
    tips: list[Tip],
    where: Mapping[str, Array],
    measured: pd.DataFrame,
    notes: list[str],
) -> dict[str, list[pd.DataFrame]]:
    """Tables of lobes, as parts to be joined: one boundary per position, of the cut that most runs share.

    A position without runs has that of the cut that most runs of the batch share, at their speeds.
    """
    parts: dict[str, list[pd.DataFrame]] = {name: [] for name in _COLUMNS}
    solved = []
    for rows, tip in pairs:
        for place, same in enumerate(sorted(stability.same_cut(rows), key=len, reverse=True)):
            whole = place == 0
            rpm = stability.speeds_of(same, whole=whole)
            lobes = stability.solve(tip, cutting, same.iloc[0], rpm, check=whole)
            parts["lobe_runs"].append(stability.run_probabilities(batch, lobes, same, measured))
            if whole and np.any(np.isfinite(lobes.boundary.depth)):
                solved.append(lobes)
                feed = float(same["feed_per_tooth_mm"].iloc[0]) * MM
                deepest = stability.deepest(lobes, same)
                parts["lobes"].append(_of_cut(lobes, same))
                parts["lobe_methods"].append(lobe_methods.methods(lobes, cutting.tool, feed))
                notes += lobe_methods.left_out(parts["lobe_methods"][-1], cutting.tool)
                parts["lobe_islands"].append(lobe_methods.islands(lobes, deepest))
    solved += _elsewhere(cutting, pairs, _others(tips, pairs), parts)
    parts["lobe_stations"].append(lobe_methods.stations(solved, where))
    notes += stability.worth(solved)
    return parts


def _of_cut(lobes: stability.Lobes, runs: pd.DataFrame) -> pd.DataFrame:
    """Return a diagram with the settings of its cut, and the usual feed of the runs that share it."""
    names = ("operation", "direction", "radial_depth_mm", "feed_direction_deg")
    settings = {name: runs[name].iloc[0] for name in names}
    feed = float(runs["feed_per_tooth_mm"].median())
    return stability.diagram(lobes).assign(**settings, feed_per_tooth_mm=feed)


def _others(tips: list[Tip], pairs: list[tuple[pd.DataFrame, Tip]]) -> list[Tip]:
    """Return the structures that no run belongs to."""
    return [tip for tip in tips if not any(tip is own for _, own in pairs)]


def _elsewhere(
    cutting: stability.Cutting,
    pairs: list[tuple[pd.DataFrame, Tip]],
    tips: list[Tip],
    parts: dict[str, list[pd.DataFrame]],
) -> list[stability.Lobes]:
    """Solve the lobes of positions without runs; the slower methods are not repeated there."""
    cuts = [same for rows, _ in pairs for same in stability.same_cut(rows)]
    if not cuts:
        return []
    most = max(cuts, key=len)
    rpm, feed = stability.speeds_of(most, whole=True), float(most["feed_per_tooth_mm"].iloc[0]) * MM
    solved = [stability.solve(tip, cutting, most.iloc[0], rpm, check=False) for tip in tips]
    solved = [lobes for lobes in solved if np.any(np.isfinite(lobes.boundary.depth))]
    for lobes in solved:
        parts["lobes"].append(_of_cut(lobes, most))
        parts["lobe_methods"].append(lobe_methods.methods(lobes, cutting.tool, feed, check=False))
    return solved


def problem(batch: Batch, observed: Mapping[str, pd.DataFrame], identified: JSON) -> LabelProblem | Refusal:
    """Return the labelled runs with their predicted probabilities."""
    if "lobes_refused" not in observed:
        return Refusal((identified.get("not_identified") or {}).get(NAME, "no impacts.csv: no modes"))
    said = observed["lobes_refused"]
    refusals = said["reason"][said["kind"] == "refusal"]
    if len(refusals):
        return Refusal(str(refusals.iloc[0]))
    rows = observed["lobe_runs"]
    rows = rows[rows["unstable"] >= 0]
    if rows.empty:
        return Refusal("no run says whether it was stable, by its record or in runs.csv")
    table = batch.runs.loc[rows["run"]]
    cutting, tips = stability.cutting(batch, identified), lobe_positions.tips(observed["modes"], [])
    position = dict(zip(rows["run"], rows["position"].astype(str), strict=True))
    if isinstance(cutting, Refusal):
        return cutting
    cases, point = cases_of(table, position, tips, cutting)
    return LabelProblem(
        NAME,
        tuple(rows["run"]),
        tuple(table["condition"].astype(str)),
        tuple(table["role"].astype(str)),
        rows["unstable"].to_numpy() > 0,
        rows["rpm"].to_numpy(float),
        rows["depth_mm"].to_numpy(float) * MM,
        rows["probability_unstable"].to_numpy(float),
        tuple(said["reason"][said["kind"] == "note"]),
        cases,
        point,
        _chatter_hz(observed, rows),
    )


def _chatter_hz(observed: Mapping[str, pd.DataFrame], rows: pd.DataFrame) -> Array:
    """Return the frequency (n,), Hz, at which the tests chattered, as their records say; NaN where none."""
    known = observed["chatter_runs"].set_index("run")["chatter_hz"].astype(float)
    measured = known.reindex(rows["run"]).where((rows["unstable"] > 0).to_numpy())
    return np.asarray(measured.to_numpy(float))


def report(
    batch: Batch,
    observed: Mapping[str, pd.DataFrame],
    _identified: JSON,
    _task: LabelProblem | Refusal,
    _fit: BaseFit | None,
) -> JSON:
    """Blocks ``modes`` and ``lobes`` of identified.json; none where no modes are known."""
    if "modes" not in observed:
        return {}
    modes = [
        {
            "position": _number(row["position"]),
            "direction": row["direction"],
            **({"mode": row["mode"]} if "mode" in row else {}),
            "frequency": quantity(row["frequency_hz"], row["frequency_sd_hz"], "Hz"),
            "damping": quantity(row["damping"], row["damping_sd"], "1"),
            "stiffness": quantity(row["stiffness_n_m"], row["stiffness_sd"], "N/m"),
            "mass": quantity(row["mass_kg"], row.get("mass_sd", math.nan), "kg"),
            **_resolution(row),
        }
        for _, row in observed["modes"].iterrows()
    ]
    lobes = [
        {
            "position": _number(position),
            "boundary": f"data/processed/{batch.name}/lobes_final.parquet",
            "lowest_mm": _lowest(rows),
        }
        for position, rows in observed["lobes"].groupby("position", sort=False)
    ]
    return {"modes": modes, "lobes": lobes} if lobes else {"modes": modes}


def _number(position: object) -> int | str:
    """Positions that are numbers are written as numbers, as in the contract."""
    text = str(position)
    return int(text) if text.isdigit() else text


def _resolution(row: pd.Series) -> JSON:
    """Say so where the data do not resolve the mode; a printed one counts as resolved."""
    return {} if row.get("resolved", True) else {"resolved": False}


def _lowest(rows: pd.DataFrame) -> JSON:
    best = rows.iloc[int(rows["depth_mm"].argmin())]
    interval = [float(best["depth_lo_mm"]), float(best["depth_hi_mm"])]
    return {"value": float(best["depth_mm"]), "ci95": interval, "unit": "mm"}


OBSERVABLE = Observable(
    NAME, TABLES, observe, problem, report, observed_with_coefficients=True, reported_without_fit=True
)
