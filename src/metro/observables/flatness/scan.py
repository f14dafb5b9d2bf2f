"""One scanned face of a batch as tables: its indices, its map, and its heights at the points of the path."""

from __future__ import annotations

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.observables.flatness.path import beside, disc_along
from metro.observables.flatness.placing import Placed, place
from metro.surface.face import NESTING_INDEX, Face, measure_face
from metro.surface.face_noise import Noise
from metro.surface.footprint import Window, of_the_face, sample
from metro.surface.points import Points, box
from metro.units import JSON, MM, UM, Array

MAP_CELLS = 60

POINT_COLUMNS: tuple[str, ...] = (
    *("run", "point", "pass", "x_mm", "y_mm", "s_mm"),
    *("programmed_z_mm", "z_mm", "sigma_mm", "k", "coverage"),
    *("disc_along_mm", "disc_across_mm"),
)
FACE_TABLES: dict[str, tuple[str, ...]] = {
    "face_indices": (
        *("run", "index_name", "value_um", "bias_um", "corrected_um", "u_um", "low_um", "high_um"),
        *(
            "sigma_um",
            "sigma_source",
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
    "face_contacts": ("run", "side", "x_mm", "y_mm", "deviation_um"),
    "face_placed": ("run", "method", "x_sd_um", "y_sd_um", "remark"),
    "face_points": POINT_COLUMNS,
    "face_beside": POINT_COLUMNS,  # on either side of the path, where the groove of a pass rises
}


def measured_run(
    batch: Batch, run: str, cloud: Points, path: pd.DataFrame, repeats: Noise | None = None
) -> tuple[dict[str, pd.DataFrame], str | None]:
    """Return the tables of one face from its ``cloud`` (n, 3), m, and the reason if some are missing.

    Without a path or a place in the work frame there are only indices and a map. ``repeats``: noise from
    repeat scans of the face.
    """
    if not len(cloud):
        return {}, "its scan holds no points"
    step = float(np.spacing(np.float32(np.abs(box(cloud)).max())))
    points = path[["x_mm", "y_mm", "z_mm"]].to_numpy(dtype=float) * MM
    placed = place(batch, cloud, points if len(points) else None)
    cloud = placed.cloud
    scanner = batch.instrument("scanner")
    sigma = float(scanner["sigma_mm"]) * MM if "sigma_mm" in scanner else None
    nesting = float(scanner.get("nesting_index_mm", NESTING_INDEX / MM)) * MM
    try:
        face = measure_face(cloud, sigma, "scanner.sigma_mm of batch.yaml", nesting, step, repeats=repeats)
    except ValueError as error:
        return {}, f"its scan: {error}"
    tables = {
        "face_indices": _indices(run, face),
        "face_map": _map(run, face.map_points, face.map_deviations),
        "face_contacts": _contacts(run, face),
        "face_placed": _placed(run, placed),
    }
    if path.empty:
        return tables, "it has no path file, so its face cannot be paired with a prediction"
    if not placed.method:
        return tables, placed.remark
    disc = disc_along(path, face.spacing)
    tables["face_points"] = _points(run, cloud, face.outliers, path, disc)
    if len(aside := beside(path)):
        tables["face_beside"] = _points(run, cloud, face.outliers, aside, disc)
    return tables, None


def _placed(run: str, placed: Placed) -> pd.DataFrame:
    row = [run, placed.method, placed.sd[0] / UM, placed.sd[1] / UM, placed.remark]
    return pd.DataFrame([row], columns=list(FACE_TABLES["face_placed"]))


def _indices(run: str, face: Face) -> pd.DataFrame:
    shared: JSON = {
        "sigma_um": face.sigma / UM,
        "sigma_source": face.sigma_source,
        "local_sigma_um": face.local_sigma / UM,
        "nesting_index_mm": face.nesting_index / MM if face.nesting_index else float("nan"),
        "points": face.points,
        "outliers": len(face.outliers),
        "spacing_mm": face.spacing / MM,
        "margin_mm": face.margin / MM,
        "crop_holds": face.crop_holds,
    }
    rows = [
        {"run": run, "index_name": name, "value_um": index.value / UM, "bias_um": index.bias / UM}
        | {"corrected_um": index.corrected / UM, "u_um": index.sd / UM}
        | {"low_um": index.low / UM, "high_um": index.high / UM}
        | shared
        for name, index in face.indices.items()
    ]
    return pd.DataFrame(rows, columns=list(FACE_TABLES["face_indices"]))


def _contacts(run: str, face: Face) -> pd.DataFrame:
    """Points at which the two planes of the minimum zone touch the face."""
    rows = [
        (run, side, *(face.map_points[at, :2] / MM), face.map_deviations[at] / UM)
        for side, touched in (("upper", face.zone.upper), ("lower", face.zone.lower))
        for at in touched
    ]
    return pd.DataFrame(rows, columns=list(FACE_TABLES["face_contacts"]))


def _map(run: str, points: Array, deviations: Array) -> pd.DataFrame:
    """Means over at most 60 × 60 cells of the face's extents in x and y, no cell finer than the points."""
    corner, extent = points[:, :2].min(axis=0), np.ptp(points[:, :2], axis=0)
    pitch = float(np.sqrt(np.prod(extent) / len(points)))
    cells = np.clip((0.9 * extent / pitch).astype(np.intp), 1, MAP_CELLS)
    number = np.minimum((points[:, :2] - corner) / extent * cells, cells - 1).astype(np.intp)
    cell = number[:, 0] * cells[1] + number[:, 1]
    count = np.bincount(cell, minlength=int(np.prod(cells)))
    total = np.bincount(cell, weights=deviations, minlength=len(count))
    seen = np.flatnonzero(count)
    centre = corner + (np.column_stack(np.divmod(seen, cells[1])) + 0.5) / cells * extent
    means = total[seen] / count[seen] / UM
    return pd.DataFrame(
        {"run": run, "x_mm": centre[:, 0] / MM, "y_mm": centre[:, 1] / MM, "deviation_um": means}
    )


def _points(run: str, cloud: Points, outliers: np.ndarray, path: pd.DataFrame, disc: Window) -> pd.DataFrame:
    """Heights in the discs of the path points; standard errors allow for noise correlated over a disc.

    A disc that holds more than the face has no height.
    """
    points = path[["x_mm", "y_mm", "z_mm"]].to_numpy(dtype=float) * MM
    sampled = sample(cloud, points[:, 0], points[:, 1], disc, without=outliers)
    number = path["pass"].to_numpy()
    step = np.linalg.norm(np.diff(points, axis=0), axis=1) * (np.diff(number) == 0)
    alone = sampled.sd / np.sqrt(np.maximum(sampled.count, 1))
    height = of_the_face(sampled)
    known = alone[np.isfinite(alone)]  # none where the cloud is too coarse for a disc to hold points
    typical = float(np.median(known)) if known.size else float("nan")
    correlated = _noise_along_passes(height - points[:, 2], number) / typical
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
            "z_mm": height / MM,
            "sigma_mm": sigma / MM,
            "k": sampled.count,
            "coverage": sampled.coverage,
            "disc_along_mm": disc.along / MM,
            "disc_across_mm": disc.across / MM,
        }
    )


def _noise_along_passes(deviation: Array, number: np.ndarray) -> float:
    """Noise of disc means from their second differences within passes (robust): it includes correlation."""
    second = deviation[:-2] - 2 * deviation[1:-1] + deviation[2:]
    second = second[(number[:-2] == number[2:]) & np.isfinite(second)]
    return 1.4826 * float(np.median(np.abs(second))) / np.sqrt(6) if len(second) > 10 else float("nan")
