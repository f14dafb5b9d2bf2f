"""One scanned face of a batch as tables: its indices, its map, and its heights at the points of the path."""

from __future__ import annotations

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.surface.face import NESTING_INDEX, Face, measure_face
from metro.surface.footprint import sample
from metro.units import JSON, MM, UM, Array

MAP_CELLS = 60
PLACED_WITHIN = 3 * MM  # how far a cloud without a declared transform may miss the outline of the work

FACE_TABLES: dict[str, tuple[str, ...]] = {
    "face_indices": (
        *("run", "index_name", "value_um", "bias_um", "corrected_um", "u_um", "sigma_um", "sigma_source"),
        *(
            "local_sigma_um",
            "nesting_index_mm",
            "points",
            "outliers",
            "spacing_mm",
            "margin_mm",
            "crop_holds",
        ),
    ),
    "face_map": ("run", "x_mm", "y_mm", "deviation_um"),
    "face_points": (
        *(
            "run",
            "point",
            "pass",
            "x_mm",
            "y_mm",
            "s_mm",
            "programmed_z_mm",
            "z_mm",
            "sigma_mm",
            "k",
            "coverage",
        ),
    ),
}


def measured_run(
    batch: Batch, run: str, scan: pd.DataFrame, path: pd.DataFrame
) -> tuple[dict[str, pd.DataFrame], str | None]:
    """Return the tables of one face, and why some are lacking.

    Without a path or a place in the work frame there are indices and a map only.
    """
    cloud = scan[["x_mm", "y_mm", "z_mm"]].to_numpy(dtype=float) * MM
    if not len(cloud):
        return {}, "its scan holds no points"
    scanner = batch.instrument("scanner")
    sigma = float(scanner["sigma_mm"]) * MM if "sigma_mm" in scanner else None
    nesting = float(scanner.get("nesting_index_mm", NESTING_INDEX / MM)) * MM
    step = float(np.spacing(np.float32(np.abs(cloud).max())))
    try:
        face = measure_face(cloud, sigma, "scanner.sigma_mm of batch.yaml", nesting, step)
    except ValueError as error:
        return {}, f"its scan: {error}"
    tables = {
        "face_indices": _indices(run, face),
        "face_map": _map(run, face.map_points, face.map_deviations),
    }
    if path.empty:
        return tables, "it has no path file, so its face cannot be paired with a prediction"
    points = path[["x_mm", "y_mm", "z_mm"]].to_numpy(dtype=float) * MM
    if "to_work" not in scanner and not _lies_on_the_work(batch, cloud, points):
        return (
            tables,
            "instruments.scanner.to_work is not given and the scan does not lie on the work's outline",
        )
    tables["face_points"] = _points(run, cloud[~face.rejected], path, points)
    return tables, None


def _indices(run: str, face: Face) -> pd.DataFrame:
    shared: JSON = {
        "sigma_um": face.sigma / UM,
        "sigma_source": face.sigma_source,
        "local_sigma_um": face.local_sigma / UM,
        "nesting_index_mm": face.nesting_index / MM if face.nesting_index else float("nan"),
        "points": face.points,
        "outliers": int(face.rejected.sum()),
        "spacing_mm": face.spacing / MM,
        "margin_mm": face.margin / MM,
        "crop_holds": face.crop_holds,
    }
    rows = [
        {"run": run, "index_name": name, "value_um": index.value / UM, "bias_um": index.bias / UM}
        | {"corrected_um": index.corrected / UM, "u_um": index.sd / UM}
        | shared
        for name, index in face.indices.items()
    ]
    return pd.DataFrame(rows, columns=list(FACE_TABLES["face_indices"]))


def _map(run: str, points: Array, deviations: Array) -> pd.DataFrame:
    """Means over at most 60 × 60 cells of the face's extents in x and y."""
    corner, extent = points[:, :2].min(axis=0), np.ptp(points[:, :2], axis=0)
    number = np.minimum((points[:, :2] - corner) / extent * MAP_CELLS, MAP_CELLS - 1).astype(np.intp)
    cell = number[:, 0] * MAP_CELLS + number[:, 1]
    count = np.bincount(cell, minlength=MAP_CELLS**2)
    total = np.bincount(cell, weights=deviations, minlength=MAP_CELLS**2)
    seen = np.flatnonzero(count)
    centre = corner + (np.column_stack(np.divmod(seen, MAP_CELLS)) + 0.5) / MAP_CELLS * extent
    means = total[seen] / count[seen] / UM
    return pd.DataFrame(
        {"run": run, "x_mm": centre[:, 0] / MM, "y_mm": centre[:, 1] / MM, "deviation_um": means}
    )


def _lies_on_the_work(batch: Batch, cloud: Array, path: Array) -> bool:
    """Whether the outline of a cloud is that of the work in its own frame (its corner is the origin)."""
    size = (batch.manifest.get("work") or {}).get("size_mm")
    if size:
        low, high = np.zeros(2), np.array(size[:2], dtype=float) * MM
    else:
        low, high = path[:, :2].min(axis=0), path[:, :2].max(axis=0)
    misses = [np.abs(cloud[:, :2].min(axis=0) - low).max(), np.abs(cloud[:, :2].max(axis=0) - high).max()]
    return bool(max(misses) <= PLACED_WITHIN)


def _points(run: str, cloud: Array, path: pd.DataFrame, points: Array) -> pd.DataFrame:
    """Heights in the discs of the path points; standard errors allow for noise correlated over a disc."""
    found = sample(cloud, points[:, 0], points[:, 1])
    number = path["pass"].to_numpy()
    step = np.linalg.norm(np.diff(points, axis=0), axis=1) * (np.diff(number) == 0)
    alone = found.sd / np.sqrt(np.maximum(found.count, 1))
    correlated = _noise_along_passes(found.height - points[:, 2], number) / float(np.nanmedian(alone))
    sigma = alone * max(1.0, correlated) if np.isfinite(correlated) else alone
    return pd.DataFrame(
        {
            "run": run,
            "point": path["point"].to_numpy(),
            "pass": number,
            "x_mm": points[:, 0] / MM,
            "y_mm": points[:, 1] / MM,
            "s_mm": np.concatenate([[0.0], np.cumsum(step)]) / MM,
            "programmed_z_mm": points[:, 2] / MM,
            "z_mm": found.height / MM,
            "sigma_mm": sigma / MM,
            "k": found.count,
            "coverage": found.coverage,
        }
    )


def _noise_along_passes(deviation: Array, number: np.ndarray) -> float:
    """Noise of disc means by their second differences within passes (robust): it knows the correlation."""
    second = deviation[:-2] - 2 * deviation[1:-1] + deviation[2:]
    second = second[(number[:-2] == number[2:]) & np.isfinite(second)]
    return 1.4826 * float(np.median(np.abs(second))) / np.sqrt(6) if len(second) > 10 else float("nan")
