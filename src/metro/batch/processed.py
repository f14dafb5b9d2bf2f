"""The canonical tables of a batch: written whole or not at all, with their provenance in the metadata."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import pandas as pd

from metro import __version__
from metro.batch.batch import Batch
from metro.batch.columns import CROSS_STIFFNESS
from metro.batch.writing import write_atomically
from metro.joint_columns import JOINT_COLUMNS, MOVED, PLACE, POSITIONS, TORQUES, TURNED
from metro.units import JSON

# Every table that ingest writes, always, with these columns (no rows where the batch has no such data).
COLUMNS: dict[str, tuple[str, ...]] = {
    "force": ("run", "t_s", "fx_n", "fy_n", "fz_n", "spindle_deg"),
    "robot": (
        "run",
        "log",
        "t_s",
        *(name for name in JOINT_COLUMNS if not name.startswith(("current", "temperature"))),
    ),
    "joint": ("run", "t_s", *JOINT_COLUMNS),
    "path": ("run", "point", "pass", "x_mm", "y_mm", "z_mm"),
    "scan": ("run", "x_mm", "y_mm", "z_mm"),
    "profile": ("run", "x_mm", "z_mm"),
    "slopes": ("run", "line", "x1_mm", "y1_mm", "x2_mm", "y2_mm", "slope_urad"),
    "poses": (
        *("run", *POSITIONS, "x_mm", "y_mm", "z_mm", "rx_deg", "ry_deg", "rz_deg", "q1", "q2", "q3", "q4"),
        *("t_s", "temperature_c", "sigma_mm", "sigma_x_mm", "sigma_y_mm", "sigma_z_mm", "target", "point"),
        *("distance_mm", "station", "payload_kg"),
    ),
    "targets": ("run", *POSITIONS, *PLACE, *TURNED),
    "hit": (
        "test",
        "position",
        "reference",
        "response",
        "replicate",
        "response_unit",
        "t_s",
        "force_n",
        "response_si",
    ),
    "frf": (
        "test",
        "position",
        "reference",
        "response",
        "replicate",
        "frequency_hz",
        "real_m_n",
        "imag_m_n",
        "coherence",
    ),
    "pickups": ("position", "reference", "response", "distance_mm"),
    "loads": (
        "pose",
        "point",
        *POSITIONS,
        *("x_mm", "y_mm", "z_mm", "fx_n", "fy_n", "fz_n", "dx_mm", "dy_mm", "dz_mm", "replicate"),
        "sigma_mm",
    ),
    "mass": (
        *("pose", "point", "x_mm", "y_mm", "z_mm", "mxx", "mxy", "mxz", "myy", "myz", "mzz"),
        *POSITIONS,
    ),
    "touches": (
        *("touched", "x_mm", "y_mm", "z_mm", "q1", "q2", "q3", "q4", "rx_deg", "ry_deg", "rz_deg"),
        "sigma_mm",
    ),
    "payload": ("loaded", *POSITIONS, *TORQUES, *MOVED),
    "stations": (
        *("position", "x_mm", "y_mm", "z_mm", "kx_n_um", "ky_n_um", "kz_n_um"),
        *CROSS_STIFFNESS,
    ),
    "published": (
        *("table", "row", "observable", "quantity", "axis", "measured", "predicted", "unit"),
        *("printed_error_percent", "note"),
    ),
    "qc": ("file", "run", "check", "value", "limit", "ok", "message"),
}


def write_json(path: Path, content: JSON) -> None:
    """Write a JSON file atomically, keys in the order given; NaN is not JSON and is refused."""
    text = json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    write_atomically(path, lambda stream: stream.write(text.encode()))


def read_json(path: Path) -> JSON:
    """Read a JSON file that a stage wrote."""
    content: JSON = json.loads(path.read_text(encoding="utf-8"))
    return content


def write_table(path: Path, table: pd.DataFrame, provenance: Mapping[str, str] | None = None) -> None:
    """Write a Parquet table atomically, with ``provenance`` and the code's version in its schema metadata."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    content = pa.Table.from_pandas(table, preserve_index=False)
    metadata = {**(content.schema.metadata or {}), b"metro.version": __version__.encode()}
    metadata |= {f"metro.{key}".encode(): value.encode() for key, value in (provenance or {}).items()}
    content = content.replace_schema_metadata(metadata)
    write_atomically(path, lambda stream: pq.write_table(content, stream, compression="zstd"))


def read_table(path: Path, run: str | None = None) -> pd.DataFrame:
    """Read a processed table, or the rows of one run of it."""
    filters = None if run is None else [("run", "==", run)]
    return pd.read_parquet(path, filters=filters)


class Tables(Protocol):
    """The canonical tables of a batch: called with a name, and perhaps a run, it returns their rows."""

    def __call__(self, name: str, run: str | None = None) -> pd.DataFrame:
        """Return a table, or the rows of one run of it."""

    def pieces(self, name: str, run: str) -> Iterator[pd.DataFrame]:
        """Yield the rows of one run of a table, some at a time."""


@dataclass(frozen=True)
class Processed:
    """The canonical tables in the folder of a batch, :class:`Tables`."""

    folder: Path

    def __call__(self, name: str, run: str | None = None) -> pd.DataFrame:
        """Return a table, or the rows of one run of it."""
        return read_table(self.folder / f"{name}.parquet", run)

    def pieces(self, name: str, run: str) -> Iterator[pd.DataFrame]:
        """Yield the rows of one run of a table as ingest wrote them, a row group at a time."""
        import pyarrow.parquet as pq

        with pq.ParquetFile(self.folder / f"{name}.parquet", memory_map=False) as file:
            place = file.schema_arrow.get_field_index("run")
            for group in range(file.num_row_groups):
                of = file.metadata.row_group(group).column(place).statistics
                if of is None or of.min is None or of.min <= run <= of.max:
                    table = file.read_row_group(group, use_threads=False).to_pandas()
                    yield table[table["run"] == run]


def write_batch(folder: Path, batch: Batch, provenance: Mapping[str, str]) -> None:
    """Write what describes the batch: ``runs.parquet``, then ``batch.json`` (manifest, cell, plan)."""
    write_table(folder / "runs.parquet", batch.runs.reset_index(), provenance)
    content = {"batch": batch.name, "manifest": batch.manifest, "cell": batch.cell, "plan": batch.plan}
    write_json(folder / "batch.json", content)


def read_batch(folder: Path) -> Batch:
    """Read what :func:`write_batch` wrote."""
    content = json.loads((folder / "batch.json").read_text())
    runs = pd.read_parquet(folder / "runs.parquet").set_index("run")
    return Batch(content["batch"], content["manifest"], content["cell"], runs, content["plan"])
