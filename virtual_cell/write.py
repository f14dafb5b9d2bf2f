"""Writing a batch folder: manifest, tables, signals and clouds, the same bytes every time."""

from __future__ import annotations

import csv
import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from virtual_cell.units import Array

Row = dict[str, Any]
RUN_COLUMNS = (
    *("run", "role", "condition", "replicate", "order", "operation", "spindle_rpm", "feed_per_tooth_mm"),
    *("axial_depth_mm", "radial_depth_mm", "direction", "orbit_rpm", "feed_direction_deg", "cut_length_mm"),
    *(
        "wrist",
        "location",
        "orientation",
        "pose",
        "dynamometer",
        "robot_log",
        "idle_log",
        "path",
        "scan",
        "profile",
    ),
    *("stable", "started_at"),
)


def fresh_folder(folder: Path) -> Path:
    """Make ``folder`` empty; refuse to clear one that does not hold a simulated batch."""
    import yaml

    if folder.exists() and any(folder.iterdir()):
        manifest = folder / "batch.yaml"
        source = yaml.safe_load(manifest.read_text()).get("source") if manifest.is_file() else None
        if source != "simulated":
            raise FileExistsError(f"{folder} is not empty and holds no simulated batch: it is left alone")
        shutil.rmtree(folder)
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def write_yaml(path: Path, content: Mapping[str, Any]) -> None:
    """Write a manifest, keys in the order given."""
    import yaml

    text = yaml.safe_dump(
        dict(content), sort_keys=False, allow_unicode=True, width=120, default_flow_style=None
    )
    path.write_text(text, encoding="utf-8")


def write_csv(path: Path, rows: Iterable[Row], columns: Iterable[str] | None = None) -> None:
    """Write a table; columns that are blank in every row are left out, numbers keep nine digits."""
    rows = list(rows)
    names = [name for name in (columns or rows[0]) if any(_text(row.get(name)) for row in rows)]
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(names)
        writer.writerows([_text(row.get(name)) for name in names] for row in rows)


def impact_row(point: str, file: str, kind: str, unit: str, replicate: int = 1) -> Row:
    """Row of impacts.csv of a tool struck and heard at ``point`` of position 1 ("1x").

    ``kind``: record or frf, of a response in ``unit``, m/s2 or m.
    """
    return {
        "test": "tip",
        "position": "1",
        "reference": point,
        "response": point,
        "replicate": replicate,
        "kind": kind,
        "file": file,
        "response_unit": unit,
    }


def _text(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.9g}" if isinstance(value, float | np.floating) else str(value)


def write_signal(path: Path, columns: Mapping[str, Array]) -> None:
    """Write a signal as Parquet: float32, zstd, bytes split by significance, which compresses better."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    path.parent.mkdir(parents=True, exist_ok=True)
    table = pa.table({name: np.asarray(values, dtype=np.float32) for name, values in columns.items()})
    pq.write_table(
        table, path, compression="zstd", compression_level=9, use_dictionary=False, use_byte_stream_split=True
    )


def write_ply(path: Path, points: Array) -> None:
    """Write a cloud (n, 3) as binary little-endian PLY, float32."""
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
    header += "".join(f"property float {axis}\n" for axis in "xyz") + "end_header\n"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(header.encode() + np.ascontiguousarray(points, dtype="<f4").tobytes())
