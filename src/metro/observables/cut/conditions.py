"""The cutting conditions of a batch's runs in SI, and the mean force that other observables start from."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from metro.batch.axes import signed_axes
from metro.batch.batch import Batch
from metro.batch.capabilities import blank_settings
from metro.cutting.cutter import Cutter
from metro.cutting.declared import cutter_of
from metro.cutting.engagement import engagement
from metro.cutting.force import COEFFICIENTS, Cut, mean_force
from metro.cutting.law import EdgeLaw
from metro.observables.force.dynamometer import Rows
from metro.observables.problem import Refusal
from metro.signals.conversion import sensor_to_tool
from metro.units import DEG, JSON, MM, N_MM, N_MM2, UM, Array

TO_SI = np.array([N_MM2] * 3 + [N_MM] * 3)


def cutter(batch: Batch) -> Cutter | Refusal:
    """Return the tool of the batch, with the runout of the manifest if both its parts are declared."""
    tool = batch.manifest.get("tool") or {}
    missing = [key for key in ("diameter_mm", "teeth") if key not in tool]
    if missing:
        return Refusal(f"batch.yaml: tool.{missing[0]} is not given")
    runout = (batch.manifest.get("known") or {}).get("tool_runout", {})
    runout = runout if {"radius_um", "angle_deg"} <= set(runout) else {}
    return replace(
        cutter_of(tool),
        runout_radius=runout.get("radius_um", 0.0) * UM,
        runout_angle=runout.get("angle_deg", 0.0) * DEG,
    )


def end_declared(batch: Batch) -> bool:
    """Whether the manifest says what end the tool has: flat, ball, or a corner radius."""
    return bool({"end", "corner_radius_mm"} & set(batch.manifest.get("tool") or {}))


def end_note(batch: Batch, tool: Cutter) -> str:
    """Say what shape of the tool the forces are computed with."""
    flank = f", the flank at {tool.taper / DEG:.3g}° to the tool axis" if tool.taper else ""
    if not end_declared(batch):
        assumed = "A flat end of the tool is assumed: batch.yaml states neither tool.end nor a corner radius"
        return f"{assumed}{flank}."
    if not tool.corner:
        return f"The tool has a flat end{flank}."
    kind = "a ball end" if tool.corner > 0.999 * tool.radius else "a corner radius"
    return (
        f"The tool has {kind} of {tool.corner / MM:.3g} mm{flank}; the chip is normal to the edge, whose "
        "lead is constant, and edge coefficients are per length of edge × cos(helix)."
    )


def channels(batch: Batch) -> Rows:
    """Return the rows that turn the force on the tool (work frame) into the dynamometer's channels."""
    sensor = (batch.manifest.get("instruments") or {}).get("dynamometer") or {}
    to_tool = sensor_to_tool(
        signed_axes(sensor.get("axes") or {}),
        float(sensor.get("rotation_deg", 0.0)),
        sensor.get("reads", "work"),
    )
    return tuple(tuple(float(value) for value in row) for row in np.linalg.inv(to_tool))


def unset(batch: Batch, run: str) -> str:
    """Say which settings of a cut the run table leaves blank; "" where it has them all."""
    row: Any = batch.runs.loc[run]
    blank = blank_settings(row)
    verb = "is" if len(blank) == 1 else "are"
    return f"runs.csv: {listed(blank)} of run {run} {verb} blank" if blank else ""


def listed(names: list[str]) -> str:
    """Put names into a sentence."""
    return " and ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))


def cut(batch: Batch, run: str, radius: float, give: float = 0.0) -> Cut:
    """Return the nominal settings of a run in SI; ``radius`` of the cutter in m.

    ``give``: height by which the wall is proud of the nominal one, m. At least a tenth of the radial depth
    remains.

    Raises
    ------
    ValueError
        The run table does not describe the cut.
    """
    row: Any = batch.runs.loc[run]
    if blank := unset(batch, run):
        raise ValueError(blank)
    radial = 2 * radius if math.isnan(row["radial_depth_mm"]) else row["radial_depth_mm"] * MM
    radial = max(radial - give, 0.1 * radial)
    return Cut(
        feed_per_tooth=row["feed_per_tooth_mm"] * MM,
        axial_depth=row["axial_depth_mm"] * MM,
        engagement=engagement(row["operation"], row["direction"], radial, radius),
    )


def feed(batch: Batch, run: str) -> float:
    """Return the programmed feed of a run, m/s; a tool that is not described counts as one with one tooth."""
    row: Any = batch.runs.loc[run]
    teeth = int((batch.manifest.get("tool") or {}).get("teeth", 1))
    return float(row["feed_per_tooth_mm"] * MM * teeth * row["spindle_rpm"] / 60.0)


def work_from_feed(batch: Batch, run: str) -> Array:
    """Return the rotation (3, 3) from the feed frame of a run to the work frame: a turn about z."""
    row: Any = batch.runs.loc[run]
    return turn_about_z(or_zero(row["feed_direction_deg"]) * DEG)


def or_zero(value: float) -> float:
    """Return a number of the run table, or 0 where it is blank."""
    return 0.0 if math.isnan(value) else float(value)


def turn_about_z(angle: float) -> Array:
    """Rotation matrix (3, 3) about z, counter-clockwise, rad."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def coefficients(batch: Batch, identified: JSON) -> dict[str, float] | Refusal:
    """Return the cutting coefficients in the contract's units: declared, else from this batch's forces."""
    declared = batch.manifest.get("coefficients") or {}
    given = {
        key.removesuffix("_n_mm2").removesuffix("_n_mm"): float(value)
        for key, value in declared.items()
        if key != "edge_length"
    }
    if all(name in given for name in COEFFICIENTS):
        return given | _per_axial_depth(batch, given)
    identified_here = (identified.get("force") or {}).get("waveform") or {}
    if all(name in identified_here for name in COEFFICIENTS):
        return {name: float(entry["value"]) for name, entry in identified_here.items()}
    lacking = [name for name in COEFFICIENTS if name not in given]
    return Refusal(
        f"no cutting coefficients: batch.yaml lacks {', '.join(lacking)} and no force run identifies them"
    )


def _per_axial_depth(batch: Batch, given: Mapping[str, float]) -> dict[str, float]:
    """Convert edge coefficients that are declared per arc of edge to axial depth: 1/cos(helix) times."""
    if batch.manifest["coefficients"].get("edge_length", "axial") == "axial":
        return {}
    helix = batch.manifest["tool"].get("helix_deg", 0.0) * DEG
    return {name: given[name] / math.cos(helix) for name in ("kte", "kre", "kae")}


def mean_force_on_tool(batch: Batch, run: str, values: Mapping[str, float], give: float = 0.0) -> Array:
    """Mean cutting force of a run on the tool, (3,) N, in the work frame.

    ``values`` are those of :func:`coefficients`; ``give`` is that of :func:`cut`.

    Raises
    ------
    ValueError
        If the manifest does not describe the tool, or the run table not the cut.
    """
    tool = cutter(batch)
    if isinstance(tool, Refusal):
        raise ValueError(tool.reason)
    si = np.array([values[name] for name in COEFFICIENTS]) * TO_SI
    return work_from_feed(batch, run) @ mean_force(tool, EdgeLaw(), cut(batch, run, tool.radius, give), si)
