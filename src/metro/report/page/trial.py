"""A cut that can be tried in the page: tool, coefficients and the settings that its sliders move."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from metro.cutting.engagement import Engagement, engagement
from metro.report.numbers import listing, percent
from metro.report.page.boundary import TITLE as BOUNDARY
from metro.report.page.curves import HELP
from metro.report.page.packing import decimals
from metro.report.results import Results
from metro.report.sections.key_results import FORCE_SETS
from metro.report.sections.trust import do_not_use
from metro.units import DEG, JSON, MM

COEFFICIENTS = ("ktc", "krc", "kac", "kte", "kre", "kae")
SHAPES = ("corner_radius_mm", "taper_deg", "cutting_edge_angle_deg")  # of tools that are no cylinders
TITLE = "Try a cut"
NOTE = (
    "This page computes the force with the identified coefficients, a rigid machine and circular tooth paths."
)
COVERAGE = 1.96  # standard deviations from a value to an end of its 95 % interval
LEAST_RUNOUT = 20.0  # end of the slider, µm


def trial_cut(results: Results) -> JSON | None:
    """Return tool, coefficients and sliders of a cut; None where a cylinder's force cannot be computed."""
    tool = results.batch.manifest.get("tool") or {}
    force = results.identified.get("force") or {}
    coefficients = _coefficients(force)
    row = _row(results)
    if coefficients is None or row is None or not {"diameter_mm", "teeth"} <= set(tool):
        return None
    if tool.get("end") == "ball" or any(tool.get(name) for name in SHAPES):
        return None
    radius = 0.5 * float(tool["diameter_mm"])
    arc = _arc(row, radius)
    if arc is None:
        return None
    runout_um, runout_deg = _runout(results)
    return {
        "kind": "trial",
        "title": TITLE,
        "x": "spindle angle (°)",
        "y": "cutting force on the tool (N)",
        "unit": "N",
        "decimals": decimals(math.nan, max(coefficients) * row["feed_per_tooth_mm"] * row["axial_depth_mm"]),
        "tool": {
            "radius": radius,
            "helix": float(tool.get("helix_deg", 0.0)) * DEG,
            "teeth": _teeth(tool),
            "entry": arc.entry,
            "exit": arc.exit,
            "coefficients": coefficients,
            "covariance": _covariance(force),
            "error": _share(results),
            "runout": runout_deg * DEG,
        },
        "sliders": _sliders(results, row, runout_um),
        "boundary": BOUNDARY if _bounds(results, arc, radius) else None,
        "note": " ".join([_said(row), NOTE, *_error(results)]),
        "help": HELP,
    }


def _coefficients(force: JSON) -> list[float] | None:
    """Return the six coefficients, N/mm² and N/mm, of the best set that has them all."""
    block: JSON = next((force[name] for name in FORCE_SETS if force.get(name)), {})
    known = [
        block[name]["value"] for name in COEFFICIENTS if (block.get(name) or {}).get("value") is not None
    ]
    return [float(value) for value in known] if len(known) == len(COEFFICIENTS) else None


def _covariance(force: JSON) -> list[list[float]] | None:
    """Return the covariance (6, 6) of the errors of the coefficients of waveforms; None where not known."""
    block, stated = force.get("waveform") or {}, force.get("correlation") or {}
    names = list(stated.get("coefficients") or [])
    if not set(COEFFICIENTS) <= set(names) or not set(COEFFICIENTS) <= set(block):
        return None
    ends = np.array([block[name]["ci95"] for name in COEFFICIENTS], dtype=float)
    deviation = 0.5 * (ends[:, 1] - ends[:, 0]) / COVERAGE
    if not np.isfinite(deviation).all():
        return None
    at = [names.index(name) for name in COEFFICIENTS]
    correlation = np.array(stated["matrix"])[np.ix_(at, at)]
    return [[float(f"{value:.6g}") for value in row] for row in np.outer(deviation, deviation) * correlation]


def _share(results: Results) -> float | None:
    """Return the error of the whole model on held-out runs over their signal; None without such runs."""
    share = ((results.verdicts().get("force") or {}).get("after") or {}).get("nrmse")
    return float(share) if share is not None and math.isfinite(share) else None


def _row(results: Results) -> Mapping[str, Any] | None:
    """Return the settings of the first run whose force is that of a level path."""
    runs = results.batch.runs
    needed = ("operation", "feed_per_tooth_mm", "axial_depth_mm", "spindle_rpm")
    if not set(needed) <= set(runs):
        return None
    known = runs[(runs["operation"] != "helical") & runs[list(needed[1:])].gt(0.0).all(axis=1)]
    return None if known.empty else dict(known.iloc[0])


def _arc(row: Mapping[str, Any], radius: float) -> Engagement | None:
    """Return the arc of a run; a blank radial depth is the whole diameter, one beyond it has no arc."""
    radial = float(row.get("radial_depth_mm", math.nan))
    radial = 2.0 * radius if math.isnan(radial) else radial
    try:
        return engagement(str(row["operation"]), str(row.get("direction") or ""), radial * MM, radius * MM)
    except ValueError:
        return None


def _teeth(tool: JSON) -> list[float]:
    pitch = tool.get("pitch_deg") or [360.0 / int(tool["teeth"])] * int(tool["teeth"])
    return [angle * DEG for angle in itertools.accumulate(pitch[:-1], initial=0.0)]


def _runout(results: Results) -> tuple[float, float]:
    """Return radius, µm, and angle, °, of the runout that was found, else declared, else none."""
    effects = (results.verdicts().get("force") or {}).get("effects") or []
    found: JSON = next((each["parameters"] for each in effects if each.get("effect") == "tool_runout"), {})
    declared = (results.batch.manifest.get("known") or {}).get("tool_runout") or {}
    radius, angle = (
        (found.get(name) or {}).get("value", declared.get(name)) for name in ("radius_um", "angle_deg")
    )
    return float(radius or 0.0), float(angle or 0.0)


def _sliders(results: Results, row: Mapping[str, Any], runout_um: float) -> list[JSON]:
    """Return the sliders, each from a small value to about twice the largest of the runs."""
    runs = results.batch.runs
    deepest, fastest, thickest = (
        float(np.nanmax(runs[name].to_numpy(float)))
        for name in ("axial_depth_mm", "spindle_rpm", "feed_per_tooth_mm")
    )
    settings = (
        ("depth", "axial depth", "mm", 2.0 * deepest, float(row["axial_depth_mm"])),
        ("rpm", "spindle speed", "rpm", 1.5 * fastest, float(row["spindle_rpm"])),
        ("feed", "feed per tooth", "mm", 2.0 * thickest, float(row["feed_per_tooth_mm"])),
        ("runout", "runout of the tool", "µm", max(LEAST_RUNOUT, 2.0 * runout_um), runout_um),
    )
    return [_slider(*setting) for setting in settings]


def _slider(key: str, name: str, unit: str, high: float, value: float) -> JSON:
    """Return a slider of one or two hundred steps, in which its first value is one."""
    step = 10.0 ** math.floor(math.log10(high / 100.0))
    low = 0.0 if key == "runout" else step
    names = {"key": key, "name": name, "unit": unit}
    digits = max(0, -math.floor(math.log10(step)))
    ends = {"low": low, "high": high, "step": step, "value": value}
    return {**names, **{end: round(number, digits) for end, number in ends.items()}}


def _bounds(results: Results, arc: Engagement, radius: float) -> bool:
    """Whether the batch's boundary is that of cuts over the same arc."""
    table = results.tables.get("lobes_final", results.tables.get("lobes"))
    if table is None or table.empty or "operation" not in table:
        return False
    own = _arc(dict(table.iloc[0]), radius)
    return (
        own is not None
        and math.isclose(own.entry, arc.entry, abs_tol=1e-6)
        and math.isclose(own.exit, arc.exit, abs_tol=1e-6)
    )


def _said(row: Mapping[str, Any]) -> str:
    radial = float(row.get("radial_depth_mm", math.nan))
    wide = "" if math.isnan(radial) else f", {radial:g} mm wide"
    direction = str(row.get("direction") or "")
    how = f", {direction} milling" if direction in ("up", "down") else ""
    text = f"{row['operation']}{how}{wide}."
    return text[:1].upper() + text[1:]


def _error(results: Results) -> list[str]:
    """Say whether to use it, how far the whole model is from held-out runs, if any, and what is drawn."""
    share, sources = _share(results), ["the errors of the coefficients"]
    warning = do_not_use(results.verdicts().get("force") or {})
    said = [f"{warning[:1].upper()}{warning[1:]}"] if warning else []
    if share is not None:
        said += [f"On held-out runs the whole model has an error of {percent(share)} of the signal."]
        sources.append("that error")
    if _covariance(results.identified.get("force") or {}) is not None:
        said.append(f"The bands are 95 % intervals; they contain {listing(sources)}.")
    return said
