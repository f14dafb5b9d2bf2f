"""The results that page one begins with: what was identified, each value with its interval."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from metro.report.content import Item, Table
from metro.report.numbers import listing, number, quantity, with_interval
from metro.report.results import Results
from metro.report.sections.while_cutting import factor_of
from metro.units import JSON, printed

# The best of the sets of cutting coefficients that a batch has, and what it was identified from.
FORCE_SETS = {
    "waveform": "waveforms of the identification runs",
    "mean_corrected": "mean forces, corrected for the effects found",
    "mean": "mean forces of the identification runs",
    "mean_all_runs": "mean forces of all runs",
}
COEFFICIENTS = {
    "shear coefficients": {"ktc": "K_tc", "krc": "K_rc", "kac": "K_ac", "kfac": "K_Fac"},
    "edge coefficients": {"kte": "K_te", "kre": "K_re", "kae": "K_ae", "kfae": "K_Fae"},
}
Row = tuple[str, str, str]


def key_results(results: Results) -> list[Item]:
    """Tabulate the main results of a batch; nothing where nothing was identified."""
    rows = [
        *_coefficients(results.identified.get("force") or {}),
        *_modes(results.identified.get("modes") or []),
        *_boundary(results),
        *_stiffness(results),
        *_faces(results),
    ]
    if not rows:
        return []
    header = ["result", "value with 95 % interval", "from"]
    return [Table(header, [list(row) for row in rows], "Main results.", [1.2, 3.5, 1.7])]


def _coefficients(force: JSON) -> Iterator[Row]:
    """Give the cutting coefficients, shear and edge terms in a line each.

    Where the best set leaves the main coefficient open, the set that knows it best stands below.
    """
    sets = [name for name in FORCE_SETS if force.get(name)]
    if not sets:
        return
    best = min(sets, key=lambda name: _half_interval(force[name]))
    is_open = _half_interval(force[sets[0]]) > abs(float(force[sets[0]].get("ktc", {}).get("value") or 0.0))
    better = is_open and _half_interval(force[best]) < 0.5 * _half_interval(force[sets[0]])
    for name in (sets[0], best) if better else sets[:1]:
        block = force[name]
        for title, symbols in COEFFICIENTS.items():
            known = [symbol for symbol in symbols if symbol in block]
            if known:
                values = ", ".join(f"{symbols[one]} {quantity(block[one], with_unit=False)}" for one in known)
                yield title, f"{values} {printed(block[known[0]].get('unit'))}", FORCE_SETS[name]


def _half_interval(block: JSON) -> float:
    """Half of the 95 % interval of K_tc; infinite where there is none."""
    interval = (block.get("ktc") or {}).get("ci95")
    return 0.5 * (float(interval[1]) - float(interval[0])) if interval else math.inf


def receptance_peak(mode: JSON) -> float:
    """Receptance of a single mode at its peak, m/N; 0 if its stiffness is not known."""
    stiffness, damping = ((mode.get(name) or {}).get("value") for name in ("stiffness", "damping"))
    if not stiffness or not damping or not mode.get("resolved", True):
        return 0.0
    return float(1.0 / (2.0 * damping * stiffness))


def _modes(modes: list[JSON]) -> Iterator[Row]:
    """Give the most flexible mode, the one with the largest receptance at its peak."""
    if not modes:
        return
    softest = max(modes, key=receptance_peak)
    peak = receptance_peak(softest)
    count = f"{len(modes)} mode{'s' if len(modes) > 1 else ''}"
    if peak == 0.0:
        ends = sorted(float(mode["frequency"]["value"]) for mode in modes)
        span = " to ".join(dict.fromkeys(number(end, 4) for end in (ends[0], ends[-1])))
        yield "natural frequencies", f"{count}, {span} Hz; stiffness not determined", "frequency responses"
        return
    value = (
        f"{quantity(softest['frequency'])}, damping ratio {quantity(softest['damping'], with_unit=False)}, "
        f"stiffness {_in_n_um(softest['stiffness'])}, receptance {number(peak)} m/N"
    )
    where = f"position {softest['position']}, direction {softest['direction']}; {count} identified"
    yield "most flexible mode", value, where


def _boundary(results: Results) -> Iterator[Row]:
    """Give the lowest stable depth over all speeds and positions, with the speed where it is reached."""
    blocks = [
        block for block in results.identified.get("lobes") or [] if isinstance(block.get("lowest_mm"), dict)
    ]
    if not blocks:
        return
    lowest = min(blocks, key=lambda block: float(block["lowest_mm"]["value"]))
    place = f"position {lowest['position']}" if lowest.get("position") is not None else ""
    table = results.tables.get("lobes_final")
    speed = ""
    if table is not None and table["depth_mm"].notna().any():
        own = table[table["position"].astype(str) == str(lowest.get("position"))]
        own = own if len(own) and own["depth_mm"].notna().any() else table
        worst = own.nsmallest(1, "depth_mm")["rpm"].iloc[0]
        speed = f"at {number(float(worst), 4)} rpm"
    count = f"the lowest of {len(blocks)} positions" if len(blocks) > 1 else ""
    yield (
        "lowest stable depth",
        " ".join(filter(None, [quantity(lowest["lowest_mm"]), speed])),
        ", ".join(filter(None, [place, count])) or "stability boundary",
    )


def _stiffness(results: Results) -> Iterator[Row]:
    """Give the stiffness of the joints, and the least at the tool by load tests, of poses that cut if any."""
    joints = (results.identified.get("arm") or {}).get("joint_stiffness") or []
    known = [entry for entry in joints if isinstance(entry, dict) and entry.get("value") is not None]
    if known:
        # One power of ten for all joints, so that their values can be compared at a glance.
        values = ", ".join(_scaled(entry, 1e-6) for entry in joints)
        yield (
            f"joint stiffness 1 to {len(joints)}",
            f"{values} MN m/rad",
            "load tests",
        )
    table = results.tables.get("load_points")
    rows: list[Mapping[Any, Any]] = [] if table is None else list(table.to_dict("records"))
    poses = set(results.batch.runs["pose"].astype(str)) if "pose" in results.batch.runs else set()
    cut = [row for row in rows if str(row["pose"]) and str(row["pose"]) in poses]
    rows = cut or rows
    axes = [(row, axis) for row in rows for axis in "xyz" if row[f"k{axis}_n_um"] > 0]
    if axes:
        row, axis = min(axes, key=lambda one: float(one[0][f"k{one[1]}_n_um"]))
        low_high = [row[f"k{axis}_{end}_n_um"] for end in ("low", "high")]
        place = ", ".join(filter(None, [str(row["pose"]), str(row["point"])]))
        value = f"{with_interval(row[f'k{axis}_n_um'], low_high)} N/µm along {axis}"
        about = f"load tests{f' at {place}' if place else ''}{', where the runs cut' if cut else ''}"
        if factor := factor_of(results):
            value += f"; {quantity({**factor, 'unit': None})} times as much while cutting"
        yield "least static stiffness", value, about


def _faces(results: Results) -> Iterator[Row]:
    """Give the flatness of the flattest and of the least flat face: by ISO 12781 where it is known.

    Without the scan's noise where that is known of all faces: noise makes every face less flat, and may make
    another one the flattest.
    """
    faces: JSON = results.identified.get("faces") or {}
    found = {run: face for run, face in faces.items() if isinstance(face, dict) and face.get("xm")}
    if not found:
        return
    standard = all(face.get("fltt") for face in found.values())
    key, name = ("fltt", "flatness FLTt") if standard else ("xm", "range X_m")
    corrected = _without_noise(results, key)
    clean = set(found) <= set(corrected)
    sizes = corrected if clean else {run: face[key] for run, face in found.items()}
    by_size = sorted(found, key=lambda run: float(sizes[run]["value"]))
    ends = list(dict.fromkeys([by_size[0], by_size[-1]]))
    value = listing([f"{quantity(sizes[run])} ({run})" for run in ends])
    about = "ISO 12781, filtered scan" if standard else "scan, unfiltered"
    about += ", its noise removed" if clean else ", with its noise"
    which = f"; flattest and least flat of {len(found)} faces" if len(ends) > 1 else ""
    yield name, value, about + which


def _without_noise(results: Results, key: str) -> dict[str, JSON]:
    """Return an index of each face whose interval without the scan's noise is known."""
    table = results.tables.get("face_indices")
    rows = [] if table is None else table[table["index_name"] == key].to_dict("records")
    return {
        str(row["run"]): {
            "value": row["corrected_um"],
            "ci95": [row["low_um"], row["high_um"]],
            "unit": "um",
        }
        for row in rows
        if math.isfinite(row["high_um"])
    }


def _in_n_um(entry: JSON) -> str:
    return f"{_scaled(entry, 1e-6)} N/µm"


def _scaled(entry: JSON | None, factor: float) -> str:
    """Write a quantity in a unit that is ``1 / factor`` times as large."""
    value = (entry or {}).get("value")
    if entry is None or value is None:
        return "not determined"
    ends = [end * factor if end is not None else None for end in entry.get("ci95") or []]
    return with_interval(value * factor, ends)
