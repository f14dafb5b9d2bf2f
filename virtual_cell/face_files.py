"""Files of a batch of faces: rows of its run table, its receptances, its manifest."""

from __future__ import annotations

from pathlib import Path

from virtual_cell.recipes.faces_draws import Case, Milling
from virtual_cell.units import DEG, MM, Array
from virtual_cell.write import Row, write_csv

_THICK_MM = 10.0


def face_row(
    milling: Milling, size: tuple[float, float], case: Case, *, run: str, place: int, replicate: int
) -> Row:
    """Row of the run table of a face; ``size`` of the plate, m."""
    return {
        "run": run,
        "role": case.role,
        "condition": case.condition,
        "replicate": replicate,
        "order": place,
        "operation": "face",
        "spindle_rpm": milling.spindle_rpm,
        "feed_per_tooth_mm": milling.feed / MM,
        "axial_depth_mm": case.depth_mm,
        "radial_depth_mm": milling.width / MM,
        "direction": "down",
        "feed_direction_deg": 0 if case.orientation == "L" else 90,
        "cut_length_mm": size[0] * size[1] / milling.width / MM,
        "wrist": case.wrist,
        "location": case.location,
        "orientation": case.orientation,
        "pose": case.pose,
        "path": f"path/{case.orientation}.csv",
        "scan": f"scan/{run}.ply",
    }


def write_frf(folder: Path, pose: str, word: str, frequency: Array, read: Array) -> Row:
    """Write a receptance (n,), m/N, of the tip along an axis at a pose; return its row of impacts.csv."""
    file = f"frf/{pose}-{word}.csv"
    columns = {"frequency_hz": frequency, "real": read.real, "imag": read.imag}
    write_csv(
        folder / file, [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    )
    point = {"reference": f"1{word}", "response": f"1{word}", "replicate": 1}
    kind = {"kind": "frf", "file": file, "response_unit": "m"}
    return {"test": f"tip-{pose}", "position": pose, **point, **kind}


def face_manifest(name: str, milling: Milling, size: tuple[float, float], scanner: Row) -> Row:
    """Return batch.yaml of plates of a ``size``, m; ``scanner`` as the manifest has it."""
    tool = milling.tool
    return {
        "format": 1,
        "batch": name,
        "title": f"Faces milled by an arm, {tool.teeth}-tooth {2.0 * tool.radius / MM:g} mm cutter",
        "source": "simulated",
        "cell": "milling-arm",
        "tool": {
            "diameter_mm": round(2.0 * tool.radius / MM, 6),
            "teeth": tool.teeth,
            "helix_deg": round(tool.helix / DEG, 6),
            "pitch_deg": [round(360 / tool.teeth)] * tool.teeth,
        },
        "work": {"material": "AW-5013", "size_mm": [*(round(v / MM, 6) for v in size), _THICK_MM]},
        "coefficients": dict(milling.declared),
        "instruments": {"scanner": scanner},
    }
