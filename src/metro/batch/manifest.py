"""batch.yaml: what the batch is, the cell, the tool, the work and the instruments."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from metro.batch.axes import AXES, signed_axes
from metro.batch.documents import Likeness, read_yaml, schema_findings
from metro.batch.entries import FILE, entry, without_entries
from metro.batch.findings import Finding, Severity, errors, linked_outside, shown
from metro.batch.known import known_findings
from metro.batch.planned import NUMBERS
from metro.batch.sources import mapping_findings
from metro.spelling import resembling, suggestion
from metro.units import JSON, Array

ROUNDED_MM = 1e-6
CLOSED_DEG = 0.1  # printed pitch angles are rounded
ORTHONORMAL = 1e-3  # printed direction cosines are rounded


def read_manifest(folder: Path) -> tuple[JSON, list[Finding]]:
    """Read and validate ``batch.yaml`` (no defaults); what is wrong comes with it, and is left out.

    Parameters
    ----------
    folder : the batch.
    """
    outside = linked_outside(folder, folder / FILE, FILE)
    content, findings = ({}, outside) if outside else read_yaml(folder / FILE, FILE)
    if findings:
        return content, findings
    findings = schema_findings(content, "batch", FILE, _unknown_key)
    faulty = [finding.column for finding in findings if finding.severity == "error"]
    for path, rule in RULES.items():
        value = entry(content, path)
        if value is not None and not any(_overlap(path, column) for column in faulty):
            message = rule(value)
            findings += [Finding("error", FILE, message, column=path)] if message else []
    for section, check in SECTIONS.items():
        if section in content and not any(_overlap(section, column) for column in faulty):
            findings += check(content[section])
    sound = without_entries(content, (finding.column for finding in errors(findings)))
    return sound, [*findings, *_overdue(sound), *_about_the_folder(content, folder)]


def with_defaults(manifest: JSON) -> JSON:
    """Return a valid manifest with the contract's defaults filled in; what has no default stays absent."""
    filled = {"title": manifest["batch"], "coefficients": {}, "known": {}, **manifest}
    filled["tool"] = dict(manifest.get("tool") or {})
    filled["work"] = dict(manifest.get("work") or {})
    filled["work_in_base"] = {
        "xyz_mm": [0, 0, 0],
        "rpy_deg": [0, 0, 0],
        **(manifest.get("work_in_base") or {}),
    }
    teeth = filled["tool"].get("teeth")
    if teeth:
        filled["tool"].setdefault("pitch_deg", [360 / teeth] * teeth)
    if filled["coefficients"]:
        filled["coefficients"] = {"edge_length": "axial", **filled["coefficients"]}
    declared = {name: value or {} for name, value in (manifest.get("instruments") or {}).items()}
    # An unknown one, which a warning names, may hold anything.
    instruments = {name: dict(value) for name, value in declared.items() if isinstance(value, dict)}
    for name, defaults in INSTRUMENT_DEFAULTS.items():
        if name in instruments:
            instruments[name] = {**defaults, **instruments[name]}
    if "dynamometer" in instruments:
        axes = instruments["dynamometer"].get("axes") or {}
        instruments["dynamometer"]["axes"] = {axis: axes.get(axis, axis) for axis in AXES}
    filled["instruments"] = instruments
    return filled


INSTRUMENT_DEFAULTS: dict[str, JSON] = {
    "dynamometer": {"reads": "work", "rotation_deg": 0},
    "profiler": {"cutoff_mm": 8},
    "hammer": {"window": "none"},
}


def _unknown_key(path: tuple[str, ...], like: Likeness) -> Severity:
    """Return how severe an unknown key is: fields may be added, but a misspelt one must not pass.

    Other programs add keys at the top and of instruments, other packages effects: there a resemblance alone
    is not a sign of a misspelt key.
    """
    may_be_added = path in ((), ("known",)) or (path[0] == "instruments" and path[-1] != "axes")
    return "error" if like == "slip" or (like and not may_be_added) else "warning"


def _overlap(path: str, column: str) -> bool:
    """Return whether one of two dotted paths contains the other."""
    return f"{path}.".startswith(f"{column}.") or f"{column}.".startswith(f"{path}.")


def _about_the_folder(content: JSON, folder: Path) -> list[Finding]:
    """Check the manifest against the folder it lies in."""
    findings = []
    name = content.get("batch")
    if isinstance(name, str) and name != folder.resolve().name and name != folder.name:
        message = f'found "{name}", expected the folder\'s name, "{folder.name}"'
        findings.append(Finding("error", FILE, message, column="batch"))
    if content.get("source") == "published":
        if not content.get("citation"):
            message = "is missing, expected where the published values are printed"
            findings.append(Finding("error", FILE, message, column="citation"))
        if not any((folder / f"published{suffix}").is_file() for suffix in (".csv", ".parquet")):
            message = "is not there: a batch with source: published needs its table of printed values"
            findings.append(Finding("error", "published.csv", message))
    return findings


def _tool(tool: JSON) -> str | None:
    """Check that there is a pitch angle for each tooth, that they close the circle, and the tool's shape."""
    pitch, teeth = tool.get("pitch_deg"), tool.get("teeth")
    if pitch is None:
        return _shape(tool)
    if teeth is None:
        return f"pitch_deg has {len(pitch)} angles, but teeth is missing, expected teeth: {len(pitch)}"
    if len(pitch) != teeth:
        return f"pitch_deg has {len(pitch)} angles, expected as many as teeth ({shown(teeth)})"
    if abs(sum(pitch) - 360) > CLOSED_DEG:
        return f"pitch_deg adds up to {sum(pitch):g}, expected 360 (degrees from each tooth to the next)"
    return _shape(tool)


def _shape(tool: JSON) -> str | None:
    """Check that end, corner and flank are of one tool."""
    corner, diameter = tool.get("corner_radius_mm"), tool.get("diameter_mm")
    if corner is not None:
        if diameter is None:
            return "corner_radius_mm is given without diameter_mm, expected both"
        if fault := _corner(tool, corner, diameter):
            return fault
    flank, lead = tool.get("taper_deg"), tool.get("cutting_edge_angle_deg")
    if flank is not None and lead is not None and abs(flank + lead - 90.0) > CLOSED_DEG:
        return (
            f"taper_deg is {flank:g} and cutting_edge_angle_deg {lead:g}, expected one of them: they are the "
            "same angle, from the tool axis and from the plane of the feed"
        )
    return None


def _corner(tool: JSON, corner: float, diameter: float) -> str | None:
    """Check that a corner radius fits the end and the diameter, mm."""
    if tool.get("end") == "ball" and abs(corner - 0.5 * diameter) > ROUNDED_MM:
        return (
            f"corner_radius_mm is {corner:g}, expected none with end: ball, whose radius is half of "
            f"diameter_mm ({diameter:g})"
        )
    if tool.get("end") == "flat" and corner:
        return f"corner_radius_mm is {corner:g}, expected no end beside it: a tool with a corner is not flat"
    if corner > 0.5 * diameter + ROUNDED_MM:
        return f"corner_radius_mm is {corner:g}, expected at most half of diameter_mm ({diameter:g})"
    return None


def _axes(axes: JSON) -> str | None:
    """Check that the sensor's axes are a right-handed set."""
    columns = signed_axes(axes)
    expected = "expected each of x, y, z once, as a right-handed set"
    if np.abs(columns).sum(axis=1).max() > 1:
        return f"found {shown(axes)}, which names one direction twice (a blank axis is itself), {expected}"
    if np.linalg.det(columns) < 0:
        return f"found {shown(axes)}, which is left-handed, {expected}"
    return None


def _known(known: JSON) -> Iterator[Finding]:
    """Check what is declared of effects."""
    return known_findings(known, FILE, _unknown_key)


def _limits(limits: JSON) -> Iterator[Finding]:
    """Check that limits are of columns that ``metro next`` sets, the least before the greatest."""
    for name, (low, high) in limits.items():
        column = f"limits.{name}"
        if name not in NUMBERS:
            like = resembling(name, NUMBERS)
            message = f"is no column of runs.csv that can be limited{suggestion(name, NUMBERS)}"
            yield Finding("error" if like else "warning", FILE, message, column=column)
        elif low > high:
            yield Finding("error", FILE, f"found {[low, high]}, expected the least first", column=column)


def _tolerances(tolerances: JSON) -> Iterator[Finding]:
    """Check that of two limits the lower one is the lower."""
    for name, limits in tolerances.items():
        low, high = limits.get("lower"), limits.get("upper")
        if low is not None and high is not None and low >= high:
            message = (
                f"found lower: {low:g} and upper: {high:g}, expected the lower limit below the upper one"
            )
            yield Finding("error", FILE, message, column=f"tolerances.{name}")


def _overdue(content: JSON) -> Iterator[Finding]:
    """Warn of instruments whose calibration was due before the day of the measurement."""
    day = entry(content, "measurement.date")
    for name, instrument in (content.get("instruments") or {}).items():
        due = instrument.get("calibration_due") if isinstance(instrument, dict) else None
        if isinstance(day, str) and isinstance(due, str) and due < day:
            message = f"was due on {due}, before the measurement on {day}: calibrate, or correct the date"
            yield Finding("warning", FILE, message, column=f"instruments.{name}.calibration_due")


def _rotation_fault(matrix: Array) -> str | None:
    """Describe what keeps a (3, 3) matrix from being a rotation."""
    if np.abs(matrix.T @ matrix - np.eye(3)).max() > ORTHONORMAL:
        return "its columns are not perpendicular unit vectors"
    return "it is left-handed (a mirror)" if np.linalg.det(matrix) < 0 else None


def _directions(rows: list[list[float]]) -> str | None:
    """Check that the tool's axes are the columns of a rotation."""
    fault = _rotation_fault(np.array(rows, dtype=float))
    return f"found {shown(rows)}, expected the tool's x, y, z axes as columns: {fault}" if fault else None


def _motion(rows: list[list[float]]) -> str | None:
    """Check that a 4×4 matrix is a rigid motion."""
    matrix = np.array(rows, dtype=float)
    fault = _rotation_fault(matrix[:3, :3])
    if not np.array_equal(matrix[3], [0, 0, 0, 1]):
        fault = "its last row is not 0 0 0 1"
    return f"expected a rigid motion (rotation and translation in mm): {fault}" if fault else None


def _not_metres(least: float) -> Callable[[Any], str | None]:
    """Return the check that the longest of several lengths is so many mm, or nought."""

    def rule(value: Any) -> str | None:
        longest = float(np.abs(np.array(value, dtype=float)).max())
        if not 0 < longest < least:
            return None
        return f"found {shown(value)}, expected {least:g} mm or more: it seems to be in metres"

    return rule


# Section of the manifest → check(section) of what a schema cannot express about its keys.
SECTIONS: dict[str, Callable[[JSON], Iterable[Finding]]] = {
    "known": _known,
    "limits": _limits,
    "tolerances": _tolerances,
    "files": mapping_findings,
}
# Semantic checks of what a schema cannot express: path of keys → rule(value) → message or None.
RULES: dict[str, Callable[[Any], str | None]] = {
    "tool": _tool,
    "tool_in_flange_mm": _not_metres(1.5),
    "work.size_mm": _not_metres(1.5),
    "work_in_base.xyz_mm": _not_metres(5.0),
    "tool_axes_in_flange": _directions,
    "instruments.dynamometer.axes": _axes,
    "instruments.scanner.to_work": _motion,
}
